"""The robot's sensors, cast as rays against the static scene: a planar lidar and a level depth and color camera."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labgym.envs.robot import ROBOT
from labgym.scenes.rays import RaySource

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
        forward, height, left: start point of the rays in the robot frame, meters.
    """

    def __init__(self, directions: NDArray[np.float64], forward: float, height: float, left: float = 0.0) -> None:
        self._ahead, self._left = directions[:, 0].copy(), directions[:, 1].copy()
        self._forward, self._sideways = forward, left
        self.directions: Floats = directions.astype(np.float32)
        self._origins: Floats = np.full_like(self.directions, height)

    def cast(self, rays: RaySource, pose: Pose, reach: float) -> tuple[Floats, NDArray[np.int32]]:
        """Return distances (n,) from a pose, `reach` for a ray that hits nothing nearer, and the faces hit (n,).

        Afterwards `directions` holds the directions in the room frame.
        """
        x, y, yaw = pose
        cosine, sine = math.cos(yaw), math.sin(yaw)
        self._origins[:, 0] = x + self._forward * cosine - self._sideways * sine
        self._origins[:, 1] = y + self._forward * sine + self._sideways * cosine
        self.directions[:, 0] = cosine * self._ahead - sine * self._left
        self.directions[:, 1] = sine * self._ahead + cosine * self._left
        return rays.cast(self._origins, self.directions, reach)


class Lidar:
    """A planar range finder, by default on the robot's axis.

    Ray i points -pi + 2 pi i / rays from the heading, counter-clockwise. Of 180, ray 0 points backwards, ray 45 to the
    right, ray 90 straight ahead, ray 135 to the left.

    Args:
        rays: number of rays. reach: largest reading, meters. height: of their plane above the floor, meters.
        forward, left: place in the robot frame, meters. yaw: turn in it, radians.

    Attributes:
        count, reach, height: as the arguments.
    """

    def __init__(
        self,
        rays: int = LIDAR_RAYS,
        reach: float = RANGE,
        height: float = ROBOT.lidar_height,
        forward: float = 0.0,
        left: float = 0.0,
        yaw: float = 0.0,
    ) -> None:
        angles = -math.pi + 2.0 * math.pi / rays * np.arange(rays)
        directions = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(rays)])
        self.count, self.reach, self.height = rays, reach, height
        self._bundle, self._limit = Bundle(directions, 0.0, height), np.float32(reach)
        self._place = (forward, left, yaw)
        self._centered = self._place == (0.0, 0.0, 0.0)

    def at(self, pose: Pose) -> Pose:
        """Return the pose of the range finder on a robot at a pose."""
        if self._centered:
            return pose
        (x, y, yaw), (forward, left, turn) = pose, self._place
        cosine, sine = math.cos(yaw), math.sin(yaw)
        return x + forward * cosine - left * sine, y + forward * sine + left * cosine, yaw + turn

    def scan(self, rays: RaySource, pose: Pose) -> Floats:
        """Return ranges, (rays,) meters, clipped to the reach, on a robot at a pose."""
        distances, _ = self._bundle.cast(rays, self.at(pose), self.reach)
        return np.minimum(distances, self._limit, out=distances)


def rotation(yaw: float, pitch: float, roll: float) -> NDArray[np.float64]:
    """Return the matrix (3, 3) of a roll about x, then a pitch about y, then a yaw about z, radians."""
    cosines, sines = np.cos((roll, pitch, yaw)), np.sin((roll, pitch, yaw))
    about_x = np.array([[1.0, 0.0, 0.0], [0.0, cosines[0], -sines[0]], [0.0, sines[0], cosines[0]]])
    about_y = np.array([[cosines[1], 0.0, sines[1]], [0.0, 1.0, 0.0], [-sines[1], 0.0, cosines[1]]])
    about_z = np.array([[cosines[2], -sines[2], 0.0], [sines[2], cosines[2], 0.0], [0.0, 0.0, 1.0]])
    return np.asarray(about_z @ about_y @ about_x)


def pixel_slopes(
    shape: tuple[int, int] = IMAGE_SHAPE, hfov: float = ROBOT.camera_hfov
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the offset to the left of each column (columns,) and upwards of each row (rows,), per meter of depth."""
    rows, columns = shape
    focal = columns / 2.0 / math.tan(hfov / 2.0)
    left = (columns / 2.0 - 0.5 - np.arange(columns, dtype=np.float64)) / focal
    up = (rows / 2.0 - 0.5 - np.arange(rows, dtype=np.float64)) / focal
    return left, up


@dataclass(frozen=True, eq=False)
class CameraView:
    """The view of a camera from one pose.

    Attributes:
        depth: planar depth, (rows, columns) meters, clipped to the reach.
        faces: faces of the scene's mesh that the pixels show, (rows * columns,); -1 for nothing within reach.
        directions: unit vectors of the rays in the room frame, (rows * columns, 3), until the camera's next view.
    """

    depth: Floats
    faces: NDArray[np.int32]
    directions: Floats


class Camera:
    """A pinhole camera, level and along the heading by default, with square pixels; rows run downwards, columns right.

    Depth is planar: the distance from the plane of the lens, not the length of the ray.

    Args:
        shape: rows and columns of the image. hfov: horizontal field of view, radians. reach: largest depth, meters.
        forward, height, left: place ahead of the robot's axis, above the floor and to the left, meters.
        yaw, pitch, roll: turns to the left, nose down and right side down, radians.

    Attributes:
        shape, reach, forward, height: as the arguments. focal: focal length, pixels.
        level: whether the camera is on the robot's axis and looks straight ahead.
    """

    def __init__(
        self,
        shape: tuple[int, int] = IMAGE_SHAPE,
        hfov: float = ROBOT.camera_hfov,
        reach: float = RANGE,
        *,
        forward: float = ROBOT.camera_forward,
        height: float = ROBOT.camera_height,
        left: float = 0.0,
        yaw: float = 0.0,
        pitch: float = 0.0,
        roll: float = 0.0,
    ) -> None:
        aside, up = pixel_slopes(shape, hfov)
        grid = np.stack(np.broadcast_arrays(np.ones(shape), aside[None, :], up[:, None]), axis=-1).reshape(-1, 3)
        lengths = np.linalg.norm(grid, axis=1)
        self.shape, self.reach, self._limit = shape, float(reach), np.float32(reach)
        self.forward, self.height = float(forward), float(height)
        self.focal = shape[1] / 2.0 / math.tan(hfov / 2.0)
        self.level = (left, yaw, pitch, roll) == (0.0, 0.0, 0.0, 0.0)
        self._planar = (1.0 / lengths).astype(np.float32)
        self._reach = reach * float(lengths.max())
        directions = grid / lengths[:, None]
        if (yaw, pitch, roll) != (0.0, 0.0, 0.0):
            directions = directions @ rotation(yaw, pitch, roll).T
        self._bundle = Bundle(directions, forward, height, left)

    def depth(self, rays: RaySource, pose: Pose) -> Floats:
        """Return planar depth, (rows, columns) meters, clipped to the reach."""
        return self.view(rays, pose).depth

    def colour_and_depth(self, rays: RaySource, pose: Pose) -> tuple[NDArray[np.uint8], Floats]:
        """Return the color image, (rows, columns, 3), and planar depth, (rows, columns) meters."""
        view = self.view(rays, pose)
        return rays.color(view.faces, view.directions).reshape(*self.shape, 3), view.depth

    def view(self, rays: RaySource, pose: Pose) -> CameraView:
        """Return depth and faces seen from a pose (x, y, yaw) of the robot."""
        distances, faces = self._bundle.cast(rays, pose, self._reach)
        depth = np.minimum(distances * self._planar, self._limit).reshape(self.shape)
        return CameraView(depth, faces, self._bundle.directions)
