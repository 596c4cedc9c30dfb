"""Joints of walls: how far each wall runs on past its ends so that no gap is left at a corner."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from labgym.geometry import BoxArray, OrientedBox, pairwise_distance
from labgym.layouts.floor.walls import Wall

JOINT = 0.01
"""The end of a wall that is nearer than this to another wall is joined with it, meters."""
LAP = 1e-3
"""Least length by which joined walls overlap, meters."""
PARALLEL = 1e-3
"""Sine of the angle between two walls below which they are taken as parallel."""
CHUNK = 64
"""Ends that are compared with all walls at a time."""


def extensions(walls: Sequence[Wall]) -> tuple[tuple[float, float], ...]:
    """Return by how much each wall runs on past its start and past its end, meters.

    A wall is extended at a joint up to the far face of the other wall, so that the corner is filled, and no further:
    it never passes through the other wall into what lies behind.
    """
    ends = [(index, at_end) for index in range(len(walls)) for at_end in (False, True)]
    lengths: list[float] = []
    for start in range(0, len(ends), CHUNK):
        lengths += _lengths(walls, ends[start : start + CHUNK])
    return tuple(zip(lengths[::2], lengths[1::2], strict=True))


def _lengths(walls: Sequence[Wall], ends: Sequence[tuple[int, bool]]) -> list[float]:
    """Return by how much some ends (index of the wall, whether it is its end) run on, meters."""
    others = BoxArray.of([wall.box for wall in walls])
    near = pairwise_distance(BoxArray.of([_cap(walls[index], at_end) for index, at_end in ends]), others) <= JOINT
    near[np.arange(len(ends)), [index for index, _ in ends]] = False
    return [
        _length(walls[index], at_end, others, joined) if joined.any() else 0.0
        for (index, at_end), joined in zip(ends, near, strict=True)
    ]


def _cap(wall: Wall, at_end: bool) -> OrientedBox:
    """Return an end of a wall as a box without length."""
    x, y = wall.end if at_end else wall.start
    return OrientedBox(x, y, 0.0, wall.thickness, wall.yaw, 0.0, wall.height)


def _length(wall: Wall, at_end: bool, others: BoxArray, joined: NDArray[np.bool_]) -> float:
    """Return by how much an end can run on without passing through the far face of any of the joined walls."""
    (x, y), direction = (wall.end, wall.yaw) if at_end else (wall.start, wall.yaw + math.pi)
    ux, uy = math.cos(direction), math.sin(direction)
    centre, half, yaw = others.centre[joined], others.half[joined], others.yaw[joined]
    nx, ny = -np.sin(yaw), np.cos(yaw)
    slope = ux * nx + uy * ny
    sign = np.where(slope < 0.0, -1.0, 1.0)  # the normals point to the far side
    slope, middle = sign * slope, sign * ((x - centre[:, 0]) * nx + (y - centre[:, 1]) * ny)
    own = wall.thickness / 2.0 * np.abs(ux * ny - uy * nx)
    reach = (half[:, 1] - middle - own) / np.maximum(slope, PARALLEL)
    reach = np.where(slope < PARALLEL, LAP, np.clip(reach, 0.0, wall.thickness + 2.0 * half[:, 1]))
    return float(reach.max())
