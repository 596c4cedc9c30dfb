"""Which walls a picture leaves out: those between the camera and the spaces that it shows."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from labgym.geometry import OrientedBox, to_local, to_world
from labgym.layouts import Layout, Placement
from labgym.layouts.floor import Floor, Wall
from labgym.layouts.placement import WALL
from labgym.navigation.clearance import Obstacles
from labgym.scenes.floor_covering import spaces_at
from labgym.scenes.wall_faces import column_name, upper, wall_name

BEHIND = 0.03
"""Distance from the face of a wall at which a space behind it is looked up, meters."""
SPACING = 0.5
"""Distance between the places along a wall where a space behind it is looked up, meters."""
FREE = 0.05
"""Least distance between a wall and what does not hang on it, meters."""
CACHED = 32
"""Number of floors whose sides of walls are cached."""

Array = NDArray[np.float64]
Point = tuple[float, float, float]


def hidden_walls(floor: Floor, position: Point) -> tuple[str, ...]:
    """Return the parts that hide a space from a camera outside of the floor; none inside.

    They are the upper parts of all columns and of the walls with a space on their far side.
    """
    x, y, _ = position
    x0, y0, x1, y1 = floor.bounds
    if x0 <= x <= x1 and y0 <= y <= y1:
        return ()
    return (*near_walls(floor, x, y), *uppers(floor)[len(floor.walls) :])


def near_walls(floor: Floor, x: float, y: float) -> tuple[str, ...]:
    """Return the upper parts of the walls that have a space on the side that is turned away from a point."""
    beside = _spaces_beside(floor)
    side = [float(to_local([(x, y)], (*wall.start, wall.yaw))[0, 1]) for wall in floor.walls]
    behind = np.where(np.array(side) > 0.0, beside[:, 1], beside[:, 0])
    return tuple(upper(wall_name(int(k))) for k in np.flatnonzero(behind))


def uppers(floor: Floor) -> tuple[str, ...]:
    """Return the upper parts of all walls and columns."""
    names = (*map(wall_name, range(len(floor.walls))), *map(column_name, range(len(floor.columns))))
    return tuple(upper(name) for name in names)


def across(floor: Floor, position: Point, ends: Array) -> tuple[str, ...]:
    """Return the upper parts of the walls and columns that lines of sight from a camera cross in the plane.

    Args:
        ends: (n, 2) of the lines, meters.
    """
    columns = [OrientedBox(each.x, each.y, each.width, each.depth, each.yaw) for each in floor.columns]
    boxes = Obstacles([*(wall.box for wall in floor.walls), *columns])
    distances = boxes.segment_distances(np.tile(position[:2], (len(ends), 1)), ends)
    crossed = (distances == 0.0).any(axis=0)
    return tuple(name for name, crosses in zip(uppers(floor), crossed, strict=True) if crosses)


def hanging_on(layout: Layout, placement: Placement) -> str | None:
    """Return the upper part of the wall that a wall-mounted placement hangs on.

    None for other placements, and for glass screens, which stand free.
    """
    if placement.support != WALL:
        return None
    x, y, _ = placement.position
    distances = Obstacles(wall.box for wall in layout.floor.walls).point_distances(np.array([[x, y]]))[0]
    if distances.min() > layout.box(placement.id).depth / 2.0 + FREE:
        return None
    return upper(wall_name(int(distances.argmin())))


@lru_cache(maxsize=CACHED)
def _spaces_beside(floor: Floor) -> NDArray[np.bool_]:
    """Return whether a space lies on the left and on the right of each wall, seen from its start, shape (n, 2)."""
    return np.array([[_space_beside(floor, wall, sign) for sign in (1.0, -1.0)] for wall in floor.walls])


def _space_beside(floor: Floor, wall: Wall, sign: float) -> bool:
    along = np.linspace(0.0, wall.length, max(3, int(wall.length / SPACING) + 2))[1:-1]
    across = np.full(len(along), sign * (wall.thickness / 2.0 + BEHIND))
    points = to_world(np.column_stack([along, across]), (*wall.start, wall.yaw))
    return bool((spaces_at(floor, points) >= 0).any())
