"""The network's input as one vector: goal, velocity, past positions, and the sensor."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from labgym.envs.sensors import IMAGE_SHAPE, LIDAR_RAYS, RANGE
from labgym.geometry import to_local
from labgym.navigation import Pose
from labgym.policies.depth_map import DepthMap
from labgym.policies.policy import Observation

Floats = NDArray[np.float32]

MEMORY_REACH_M = 20.0
"""Distance from the start of a drive within which obstacles are remembered, meters."""

MOST_DIRECTIONS = 6
"""Largest number of directions that an obstacle covers on either side of its center."""

DIRECTION_STEP_RAD = 2.0 * math.pi / LIDAR_RAYS


class RememberedObstacles:
    """Remembers the cells in which the camera saw an obstacle.

    The camera sees 68 degrees, but the robot has to know what stands next to it while it passes.
    """

    def __init__(self) -> None:
        self._map = DepthMap(MEMORY_REACH_M)
        self._cells = np.empty((0, 2))

    def ranges(self, picture: NDArray[np.floating], pose: Pose) -> Floats:
        """Add a depth image and return the distance to the nearest remembered obstacle in each direction.

        Args:
            picture: planar depth (72, 128), meters.
            pose: (x, y, yaw) in the frame of the drive's start.

        Returns:
            (180,) meters from the robot's axis, 10 if nothing nearer was seen; in the directions of the lidar.
        """
        self._cells = np.concatenate([self._cells, self._map.add(picture, pose)])
        x, y = (self._cells - pose[:2]).T
        distances = np.hypot(x, y)
        near = distances < RANGE
        distances = distances[near]
        directions = np.rint((np.arctan2(y[near], x[near]) - pose[2] + math.pi) / DIRECTION_STEP_RAD).astype(np.intp)
        ranges = np.full(LIDAR_RAYS, RANGE)
        np.minimum.at(ranges, directions % LIDAR_RAYS, distances)
        covered = np.minimum(
            self._map.resolution / 2.0 / np.maximum(distances, 1e-6) / DIRECTION_STEP_RAD, MOST_DIRECTIONS
        ).astype(np.intp)
        for aside in range(1, int(covered.max(initial=0)) + 1):
            wide = covered >= aside
            for offset in (-aside, aside):
                np.minimum.at(ranges, (directions[wide] + offset) % LIDAR_RAYS, distances[wide])
        return ranges.astype(np.float32)


Sensor = Literal["lidar", "depth"]

Vector = NDArray[np.float32]

TRAIL_STEPS = (5, 10, 20, 40, 80, 160)
"""Ages of the past positions, control steps."""

GOAL, VELOCITY = 3, 2

STATE = GOAL + VELOCITY + 2 * len(TRAIL_STEPS)
"""Length of the vector's first part, which is the same for every sensor."""

SPEED = GOAL
"""Index of the forward velocity, m/s."""

POOL_PIXELS = 4
"""A depth image is reduced to the nearest depth of each square of this many pixels."""

SMALL_IMAGE = (IMAGE_SHAPE[0] // POOL_PIXELS, IMAGE_SHAPE[1] // POOL_PIXELS)

SIZES: dict[Sensor, int] = {
    "lidar": STATE + LIDAR_RAYS,
    "depth": STATE + LIDAR_RAYS + SMALL_IMAGE[0] * SMALL_IMAGE[1],
}
"""Length of the vector."""


class DriveMemory:
    """Turns the observations of one drive into the network's vectors; remembers past positions and depth images.

    A vector is float32 (SIZES[sensor],). Its parts, in order:

    - `goal` (3,) and `velocity` (2,) as the environment gives them;
    - the robot's positions 0.5, 1, 2, 4, 8 and 16 s ago in its present frame, meters, which show whether it moves back
      and forth; before the drive began the robot stood at its start;
    - ranges (180,), meters: the lidar's, or those of `RememberedObstacles` for the depth camera;
    - for the depth camera, the image reduced to 18 x 32 by the nearest depth of each square.

    Args:
        sensor: source of the observations.
    """

    def __init__(self, sensor: Sensor) -> None:
        self._sensor = sensor
        self.reset()

    def reset(self) -> None:
        """Forget the drive."""
        self._first: Pose | None = None
        self._places: list[tuple[float, float]] = []
        self._surroundings = RememberedObstacles() if self._sensor == "depth" else None

    def vector(self, observation: Observation, pose: ArrayLike) -> Vector:
        """Return the vector of the next control step.

        Args:
            observation: with `goal`, `velocity` and the sensor.
            pose: (x, y, yaw) in any frame that is fixed during the drive.
        """
        x, y, yaw = np.asarray(pose, dtype=np.float64).tolist()
        self._first = self._first or (x, y, yaw)
        self._places.append((x, y))
        last = len(self._places) - 1
        trail = np.array([self._places[max(last - steps, 0)] for steps in TRAIL_STEPS])
        parts = [observation["goal"], observation["velocity"], to_local(trail, (x, y, yaw)).ravel()]
        if self._surroundings is None:
            parts.append(observation["lidar"])
        else:
            picture = np.asarray(observation["depth"]).reshape(IMAGE_SHAPE)
            here = to_local(np.array([(x, y)]), self._first)[0].tolist()
            parts.append(self._surroundings.ranges(picture, (here[0], here[1], yaw - self._first[2])))
            parts.append(
                picture.reshape(SMALL_IMAGE[0], POOL_PIXELS, SMALL_IMAGE[1], POOL_PIXELS).min(axis=(1, 3)).ravel()
            )
        return np.concatenate(parts).astype(np.float32)
