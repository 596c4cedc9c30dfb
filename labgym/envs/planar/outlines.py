"""Convex outlines of the solids of a compiled scene: those in the robot's way and those in the lidar's plane."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import mujoco
import numpy as np
from numpy.typing import NDArray

from labgym.envs.robot import PREFIX
from labgym.errors import OptionError

Array = NDArray[np.float64]

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
    """

    points: Array
    bottom: float
    top: float
    upright: bool

    def between(self, bottom: float, top: float) -> Array:
        """Return the outline (k, 2) of the part between two heights, counter-clockwise; empty without such a part."""
        if self.bottom >= top or self.top <= bottom:
            return np.empty((0, 2))
        if self.upright:
            return self.points[:4, :2]
        z = self.points[:, 2]
        inside = self.points[(z > bottom) & (z < top), :2]
        return _hull(np.concatenate([inside, self._crossings(bottom), self._crossings(top)]))

    def at(self, height: float) -> Array:
        """Return the outline (k, 2) of the section at a height, counter-clockwise; empty without one.

        A solid that stands on the plane is seen and one whose top lies in the plane is not, as mostly by Embree.
        """
        if not self.bottom - LEVEL <= height < self.top - LEVEL:
            return np.empty((0, 2))
        return (
            self.points[:4, :2]
            if self.upright
            else _hull(self._crossings(min(max(height, self.bottom), self.top - LEVEL)))
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
        solids.append(Solid(points, float(z.min()), float(z.max()), upright))
    return solids


def _hull(points: Array) -> Array:
    """Return the convex hull (k, 2) of points (n, 2), counter-clockwise; empty if it has no area."""
    if len(points) < 3:
        return np.empty((0, 2))
    hull = points[cv2.convexHull((points - points[0]).astype(np.float32), returnPoints=False)[:, 0]]
    x, y = hull.T
    area = 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))
    if abs(area) < 1e-9:
        return np.empty((0, 2))
    return np.asarray(hull if area > 0.0 else hull[::-1])
