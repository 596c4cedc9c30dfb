"""Places for accessories along the walls of a floor, doors to keep clear, and the limits of the floor."""

from __future__ import annotations

import math

import numpy as np

from labgym.assets import Asset
from labgym.geometry import OrientedBox, to_world
from labgym.layouts.floor import Door, Floor, Room
from labgym.layouts.ground import Gate, Ground, grounds
from labgym.layouts.rules.zones import door_area, door_pose

BRACKET = 0.01
"""Gap between a wall-mounted object and its wall, meters."""
WALL_STEP = 0.05
"""Spacing of the places tried along a wall, meters."""
MARGIN = 0.05
"""Distance kept from the ends of a wall, meters."""
LINTEL = 2.25
"""Height up to which objects keep clear of the doors of a floor, meters."""

Pose = tuple[float, float, float]


def wall_poses(floor: Floor, asset: Asset, top: float, space: str | None = None) -> list[Pose]:
    """Return poses (x, y, yaw) with the back to a wall, every 5 cm along all walls.

    Args:
        floor: the floor.
        asset: the object.
        top: height that the object reaches, meters: it does not cover windows below.
        space: id of the space on whose walls; None for all.
    """
    if floor.is_rectangle:
        room = floor.room
        return [_wall_pose(room, asset, wall, along) for wall, along in _wall_places(room, asset)]
    width, inset = asset.size.width, BRACKET + asset.size.depth / 2.0
    poses: list[Pose] = []
    for ground in (one for one in grounds(floor) if space in (None, one.space)):
        for segment in ground.segments if top <= ground.ceiling else ():
            yaw = ground.to_floor((0.0, 0.0, segment.yaw))[2]
            for low, high in segment.free(top):
                middles = np.arange(low + MARGIN + width / 2.0, high - MARGIN - width / 2.0, WALL_STEP)
                if len(middles):
                    points = segment.points(middles, inset)
                    poses += [(x, y, yaw) for x, y in to_world(points, ground.frame).tolist()]
    return poses


def door_areas(floor: Floor) -> list[OrientedBox]:
    """Return the areas inside doors that stay free, on both sides of those between spaces."""
    if floor.is_rectangle:
        return [door_area(floor.room, door) for door in floor.room.doors]
    return [_raised(ground, gate.area, LINTEL) for ground, gate in _gates(floor)]


def door_openings(floor: Floor) -> list[OrientedBox]:
    """Return doorways with the wall next to them that their frames take."""
    if floor.is_rectangle:
        return [_opening(floor.room, door) for door in floor.room.doors]
    return [
        _raised(ground, OrientedBox(gate.x, gate.y, gate.width + 0.2, 0.6, gate.yaw), LINTEL)
        for ground, gate in _gates(floor)
    ]


def door_of(floor: Floor, space: str) -> tuple[float, float] | None:
    """Return the middle of the first door of a space, exits first; None without doors."""
    ways = sorted((way for way in floor.doorways if space in way.spaces), key=lambda way: not way.exit)
    return ways[0].side(space)[:2] if ways else None


def building(floor: Floor) -> tuple[OrientedBox, ...]:
    """Return the solid parts of a floor; nothing for a single room, whose sides `inside` covers."""
    return () if floor.is_rectangle else floor.solids


def inside(floor: Floor, box: OrientedBox) -> bool:
    """Whether a footprint lies inside the floor's spaces."""
    if floor.is_rectangle:
        x0, y0, x1, y1 = box.bounds()
        return x0 >= 0.0 and y0 >= 0.0 and x1 <= floor.room.width and y1 <= floor.room.depth
    return bool(floor.inside(box.corners()).all())


def _gates(floor: Floor) -> list[tuple[Ground, Gate]]:
    return [(ground, gate) for ground in grounds(floor) for gate in ground.gates]


def _raised(ground: Ground, box: OrientedBox, top: float) -> OrientedBox:
    x, y, yaw = ground.to_floor((box.x, box.y, box.yaw))
    return OrientedBox(x, y, box.width, box.depth, yaw, 0.0, top)


def _wall_places(room: Room, asset: Asset) -> list[tuple[str, float]]:
    places = []
    for wall in ("front", "back", "left", "right"):
        length = room.width if wall in ("front", "back") else room.depth
        margin = asset.size.width / 2.0 + MARGIN
        count = int(max(length - 2.0 * margin, 0.0) / WALL_STEP) + 1
        places += [(wall, margin + WALL_STEP * k) for k in range(count)]
    return places


def _wall_pose(room: Room, asset: Asset, wall: str, along: float) -> tuple[float, float, float]:
    inset = BRACKET + asset.size.depth / 2.0
    return {
        "front": (along, inset, 0.0),
        "back": (along, room.depth - inset, math.pi),
        "left": (inset, along, -math.pi / 2.0),
        "right": (room.width - inset, along, math.pi / 2.0),
    }[wall]


def _opening(room: Room, door: Door) -> OrientedBox:
    """The doorway and the wall next to it that its frame takes."""
    x, y, yaw = door_pose(room, door)
    return OrientedBox(x, y, door.width + 0.2, 0.6, yaw, 0.0, door.height + 0.15)
