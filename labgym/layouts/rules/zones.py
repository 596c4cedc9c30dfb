"""Floor areas that should stay free: inside doors and in front of furniture."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from labgym.geometry import BoxArray, OrientedBox, pairwise_penetration
from labgym.layouts.model import FLOOR, WALL, Door, Room
from labgym.layouts.rules.thresholds import LOOSE

if TYPE_CHECKING:
    from labgym.layouts.rules.arrangement import Arrangement

DOOR_AREA = 1.2
"""Side of the square kept clear inside a door, metres: the swing of the leaf and a person next to it."""

INTRUSION = 0.05
"""An object that reaches less far into a zone does not obstruct it, metres: wall boards, skirting, pipes."""

HEADROOM = 2.0
"""Objects that hang higher than this obstruct nobody, meters (OSHA 1910.36(g)(1): projections above an exit route)."""


def door_span(door: Door) -> float:
    """Return the length of wall that a door keeps free of furniture, meters."""
    return max(door.width, DOOR_AREA)


def door_area(room: Room, door: Door, depth: float = DOOR_AREA) -> OrientedBox:
    """Return the floor inside a door that stays free, as a box of standing height whose front is toward the room."""
    x, y, yaw = door_pose(room, door)
    x, y = x - math.sin(yaw) * depth / 2.0, y + math.cos(yaw) * depth / 2.0
    return OrientedBox(x, y, door_span(door), depth, yaw, 0.0, HEADROOM)


def doorway(room: Room, door: Door) -> OrientedBox:
    """Return the opening itself as a thin box on the wall's inner face."""
    x, y, yaw = door_pose(room, door)
    return OrientedBox(x, y, door.width, 0.0, yaw, 0.0, door.height)


def door_pose(room: Room, door: Door) -> tuple[float, float, float]:
    """Return (x, y, yaw) of a doorway's middle on the wall's inner face; the yaw's front is toward the room."""
    return {
        "front": (door.offset, 0.0, 0.0),
        "back": (door.offset, room.depth, math.pi),
        "left": (0.0, door.offset, -math.pi / 2.0),
        "right": (room.width, door.offset, math.pi / 2.0),
    }[door.wall]


def front_zone(box: OrientedBox, depth: float) -> OrientedBox:
    """Return the floor in front of a box, as wide as it is, as a box of standing height with the same yaw."""
    fx, fy = box.front
    reach = (box.depth + depth) / 2.0
    return OrientedBox(box.x + reach * fx, box.y + reach * fy, box.width, depth, box.yaw, 0.0, HEADROOM)


def standing_in(
    arrangement: Arrangement,
    zone: OrientedBox,
    ignore: Iterable[str] = (),
    loose: bool = False,
    space: int | None = None,
) -> tuple[str, ...]:
    """Return the floor and wall objects that obstruct a zone.

    Args:
        ignore: placements that do not count.
        loose: whether loose objects count, such as stools and trolleys. People push them away from furniture, but not
            from behind a closed door.
        space: index of the space that the zone is in; objects of others do not count. None counts all.
    """
    skipped = set(ignore)
    rows = [
        row
        for row, placement in enumerate(arrangement.placements)
        if placement.support in (FLOOR, WALL)
        and placement.id not in skipped
        and (loose or arrangement.assets[row].subtype not in LOOSE)
        and (space is None or arrangement.spaces[row] == space)
    ]
    if not rows:
        return ()
    depths = pairwise_penetration(arrangement.take(rows), BoxArray.of([zone]))[:, 0]
    return tuple(arrangement.placements[rows[k]].id for k in np.flatnonzero(depths > INTRUSION))


def in_room(room: Room, zone: OrientedBox) -> bool:
    """Whether a zone lies inside the room."""
    x0, y0, x1, y1 = zone.bounds()
    beyond = max(-x0, -y0, x1 - room.width, y1 - room.depth)
    return beyond <= INTRUSION
