"""Rooms to generate layouts in: presets, sizes such as "12x9", and room files."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import ClassVar, Literal, get_args

from labgym.documents import Document, validating
from labgym.errors import OptionError, check_name
from labgym.layouts.floor import Door, Floor, Room, Service

PUBLISHED_PRESETS: dict[str, Room] = {
    room.name: room
    for room in (
        Room(name="tight", width=6.6, depth=7.2, doors=(Door(wall="front", offset=1.3),)),
        Room(name="default", width=8.0, depth=8.0, doors=(Door(wall="front", offset=1.5),)),
        Room(name="roomy", width=8.0, depth=10.0, doors=(Door(wall="front", offset=1.5),)),
        Room(
            name="two_exits",
            width=7.0,
            depth=13.0,
            doors=(Door(wall="front", offset=1.4), Door(wall="left", offset=6.5)),
        ),
    )
}
"""Rooms of the published layouts, smallest first; they never change. All but the last have one
door. 6.6 m is the standard bay of parallel benches (JGJ 91)."""


def _with_second_exit(name: str, room: Room, second: Door) -> Room:
    return room.model_copy(update={"name": name, "doors": (*room.doors, second)})


def _outward(room: Room) -> Room:
    """Return a room whose doors open out of it, as exits of laboratories do (NFPA 101, 7.2.1.4.2)."""
    return room.model_copy(update={"doors": tuple(door.model_copy(update={"outward": True}) for door in room.doors)})


PRESETS: dict[str, Room] = {
    room.name: _outward(room)
    for room in sorted(
        (
            _with_second_exit("bay_small", PUBLISHED_PRESETS["tight"], Door(wall="right", offset=2.7)),
            _with_second_exit("bay", PUBLISHED_PRESETS["default"], Door(wall="right", offset=3.0)),
            _with_second_exit("bay_large", PUBLISHED_PRESETS["roomy"], Door(wall="right", offset=4.0)),
            *PUBLISHED_PRESETS.values(),
        ),
        key=lambda room: (room.width * room.depth, -len(room.doors)),
    )
}
"""Presets by name, smallest floor first; of rooms of one size the one with two exits first. Their exits are more than
half the room's diagonal apart (NFPA 101, 7.5.1.3)."""

DEFAULT = "bay"
"""The preset of a new layout unless a room is named."""


SIZE = re.compile(r"(\d+(?:\.\d+)?)\s*[x×]\s*(\d+(?:\.\d+)?)", re.IGNORECASE)
"""A room by its size: WIDTHxDEPTH in meters."""
FROM_CORNER = 1.5
"""Distance of the doors of a room given by its size from the nearest corner, meters."""


SERVICE_SPACING = 2.0
"""Greatest distance between the service points of a wall, meters: less than the reach of each kind, so that the whole
wall is supplied."""
Supply = Literal["water", "gas", "exhaust"]
Side = Literal["front", "back", "left", "right"]


class RoomFile(Document, Room):
    """A room file: the fields of `Room`."""

    SCHEMA: ClassVar[str] = "labgym.room/1"

    def room(self) -> Room:
        """Return the room."""
        return Room(**{name: getattr(self, name) for name in Room.model_fields})


def room_presets() -> dict[str, Room]:
    """Return the presets by name, smallest floor area first."""
    return dict(PRESETS)


def resolve_room(room: Room | str | Path | None) -> Room:
    """Return the room that an argument names.

    Args:
        room: a `Room`; the name of a preset; a size such as "12x9", width by depth in meters, which gets a door in the
            front wall and one in the right wall; the path of a `labgym.room/1` file; None for the preset "bay" (8 x 8 m
            with two doors).

    Raises:
        UnknownNameError: no preset has that name.
        DocumentError: the file, or the size, describes no room.
        OptionError: the argument is something else, or the room has no door.
    """
    if room is None:
        return PRESETS[DEFAULT]
    if isinstance(room, Path) or (isinstance(room, str) and room.endswith(".json")):
        resolved = RoomFile.load(room).room()
    elif isinstance(room, Room):
        resolved = room
    elif isinstance(room, str):
        resolved = _by_name(room)
    else:
        raise OptionError(
            f"room must be a Room, a preset's name, a size such as '12x9' or a .json file, got {type(room).__name__}"
        )
    if not resolved.doors:
        raise OptionError(f"room {resolved.name!r} has no door: add one, for example Door(wall='front', offset=1.5)")
    return resolved


def _by_name(name: str) -> Room:
    size = SIZE.fullmatch(name.strip())
    if size is not None:
        width, depth = float(size[1]), float(size[2])
        offsets = {"front": FROM_CORNER, "right": max(depth - FROM_CORNER, 0.5)}
        doors = [{"wall": wall, "offset": offset, "outward": True} for wall, offset in offsets.items()]
        with validating(f"room {name!r}"):
            # Validated in one go, so that a room that is too large is refused as such, and not by its doors.
            return Room.model_validate({"name": f"{width:g}x{depth:g}", "width": width, "depth": depth, "doors": doors})
    check_name("room preset (or a size such as 12x9, or a .json file)", name, PRESETS)
    return PRESETS[name]


def with_services(room: Room, services: Sequence[str]) -> Floor:
    """Return the floor of a room with service points along some of its walls.

    Args:
        services: texts KIND:WALL, such as exhaust:back: water, gas or exhaust along the front, back, left or right
            wall. With KIND:WALL:required, all furniture that needs the kind must stand within reach; else it stands
            there if it can.

    Raises:
        OptionError: a text is something else.
    """
    points = [point for text in services for point in _service_points(room, text)]
    return room.floor.model_copy(update={"services": tuple(points)})


def _service_points(room: Room, text: str) -> list[Service]:
    kind, _, rest = text.partition(":")
    wall, _, word = rest.partition(":")
    if kind not in get_args(Supply) or wall not in get_args(Side) or word not in ("", "required"):
        raise OptionError(
            f"service {text[:80]!r} is not KIND:WALL or KIND:WALL:required, such as exhaust:back; kinds: "
            f"{', '.join(get_args(Supply))}; walls: {', '.join(get_args(Side))}"
        )
    length = room.width if wall in ("front", "back") else room.depth
    count = math.ceil(length / SERVICE_SPACING)
    points = []
    for along in ((k + 0.5) * length / count for k in range(count)):
        x, y = {"front": (along, 0.0), "back": (along, room.depth), "left": (0.0, along), "right": (room.width, along)}[
            wall
        ]
        z = room.height if kind == "exhaust" else 0.0
        points.append(Service(kind=kind, x=round(x, 4), y=round(y, 4), z=z, required=bool(word)))
    return points
