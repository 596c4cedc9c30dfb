"""Where the robot cannot touch anything within the next contact check: there, a model of the robot alone suffices."""

from __future__ import annotations

from functools import lru_cache

import cv2
import mujoco
import numpy as np
from numpy.typing import NDArray

from labgym.envs.robot import BOTTOM, ROBOT, RobotSpec, attach_robot
from labgym.envs.solids import Solids

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
        self.solids = Solids.of(model, geoms, corners, outlines)
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
