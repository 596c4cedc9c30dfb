"""The scene file of LabBuilder: a room, and objects with their poses. Lengths in meters, angles in degrees."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from pydantic import ConfigDict, Field, ValidationError

from labgym.documents import Record, read_json
from labgym.errors import DocumentError
from labgym.layouts.floor import Coordinate, Door, Identifier
from labgym.paper.labbuilder.forms import regular
from labgym.paper.labbuilder.scale import scaled_error

MAX_BYTES = 4 * 1024 * 1024
MAX_OBJECTS = 2000
ROOM_OBJECTS = ("laboratoryroom",)
"""Keys of the objects that stand for the room itself."""
_NOT_IN_KEYS = re.compile(r"[^a-z0-9]+")


def key(text: str) -> str:
    """Return a name without case and separators: `reagent_cabinet` and `ReagentCabinet` have the same key."""
    return _NOT_IN_KEYS.sub("", text.casefold())


class Tolerant(Record):
    """A record of another program's file: further fields are not read."""

    model_config = ConfigDict(extra="ignore")


class Position(Tolerant):
    """Center of an object's bottom face; origin at the outer front-left corner of the room, on the floor."""

    x: Coordinate
    y: Coordinate
    z: Coordinate = 0.0


class Rotation(Tolerant):
    """Rotations in degrees; about Z counter-clockwise, the front along +y at 0 and along -x at 90."""

    x: Annotated[float, Field(ge=-3600.0, le=3600.0)] = 0.0
    y: Annotated[float, Field(ge=-3600.0, le=3600.0)] = 0.0
    z: Annotated[float, Field(ge=-3600.0, le=3600.0)] = 0.0


class RoomSize(Tolerant):
    """Outer width along x and depth along y, walls included, and height."""

    w: Annotated[float, Field(gt=0.0, le=100.0)]
    d: Annotated[float, Field(gt=0.0, le=100.0)]
    h: Annotated[float, Field(gt=0.0, le=100.0)]


class SceneObject(Tolerant):
    """An object: its kind, which may occur several times, its pose, and what carries it.

    Attributes:
        initial_location: `floor`, or the name of the object that carries it in snake case.
    """

    id: Annotated[str, Field(pattern=r"^[^/\\\x00-\x1f]{1,200}$")]
    position: Position
    rotation: Rotation = Rotation()
    initial_location: Annotated[str, Field(min_length=1, max_length=80)] = "floor"

    @property
    def is_room(self) -> bool:
        """Whether the object stands for the room."""
        return key(self.id) in ROOM_OBJECTS


class LabBuilderScene(Tolerant):
    """A scene.

    Attributes:
        query: the request that the scene was generated for.
        doors: doors of the interior, as in `labgym.layouts.Room`. Only files that labgym wrote have any.
    """

    query: Annotated[str, Field(max_length=2000)] = ""
    room_size: RoomSize | None = None
    objects: Annotated[tuple[SceneObject, ...], Field(max_length=MAX_OBJECTS)]
    id: Identifier | None = None
    doors: Annotated[tuple[Door, ...], Field(max_length=8)] = ()


@dataclass(frozen=True)
class SceneFile:
    """A scene, the names of the fields in its file that were not read, sorted, and notes on fields in another form."""

    scene: LabBuilderScene
    unread: tuple[str, ...]
    notes: tuple[str, ...]


def read_scene(path: str | Path) -> SceneFile:
    """Read a scene file.

    Raises:
        DocumentError: the file is missing, larger than 4 MB, not JSON, or not a scene; names the field.
    """
    data = read_json(path, MAX_BYTES)
    if not isinstance(data, dict) or "objects" not in data:
        raise DocumentError(path, "objects", "missing; a scene of LabBuilder is an object with the list 'objects'")
    data, notes = regular(data)
    try:
        scene = LabBuilderScene.model_validate(data)
    except ValidationError as error:
        raise scaled_error(path, error, data) from None
    return SceneFile(scene, _unread(data), notes)


def _unread(data: dict[str, Any]) -> tuple[str, ...]:
    """Return the names of the fields of a scene and of its objects that the records here do not have."""
    names = {name for name in data if name not in LabBuilderScene.model_fields}
    for each in data["objects"]:
        names.update(f"objects.{name}" for name in each if name not in SceneObject.model_fields)
    return tuple(sorted(name[:80] for name in names))
