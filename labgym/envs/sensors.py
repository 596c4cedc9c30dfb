"""The robot's sensors, cast as rays against the static scene: a planar lidar and a level depth and color camera."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from labgym.envs.robot import ROBOT, RobotSpec
from labgym.scenes import RayScene

Pose = tuple[float, float, float]
Floats = NDArray[np.float32]

LIDAR_RAYS = 180
IMAGE_SHAPE = (72, 128)
"""Rows and columns of the camera image."""

RANGE = 10.0
"""Largest reading of lidar and camera, meters."""


class Bundle:
    """A set of rays that is fixed in the robot frame.

    The rotation is written out product by product, because a matrix product may round differently on another machine.

    Args:
        directions: (n, 3) unit vectors in the robot frame.
        forward, height: start point of the rays in the robot's plane of symmetry, meters.
    """

    def __init__(self, directions: NDArray[np.float64], forward: float, height: float) -> None:
        self._ahead, self._left = directions[:, 0].copy(), directions[:, 1].copy()
        self._forward, self._height = forward, height
        self.directions: Floats = directions.astype(np.float32)
        self._origins: Floats = np.empty_like(self.directions)

    def cast(self, rays: RayScene, pose: Pose, reach: float) -> tuple[Floats, NDArray[np.int32]]:
        """Return distances (n,) from a pose, `reach` for a ray that hits nothing nearer, and the faces hit (n,).

        Afterwards `directions` holds the directions in the room frame.
        """
        x, y, yaw = pose
        cosine, sine = math.cos(yaw), math.sin(yaw)
        self._origins[:] = (x + self._forward * cosine, y + self._forward * sine, self._height)
        self.directions[:, 0] = cosine * self._ahead - sine * self._left
        self.directions[:, 1] = sine * self._ahead + cosine * self._left
        return rays.cast(self._origins, self.directions, reach)


class Lidar:
    """A planar range finder on the robot's axis.

    Ray i points -pi + 2 pi i / 180 from the heading, counter-clockwise: ray 0 points backwards, ray 45 to the right,
    ray 90 straight ahead, ray 135 to the left.
    """

    def __init__(self, robot: RobotSpec = ROBOT) -> None:
        angles = -math.pi + 2.0 * math.pi / LIDAR_RAYS * np.arange(LIDAR_RAYS)
        directions = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(LIDAR_RAYS)])
        self._bundle = Bundle(directions, 0.0, robot.lidar_height)

    def scan(self, rays: RayScene, pose: Pose) -> Floats:
        """Return ranges from the robot's axis, (180,) meters, clipped to 10."""
        distances, _ = self._bundle.cast(rays, pose, RANGE)
        return np.minimum(distances, np.float32(RANGE))


def pixel_slopes(robot: RobotSpec = ROBOT) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the offset to the left of each column (128,) and upwards of each row (72,), per meter of depth."""
    rows, columns = IMAGE_SHAPE
    focal = columns / 2.0 / math.tan(robot.camera_hfov / 2.0)
    left = (columns / 2.0 - 0.5 - np.arange(columns, dtype=np.float64)) / focal
    up = (rows / 2.0 - 0.5 - np.arange(rows, dtype=np.float64)) / focal
    return left, up


class Camera:
    """A level pinhole camera along the heading, with square pixels; rows run downwards, columns to the right.

    Depth is planar: the distance from the plane of the lens, not the length of the ray.
    """

    def __init__(self, robot: RobotSpec = ROBOT) -> None:
        left, up = pixel_slopes(robot)
        ahead = np.ones(IMAGE_SHAPE)
        grid = np.stack(np.broadcast_arrays(ahead, left[None, :], up[:, None]), axis=-1).reshape(-1, 3)
        lengths = np.linalg.norm(grid, axis=1)
        self._planar = (1.0 / lengths).astype(np.float32)
        self._reach = RANGE * float(lengths.max())
        self._bundle = Bundle(grid / lengths[:, None], robot.camera_forward, robot.camera_height)

    def depth(self, rays: RayScene, pose: Pose) -> Floats:
        """Return planar depth, (72, 128) meters, clipped to 10."""
        return self._see(rays, pose)[0]

    def colour_and_depth(self, rays: RayScene, pose: Pose) -> tuple[NDArray[np.uint8], Floats]:
        """Return the color image, (72, 128, 3), and planar depth, (72, 128) meters, clipped to 10."""
        depth, faces = self._see(rays, pose)
        return rays.color(faces, self._bundle.directions).reshape(*IMAGE_SHAPE, 3), depth

    def _see(self, rays: RayScene, pose: Pose) -> tuple[Floats, NDArray[np.int32]]:
        distances, faces = self._bundle.cast(rays, pose, self._reach)
        return np.minimum(distances * self._planar, np.float32(RANGE)).reshape(IMAGE_SHAPE), faces
