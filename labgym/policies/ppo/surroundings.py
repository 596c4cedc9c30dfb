"""Obstacles that a depth camera has seen since the drive began, as a 360-degree scan."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from labgym.envs.sensors import LIDAR_RAYS, RANGE
from labgym.navigation import Pose
from labgym.policies.depth_map import DepthMap

Floats = NDArray[np.float32]

REACH = 20.0
"""Distance from the start of a drive within which obstacles are remembered, meters."""
WIDEST = 6
"""Largest number of directions that an obstacle covers on either side of its center."""
STEP = 2.0 * math.pi / LIDAR_RAYS


class Surroundings:
    """Remembers the cells in which the camera saw an obstacle.

    The camera sees 68 degrees, but the robot has to know what stands next to it while it passes.
    """

    def __init__(self) -> None:
        self._map = DepthMap(REACH)
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
        directions = np.rint((np.arctan2(y[near], x[near]) - pose[2] + math.pi) / STEP).astype(np.intp)
        ranges = np.full(LIDAR_RAYS, RANGE)
        np.minimum.at(ranges, directions % LIDAR_RAYS, distances)
        covered = np.minimum(self._map.resolution / 2.0 / np.maximum(distances, 1e-6) / STEP, WIDEST).astype(np.intp)
        for aside in range(1, int(covered.max(initial=0)) + 1):
            wide = covered >= aside
            for offset in (-aside, aside):
                np.minimum.at(ranges, (directions[wide] + offset) % LIDAR_RAYS, distances[wide])
        return ranges.astype(np.float32)
