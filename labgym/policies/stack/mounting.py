"""Where the lidar really is on the robot, estimated from scans of a known map at known poses."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from labgym.geometry import to_local, to_world
from labgym.navigation import Pose
from labgym.policies.distance_field import DistanceField

Array = NDArray[np.float64]

PLACE, TURN = 0.02, math.radians(1.5)
"""Assumed standard deviations of the lidar's place along each axis, meters, and of its direction, radians."""
DEVIATION, SCALE, TOO_FAR = 0.10, 0.08, 0.30
"""Standard deviation of a return about the map, distance at which its weight falls to a quarter, and distance beyond
which it is ignored, meters."""
ITERATIONS = 2
STATION = 1.5
"""Returns within this distance of the docking pose do not count, meters: the station may have moved."""


class Mounting:
    """Estimates the place of the lidar in the robot frame.

    Each scan of an exact pose corrects the estimate by Gauss-Newton steps on the distances of its returns from the map,
    weighted as by Geman and McClure, from the posterior of the scans before.

    Args:
        seen: distances to what the lidar sees in the map. goal: the docking pose in it.

    Attributes:
        offset: (dx, dy, turn) of the lidar in the robot frame, meters and radians.
    """

    def __init__(self, seen: DistanceField, goal: Pose) -> None:
        self._seen, self._goal = seen, goal
        self._information: Array = np.diag([PLACE**-2, PLACE**-2, TURN**-2])
        self.offset: Pose = (0.0, 0.0, 0.0)

    def corrected(self, points: Array) -> Array:
        """Return returns (n, 2) in the robot frame for a lidar that is where it was thought to be."""
        return to_world(points, self.offset) if len(points) else points

    def observe(self, pose: Pose, points: Array) -> None:
        """Take in the returns of a scan, (n, 2) meters in the frame of the lidar, at a pose of the robot on the map."""
        places = to_world(self.corrected(points), pose) if len(points) else points
        away = np.hypot(*(places - self._goal[:2]).T) if len(points) else np.empty(0)
        points = points[away > STATION]
        if len(points) < 10:
            return
        prior, offset = np.array(self.offset), np.array(self.offset)
        information = self._information
        for _ in range(ITERATIONS):
            local = to_world(points, (float(offset[0]), float(offset[1]), float(offset[2])))
            distance, slope = self._seen.with_gradient(to_world(local, pose))
            slope = to_local(slope, (0.0, 0.0, pose[2]))
            arm = local - offset[:2]
            jacobian = np.column_stack([slope, slope[:, 1] * arm[:, 0] - slope[:, 0] * arm[:, 1]])
            weight = np.where(np.abs(distance) < TOO_FAR, (1.0 + (distance / SCALE) ** 2) ** -2, 0.0) / DEVIATION**2
            gained = (jacobian * weight[:, None]).T @ jacobian
            gradient = self._information @ (prior - offset) - jacobian.T @ (weight * distance)
            information = self._information + gained
            offset = offset + np.linalg.solve(information, gradient)
        self._information = information
        self.offset = (float(offset[0]), float(offset[1]), float(offset[2]))
