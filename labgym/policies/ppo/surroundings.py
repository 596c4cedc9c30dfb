"""What a depth camera has shown around the robot since the drive began, as a scan all round."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from labgym.envs.sensors import LIDAR_RAYS, RANGE
from labgym.navigation import Pose
from labgym.policies.depth_map import DepthMap

Floats = NDArray[np.float32]

REACH = 20.0
"""How far from the start of a drive obstacles are remembered, metres."""
WIDEST = 6
"""An obstacle covers at most so many directions to either side of its own."""
STEP = 2.0 * math.pi / LIDAR_RAYS


class Surroundings:
    """Remembers the cells in which the camera saw something in the robot's way.

    It sees 68 degrees, and has to know what stands beside it while it passes.
    """

    def __init__(self) -> None:
        self._map = DepthMap(REACH)
        self._cells = np.empty((0, 2))

    def ranges(self, picture: NDArray[np.floating], pose: Pose) -> Floats:
        """Enter a picture and return how far the nearest obstacle seen so far is in each direction.

        Args:
            picture: planar depth (72, 128), metres.
            pose: (x, y, yaw) in the frame of the drive's start.

        Returns:
            (180,) metres from the robot's axis, 10 where nothing is nearer or nothing was seen; directions are those of
            the lidar.
        """
        self._cells = np.concatenate([self._cells, self._map.add(picture, pose)])
        x, y = (self._cells - pose[:2]).T
        distances = np.hypot(x, y)
        near = distances < RANGE
        distances = distances[near]
        directions = np.rint((np.arctan2(y[near], x[near]) - pose[2] + math.pi) / STEP).astype(np.intp)
        found = np.full(LIDAR_RAYS, RANGE)
        np.minimum.at(found, directions % LIDAR_RAYS, distances)
        covered = np.minimum(self._map.resolution / 2.0 / np.maximum(distances, 1e-6) / STEP, WIDEST).astype(np.intp)
        for aside in range(1, int(covered.max(initial=0)) + 1):
            wide = covered >= aside
            for turned in (-aside, aside):
                np.minimum.at(found, (directions[wide] + turned) % LIDAR_RAYS, distances[wide])
        return found.astype(np.float32)
