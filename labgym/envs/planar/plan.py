"""The plan of a scene in the form that the kernel reads: arrays of numbers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from labgym.envs.planar.body import hulls_of
from labgym.envs.planar.outlines import solids_of
from labgym.envs.robot import ROBOT

Array = NDArray[np.float64]
Index = NDArray[np.int64]

CELL = 0.2
"""Side of a cell of the grid that lists the outlines within reach, meters."""
RESERVE = 0.01
"""Distance by which the lists of cells are larger than the robot, meters."""


class Outlines(NamedTuple):
    """n convex outlines.

    Attributes:
        corners: (m, 2) all corners, outline by outline, counter-clockwise, meters.
        normals: (m, 2) outward unit normal of the side that begins at each corner.
        lengths: (m,) length of that side.
        first: (n + 1,) the first corner of each outline.
        reach: (n,) radius of the part of the robot that it stops, meters; of the lidar's outlines 0.
    """

    corners: Array
    normals: Array
    lengths: Array
    first: Index
    reach: Array


class Cells(NamedTuple):
    """The outlines near each cell of a grid.

    Attributes:
        corner: (2,) least corner of the grid, meters. shape: (2,) number of cells along x and y.
        first: (nx ny + 1,) first place of each cell in `members`; the cell in column i and row j has number j nx + i.
        members: outlines, cell by cell, ascending.
    """

    corner: Array
    shape: Index
    first: Index
    members: Index


class Plan(NamedTuple):
    """A scene in the plane.

    Attributes:
        solids: what the robot touches. near: those of its solids that it may touch from each cell.
        walls: what the lidar sees, at its height.
    """

    solids: Outlines
    near: Cells
    walls: Outlines


def plan_of(model: mujoco.MjModel, lidar_height: float = ROBOT.lidar_height) -> Plan:
    """Return the plan of a compiled scene with the robot.

    A solid stops the widest part of the robot that it overlaps in height.

    Raises:
        OptionError: the scene has solids that move or are neither boxes nor meshes.
    """
    hulls = hulls_of(model)
    shapes, radii, seen = [], [], []
    for solid in solids_of(model):
        for hull in hulls:
            shape = solid.between(hull.bottom, hull.top)
            if len(shape):
                shapes.append(shape)
                radii.append(hull.radius)
                break
        section = solid.at(lidar_height)
        if len(section):
            seen.append(section)
    solids = outlines(shapes, radii)
    return Plan(solids, cells(solids), outlines(seen, [0.0] * len(seen)))


def outlines(shapes: Sequence[Array], reach: Sequence[float]) -> Outlines:
    """Return convex outlines, each (k, 2) counter-clockwise, as arrays."""
    first = np.cumsum([0, *(len(shape) for shape in shapes)], dtype=np.int64)
    corners = np.concatenate([np.empty((0, 2)), *shapes])
    following = np.arange(1, len(corners) + 1)
    following[first[1:] - 1] = first[:-1]
    sides = corners[following] - corners
    lengths = np.hypot(sides[:, 0], sides[:, 1])
    normals = np.column_stack([sides[:, 1], -sides[:, 0]]) / lengths[:, None]
    return Outlines(corners, normals, lengths, first, np.array(reach, dtype=np.float64))


def cells(solids: Outlines) -> Cells:
    """Return for each cell of a grid the outlines that the robot may touch while its center is in the cell."""
    count = len(solids.reach)
    if count == 0:
        return Cells(np.zeros(2), np.ones(2, dtype=np.int64), np.zeros(2, dtype=np.int64), np.empty(0, dtype=np.int64))
    reach = solids.reach[:, None] + RESERVE
    low = np.minimum.reduceat(solids.corners, solids.first[:-1]) - reach
    high = np.maximum.reduceat(solids.corners, solids.first[:-1]) + reach
    corner = low.min(axis=0)
    begin, end = (np.floor((bound - corner) / CELL).astype(np.int64) for bound in (low, high))
    shape = end.max(axis=0) + 1
    size = end - begin + 1
    member = np.repeat(np.arange(count), size.prod(axis=1))
    place = np.arange(len(member)) - np.repeat(np.cumsum(size.prod(axis=1)) - size.prod(axis=1), size.prod(axis=1))
    column, row = begin[member, 0] + place % size[member, 0], begin[member, 1] + place // size[member, 0]
    middle = corner + CELL * (np.column_stack([column, row]) + 0.5)
    within = _distances(middle, solids, member) <= reach[member, 0] + CELL * np.sqrt(0.5)
    number, member = (row * shape[0] + column)[within], member[within]
    order = np.argsort(number, kind="stable")
    first = np.searchsorted(number[order], np.arange(int(shape.prod()) + 1)).astype(np.int64)
    return Cells(corner, shape, first, member[order].astype(np.int64))


def _distances(points: Array, solids: Outlines, outline: NDArray[np.intp]) -> Array:
    """Return a lower bound of the distance of point k of (n, 2) from outline[k], (n,) meters: that along a normal."""
    first, last = solids.first[outline], solids.first[outline + 1] - 1
    least = np.full(len(points), -np.inf)
    for side in range(int((last - first).max(initial=-1)) + 1):
        corner = np.minimum(first + side, last)
        away = ((points - solids.corners[corner]) * solids.normals[corner]).sum(axis=1)
        least = np.maximum(least, away)
    return least
