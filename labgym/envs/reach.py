"""Where the robot cannot touch anything within the next contact check: there, a model of the robot alone suffices."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import cv2
import mujoco
import numpy as np
from numpy.typing import NDArray

from labgym.envs.robot import BOTTOM, ROBOT, RobotSpec, attach_robot

BOX_FIELDS = ("pos", "quat", "size", "rbound", "aabb", "sameframe")
"""Fields of a geom in which the boxes of a scene differ."""
CONTACT_FIELDS = (
    "contype", "conaffinity", "condim", "priority", "friction", "solmix", "solref", "solimp", "margin", "gap", "fluid",
)  # fmt: skip
"""Fields of a geom that decide how it touches others: those of a new geom in every box."""


@dataclass(frozen=True, eq=False)
class SolidBoxes:
    """The n solid boxes of a scene that a robot may touch, in the order of their geoms.

    Attributes:
        fields: `BOX_FIELDS` of each, (n, ...). low, high: (n, 3) corners of their bounds, meters.
        normals: (m, 2) outward normals of the sides of their outlines, box by box. offsets: (m,), meters.
        first: (n,), the first side of each box.
    """

    fields: tuple[NDArray[np.float64], ...]
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    normals: NDArray[np.float64]
    offsets: NDArray[np.float64]
    first: NDArray[np.intp]

    @classmethod
    def of(
        cls,
        model: mujoco.MjModel,
        geoms: NDArray[np.intp],
        corners: NDArray[np.float64],
        outlines: list[NDArray[np.float64]],
    ) -> SolidBoxes | None:
        """Return solid geoms of a scene; None if they are not boxes of the world that touch as new geoms do.

        Args:
            geoms: (n,) ascending. corners: (n, 8, 3) of the boxes, meters. outlines: convex, each (k, 2), meters.
        """
        single = _new_box()
        boxes = (model.geom_type[geoms] == mujoco.mjtGeom.mjGEOM_BOX) & (model.geom_bodyid[geoms] == 0)
        alike = all(
            (getattr(model, f"geom_{name}")[geoms] == getattr(single, f"geom_{name}")[0]).all()
            for name in CONTACT_FIELDS
        )
        if not boxes.all() or not alike:
            return None
        fields = tuple(np.array(getattr(model, f"geom_{name}")[geoms]) for name in BOX_FIELDS)
        normals, offsets = _sides(outlines)
        first = np.cumsum([0, *(len(outline) for outline in outlines)])[:-1].astype(np.intp)
        return cls(fields, corners.min(axis=1), corners.max(axis=1), normals, offsets, first)

    def around(self, x: float, y: float, distance: float) -> NDArray[np.intp]:
        """Return the boxes of which a part may lie within a distance of a point; none that does is left out."""
        if not len(self.first):
            return self.first
        beyond = self.normals[:, 0] * x + self.normals[:, 1] * y - self.offsets
        return np.flatnonzero(np.maximum.reduceat(beyond, self.first) <= distance)


def _sides(outlines: list[NDArray[np.float64]]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return outward normals (m, 2) and offsets (m,) of the sides of convex outlines; zeros for a side of no length."""
    if not outlines:
        return np.empty((0, 2)), np.empty(0)
    points = np.concatenate(outlines)
    along = np.concatenate([np.roll(outline, -1, axis=0) - outline for outline in outlines])
    lengths = np.linalg.norm(along, axis=1)
    middles = np.concatenate([np.repeat(outline.mean(axis=0)[None], len(outline), axis=0) for outline in outlines])
    normals = np.column_stack([along[:, 1], -along[:, 0]]) / np.maximum(lengths, 1e-12)[:, None]
    outward = np.where(((points - middles) * normals).sum(axis=1) < 0.0, -1.0, 1.0)
    normals *= outward[:, None]
    return normals, (normals * points).sum(axis=1)


def _new_box() -> mujoco.MjModel:
    spec = mujoco.MjSpec()
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=[1.0, 1.0, 1.0])
    return spec.compile()


CELL = 0.05
"""Spacing of the grid, meters."""
FASTEST = 1.5
"""Speed up to which the robot is judged, m/s; a push out of a contact may be faster."""
TRAVEL = 0.06
"""Distance that the robot is granted between two contact checks, meters: 25 ms at `FASTEST` and a reserve."""
RESERVE = 1e-3
"""Reserve below the underside of the chassis, meters."""
SUBPIXELS = 4
"""Binary digits after the point of corners that are drawn on the grid."""


class OutOfReach:
    """The places of a scene at which no solid is within reach of the robot.

    Solids are the oriented bounding boxes of the static colliding geoms between the bottom and the top of the robot,
    drawn on a grid; the errors of the grid make them larger, never smaller.

    Args:
        model: a compiled scene with the robot; geoms that are not fixed to the world are left out.
        robot: its dimensions.

    Attributes:
        solids: the solids that the robot may touch; None if they are not all boxes.
    """

    def __init__(self, model: mujoco.MjModel, robot: RobotSpec = ROBOT) -> None:
        geoms, corners = _solids(model, robot.height)
        outlines = [
            cv2.convexHull(points)[:, 0, :].astype(np.float64) for points in corners[:, :, :2].astype(np.float32)
        ]
        self.solids = SolidBoxes.of(model, geoms, corners, outlines)
        points = np.concatenate(outlines) if outlines else np.zeros((1, 2))
        low = points.min(axis=0) - CELL
        self._x0, self._y0 = float(low[0]), float(low[1])
        self._nx, self._ny = (int(cells) + 2 for cells in np.ceil((points.max(axis=0) - low) / CELL))
        image = np.ones((self._ny, self._nx), dtype=np.uint8)
        for outline in outlines:
            corners = ((outline - low) / CELL * 2**SUBPIXELS).round().astype(np.int32)
            cv2.fillConvexPoly(image, corners, (0,), shift=SUBPIXELS)
        away = cv2.distanceTransform(image, cv2.DIST_L2, cv2.DIST_MASK_PRECISE) * CELL
        # A point is up to 0.7 cells from its grid point, and a side up to 0.7 cells from the nearest one drawn.
        self._far: bytes = (away > robot.chassis_radius + TRAVEL + 1.5 * CELL).tobytes()

    def at(self, x: float, y: float) -> bool:
        """Whether nothing is within reach at a point; False outside the scene."""
        column, row = round((x - self._x0) / CELL), round((y - self._y0) / CELL)
        inside = 0 <= column < self._nx and 0 <= row < self._ny
        return inside and self._far[row * self._nx + column] == 1


@lru_cache(maxsize=16)
def robot_alone(robot: RobotSpec = ROBOT) -> mujoco.MjModel:
    """Return the robot without a scene; its motion equals, bit for bit, that in a scene in which it touches nothing."""
    scene = mujoco.MjSpec()
    attach_robot(scene, robot)
    scene.compiler.discardvisual = True
    return scene.compile()


def _solids(model: mujoco.MjModel, height: float) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """Return the colliding geoms up to a robot's height, (n,), and the corners of their boxes, (n, 8, 3) meters."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    fixed = model.body_weldid[model.geom_bodyid] == 0
    colliding = (model.geom_contype | model.geom_conaffinity) != 0
    solid = colliding & fixed & (model.geom_type != mujoco.mjtGeom.mjGEOM_PLANE)
    geoms = np.flatnonzero(solid)
    signs = np.array(np.meshgrid((-1, 1), (-1, 1), (-1, 1))).reshape(3, 8).T
    local = model.geom_aabb[geoms, None, :3] + signs * model.geom_aabb[geoms, None, 3:]
    rotations = data.geom_xmat[geoms].reshape(-1, 3, 3)
    corners = data.geom_xpos[geoms, None, :] + local @ rotations.transpose(0, 2, 1)
    margin, heights = model.geom_margin[geoms], corners[:, :, 2]
    at_height = (heights.max(axis=1) + margin > BOTTOM - RESERVE) & (heights.min(axis=1) - margin < height)
    return geoms[at_height], corners[at_height]
