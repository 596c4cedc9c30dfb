"""The solids of a compiled scene as convex outlines, and the grid in which the kernel finds those near the robot."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import cv2
import mujoco
import numpy as np
from numpy.typing import NDArray

from labgym.envs.planar.body import hulls_of
from labgym.envs.robot import PREFIX, ROBOT
from labgym.errors import OptionError

LEVEL = 1e-6
"""Rounding of heights in scenes, meters."""
CORNERS = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])


@dataclass(frozen=True, eq=False)
class Solid:
    """A convex solid that is fixed to the world.

    Attributes:
        points: (n, 3) its vertices, meters.
        bottom, top: its least and greatest z, meters.
        upright: whether it is a box with vertical sides; its first four points are then its outline.
        name: of what it belongs to: a placement, a wall or a column.
    """

    points: Array
    bottom: float
    top: float
    upright: bool
    name: str = ""

    def between(self, bottom: float, top: float) -> Array:
        """Return the outline (k, 2) of the part between two heights, counter-clockwise; empty without such a part."""
        if self.bottom >= top or self.top <= bottom:
            return np.empty((0, 2))
        if self.upright:
            return self.points[:4, :2]
        z = self.points[:, 2]
        inside = self.points[(z > bottom) & (z < top), :2]
        return hull(np.concatenate([inside, self._crossings(bottom), self._crossings(top)]))

    def at(self, height: float) -> Array:
        """Return the outline (k, 2) of the section at a height, counter-clockwise; empty without one.

        A solid that stands on the plane is seen and one whose top lies in the plane is not, as mostly by Embree.
        """
        if not self.bottom - LEVEL <= height < self.top - LEVEL:
            return np.empty((0, 2))
        return (
            self.points[:4, :2]
            if self.upright
            else hull(self._crossings(min(max(height, self.bottom), self.top - LEVEL)))
        )

    def _crossings(self, height: float) -> Array:
        """Return the points at a height of all segments between two vertices; their hull is the section."""
        z = self.points[:, 2]
        low, high = np.flatnonzero(z <= height), np.flatnonzero(z > height)
        share = (height - z[low])[:, None] / (z[high] - z[low, None])
        a, b = self.points[low, None, :2], self.points[None, high, :2]
        return np.asarray((a + share[:, :, None] * (b - a)).reshape(-1, 2))


def solids_of(model: mujoco.MjModel) -> list[Solid]:
    """Return the colliding solids of a scene but the robot; planes, which are floors, are left out.

    Raises:
        OptionError: a solid is neither a box nor a mesh, or moves.
    """
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    collides = (model.geom_contype != 0) | (model.geom_conaffinity != 0)
    robots = np.array([model.body(k).name.startswith(PREFIX) for k in range(model.nbody)])
    others = collides & ~robots[model.geom_bodyid] & (model.geom_type != mujoco.mjtGeom.mjGEOM_PLANE)
    rotations = data.geom_xmat.reshape(-1, 3, 3)
    box = model.geom_type == mujoco.mjtGeom.mjGEOM_BOX
    signs = np.concatenate([np.column_stack([CORNERS, np.full(4, z)]) for z in (-1.0, 1.0)])
    corners = np.einsum("nij,nkj->nki", rotations, signs * model.geom_size[:, None, :]) + data.geom_xpos[:, None, :]
    solids = []
    for geom in np.flatnonzero(others).tolist():
        if model.body_weldid[model.geom_bodyid[geom]] != 0:
            raise OptionError(f"solid {model.geom(geom).name!r} moves; planar solids are fixed: use physics='mujoco'")
        if box[geom]:
            points, upright = corners[geom], bool(rotations[geom, 2, 2] > 1.0 - 1e-9)
        elif model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_MESH:
            mesh = model.geom_dataid[geom]
            first = model.mesh_vertadr[mesh]
            local = model.mesh_vert[first : first + model.mesh_vertnum[mesh]].astype(np.float64)
            points, upright = data.geom_xpos[geom] + local @ rotations[geom].T, False
        else:
            name = model.geom(geom).name
            raise OptionError(f"solid {name!r} is neither a box nor a mesh, as planar solids are: use physics='mujoco'")
        z = points[:, 2]
        owner = model.geom(geom).name.partition("/")[0]
        solids.append(Solid(points, float(z.min()), float(z.max()), upright, owner))
    return solids


def hull(points: Array) -> Array:
    """Return the convex hull (k, 2) of points (n, 2), counter-clockwise; empty if it has no area."""
    if len(points) < 3:
        return np.empty((0, 2))
    corners = points[cv2.convexHull((points - points[0]).astype(np.float32), returnPoints=False)[:, 0]]
    x, y = corners.T
    area = 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))
    if abs(area) < 1e-9:
        return np.empty((0, 2))
    return np.asarray(corners if area > 0.0 else corners[::-1])


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


class PlanarPlan(NamedTuple):
    """A scene in the plane.

    Attributes:
        solids: what the robot touches. near: those of its solids that it may touch from each cell.
        walls: what the lidar sees, at its height.
    """

    solids: Outlines
    near: Cells
    walls: Outlines


def plan_of(model: mujoco.MjModel, lidar_height: float = ROBOT.lidar_height) -> PlanarPlan:
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
    return PlanarPlan(solids, cells(solids), outlines(seen, [0.0] * len(seen)))


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
