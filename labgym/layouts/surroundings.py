"""Places for accessories along the walls of a floor, doors to keep clear, and the limits of the floor."""

from __future__ import annotations

import numpy as np

from labgym.assets import Asset
from labgym.geometry import OrientedBox, to_world
from labgym.layouts.floor import Floor
from labgym.layouts.ground import Gate, Ground, grounds

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
    return [_raised(ground, gate.area, LINTEL) for ground, gate in _gates(floor)]


def door_openings(floor: Floor) -> list[OrientedBox]:
    """Return doorways with the wall next to them that their frames take."""
    return [
        _raised(ground, OrientedBox(gate.x, gate.y, gate.width + 0.2, 0.6, gate.yaw), LINTEL)
        for ground, gate in _gates(floor)
    ]


def door_of(floor: Floor, space: str) -> tuple[float, float] | None:
    """Return the middle of the first door of a space, exits first; None without doors."""
    ways = sorted((way for way in floor.doorways if space in way.spaces), key=lambda way: not way.exit)
    return ways[0].side(space)[:2] if ways else None


def inside(floor: Floor, box: OrientedBox) -> bool:
    """Whether a footprint lies inside the floor's spaces."""
    return bool(floor.inside(box.corners()).all())


def _gates(floor: Floor) -> list[tuple[Ground, Gate]]:
    return [(ground, gate) for ground in grounds(floor) for gate in ground.gates]


def _raised(ground: Ground, box: OrientedBox, top: float) -> OrientedBox:
    x, y, yaw = ground.to_floor((box.x, box.y, box.yaw))
    return OrientedBox(x, y, box.width, box.depth, yaw, 0.0, top)
