"""The scene file of LabBuilder: a room, and objects with their poses. Lengths in meters, angles in degrees.

Other forms of the same fields, as files of other versions have them, are brought into this one. An error names the
unit that the lengths seem to have if it is not meters.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from pydantic import ConfigDict, Field, ValidationError

from labgym.counts import is_real
from labgym.documents import Record, document_error, read_json
from labgym.errors import DocumentError
from labgym.layouts.floor import Coordinate, Door, Identifier

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


LONGEST = 100.0
"""Longest side of a room and greatest coordinate, meters."""
UNITS = ((2000.0, "millimeters", 1000), (LONGEST, "centimeters", 100))
"""Largest length from which numbers look like a unit, its name, and how many make a meter."""
ANGLES = ("rotation",)
"""Fields whose numbers are no lengths."""


def scaled_error(path: object, error: ValidationError, data: Any) -> DocumentError:
    """Return the error of an invalid file, with a hint at the unit if its lengths are too large for meters.

    Args:
        data: the content of the file.
    """
    named = document_error(path, error)
    first = error.errors(include_url=False)[0]
    out_of_range = first["type"] in ("less_than_equal", "less_than", "greater_than_equal")
    largest = max((abs(value) for value in _lengths(data) if math.isfinite(value)), default=0.0)
    unit = next(((name, count) for least, name, count in UNITS if largest > least), None)
    if not out_of_range or unit is None or set(first["loc"]) & set(ANGLES):
        return named
    name, count = unit
    problem = str(named).removeprefix(f"{path}: field {named.field}: ")
    hint = f"lengths are meters, and up to {largest:g} looks like {name}: divide all lengths by {count}"
    return DocumentError(path, named.field, f"{problem}; {hint}")


def _lengths(data: Any) -> Iterator[float]:
    """Yield all numbers of a file but its angles."""
    if isinstance(data, dict | list):
        for name, each in data.items() if isinstance(data, dict) else enumerate(data):
            if name not in ANGLES:
                yield from _lengths(each)
    elif is_real(data):
        yield float(data)


SIDES = {"width": "w", "depth": "d", "height": "h", "x": "w", "y": "d", "z": "h"}
"""Names of the room's sides, by other names."""
MAX_QUERY = 2000
LONGEST_ID = 74
_NOT_IN_IDS = re.compile(r"[^A-Za-z0-9_.-]+")


def identifier(name: str) -> str:
    """Return a name as an id of a placement: letters, digits, `_`, `.` and `-`."""
    return _NOT_IN_IDS.sub("_", name).strip("_.-")[:LONGEST_ID] or "object"


def regular(data: dict[str, Any]) -> tuple[dict[str, Any], tuple[str, ...]]:
    """Return a scene's data in the form that is read, and notes on what was taken for what.

    Null counts as missing, a list of three numbers as x, y, z (of the room: w, d, h), objects by name as a list of
    objects, and an empty location as the floor. Anything else is left to the check of the fields.
    """
    changes: Counter[str] = Counter()
    scene = _without_nulls(data, "", changes)
    query = scene.get("query", "")
    if not isinstance(query, str) or len(query) > MAX_QUERY:
        changes["query is not a text of at most 2000 characters; left out"] += 1
        del scene["query"]
    if "room_size" in scene:
        scene["room_size"] = _room_size(scene["room_size"], changes)
    objects = scene.get("objects")
    if isinstance(objects, dict):
        changes["objects are listed by name"] += 1
        objects = [{"id": name, **each} if isinstance(each, dict) else each for name, each in objects.items()]
    if isinstance(objects, list):
        scene["objects"] = [_object(each, changes) if isinstance(each, dict) else each for each in objects]
    return scene, tuple(text if count == 1 else f"{text} ({count} times)" for text, count in changes.items())


def _object(data: dict[str, Any], changes: Counter[str]) -> dict[str, Any]:
    each = _without_nulls(data, "objects.", changes)
    for name in ("position", "rotation"):
        if name in each:
            each[name] = _vector(each[name], ("x", "y", "z"), f"objects.{name}", changes)
    if each.get("initial_location") == "":
        changes["objects.initial_location is empty; taken as the floor"] += 1
        del each["initial_location"]
    return each


def _room_size(value: Any, changes: Counter[str]) -> Any:
    value = _vector(value, ("w", "d", "h"), "room_size", changes)
    if isinstance(value, dict):
        other = [name for name in value if name in SIDES and SIDES[name] not in value]
        if other:
            changes[f"room_size has {', '.join(other)}; taken as {', '.join(SIDES[name] for name in other)}"] += 1
            value = {SIDES[name] if name in other else name: side for name, side in value.items()}
    return value


def _vector(value: Any, names: tuple[str, str, str], field: str, changes: Counter[str]) -> Any:
    if isinstance(value, list) and len(value) == len(names):
        changes[f"{field} is a list; taken as {', '.join(names)}"] += 1
        return dict(zip(names, value, strict=True))
    return value


def _without_nulls(data: dict[str, Any], prefix: str, changes: Counter[str]) -> dict[str, Any]:
    for name, value in data.items():
        if value is None:
            changes[f"{prefix}{name[:80]} is null; taken as missing"] += 1
    return {name: value for name, value in data.items() if value is not None}
