"""Floor areas that should stay free: inside doors and in front of furniture."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from labgym.geometry import BoxArray, OrientedBox, interpenetrating, pairwise_penetration
from labgym.layouts.floor import Door, Room

if TYPE_CHECKING:
    from labgym.layouts.rules.arrangement import Arrangement

DOOR_AREA = 1.2
"""Side of the square kept clear inside a door, meters: the swing of the leaf and a person next to it."""

INTRUSION = 0.05
"""An object that reaches less far into a zone does not obstruct it, meters: wall boards, skirting, pipes."""

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
    arrangement: Arrangement, zone: OrientedBox, loose: bool = False, space: int | None = None
) -> tuple[str, ...]:
    """Return the floor and wall objects that obstruct a zone.

    Args:
        loose: whether loose objects count, such as stools and trolleys, and open drawers and doors. People push them
            away from furniture, but not from behind a closed door.
        space: index of the space that the zone is in; objects of others do not count. None counts all.
    """
    return standing_in_each(arrangement, [zone], [space], loose)[0]


def standing_in_each(
    arrangement: Arrangement, zones: Sequence[OrientedBox], spaces: Sequence[int | None], loose: bool = False
) -> list[tuple[str, ...]]:
    """Return `standing_in` for several zones and their spaces."""
    rows = arrangement.standing if loose else arrangement.standing_fast
    if not rows or not zones:
        return [() for _ in zones]
    boxes = BoxArray.of(zones)
    hits = pairwise_penetration(boxes, arrangement.take(rows)) > INTRUSION
    if loose and arrangement.open_parts:
        column = {row: k for k, row in enumerate(rows)}
        parts = [(column[row], part) for row, part in arrangement.open_parts if row in column]
        opened = pairwise_penetration(boxes, BoxArray.of([part for _, part in parts])) > INTRUSION
        for (k, _), hit in zip(parts, opened.T, strict=True):
            hits[:, k] |= hit
    return [
        tuple(
            arrangement.placements[rows[k]].id
            for k in np.flatnonzero(hit).tolist()
            if space is None or arrangement.spaces[rows[k]] == space
        )
        for space, hit in zip(spaces, hits, strict=True)
    ]


def standing_in_front(arrangement: Arrangement, fronts: Sequence[tuple[int, OrientedBox]]) -> list[tuple[str, ...]]:
    """Return, for each pair of a row and the zone in front of that object, what obstructs the zone.

    As `standing_in` for one zone after the other, without the object itself and without other spaces and loose objects.
    """
    rows, spaces = arrangement.standing_fast, arrangement.spaces
    zones = BoxArray.of([zone for _, zone in fronts])
    obstructing: list[list[str]] = [[] for _ in fronts]
    for front, k, _ in zip(*interpenetrating(zones, arrangement.take(rows), INTRUSION), strict=True):
        row, other = fronts[front][0], rows[k]
        if other != row and spaces[other] == spaces[row]:
            obstructing[front].append(arrangement.placements[other].id)
    return [tuple(ids) for ids in obstructing]
