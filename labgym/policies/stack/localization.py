"""Localization on the old map: odometry, corrected by matching each scan with the map's distances."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from labgym.geometry import compose, relative, to_world, wrap_angle
from labgym.navigation import Pose
from labgym.policies.distance_field import DistanceField

Array = NDArray[np.float64]

ALONG, HEADING = 0.015, math.radians(1.5)
"""Assumed standard deviation of the odometry after one meter: of the place, m, and of the heading, rad. One and a half
times RoboTHOR's noise."""
DEVIATION = 0.15
"""Standard deviation of a return about the map, meters: the noise of the lidar is less, but the errors of the map are
shared by many returns."""
SCALE = 0.10
"""Distance of a return from the map at which its weight has fallen to a quarter, meters."""
TOO_FAR = 0.40
"""Returns farther than this from everything in the map are ignored, meters."""
ITERATIONS = 4
ENOUGH = 20
"""Number of returns below which a scan says nothing."""


class Localizer:
    """Tracks the pose in the map's frame by the greatest posterior probability.

    Odometry moves the estimate and widens its covariance. Each scan is then matched by Gauss-Newton steps that minimize

        sum_i w_i d(p_i)^2 / DEVIATION^2 + (x - x0)' P^-1 (x - x0),

    d the signed distance of the return p_i from the map, w_i = 1 / (1 + (d / SCALE)^2)^2 (Geman and McClure), x0 and P
    the moved estimate and its covariance. With `drift` 0 the odometry is taken as exact, and scans change nothing.

    Args:
        seen: distances to what the lidar sees in the map.
        start: pose of the robot in the map's frame.
        drift: multiple of the assumed errors of the odometry.

    Attributes:
        pose: the estimate (x, y, yaw).
        covariance: (3, 3) of it.
    """

    def __init__(self, seen: DistanceField, start: Pose, drift: float = 1.0) -> None:
        self._seen, self._drift = seen, drift
        self._odometry: Pose = (0.0, 0.0, 0.0)
        self.pose = start
        self.covariance: Array = np.zeros((3, 3))

    def restart(self) -> None:
        """Begin a new odometry frame at the present place; the estimate stays."""
        self._odometry = (0.0, 0.0, 0.0)

    def move(self, odometry: Pose) -> None:
        """Move the estimate by the odometry since the last call."""
        step = relative(self._odometry, odometry)
        self._odometry = odometry
        dx, dy = to_world([step[:2]], (0.0, 0.0, self.pose[2]))[0]
        self.pose = compose(self.pose, step)
        transition = np.array([[1.0, 0.0, -dy], [0.0, 1.0, dx], [0.0, 0.0, 1.0]])
        way = self._drift**2 * math.hypot(dx, dy)
        turned = self._drift**2 * abs(step[2]) / (2.0 * math.pi)
        noise = np.diag([ALONG**2 * way, ALONG**2 * way, HEADING**2 * (way + turned)])
        self.covariance = transition @ self.covariance @ transition.T + noise

    def match(self, points: Array) -> None:
        """Correct the estimate by the returns of a scan, (n, 2) in the robot frame, meters."""
        if len(points) < ENOUGH or not self.covariance.any():
            return
        inverse = np.linalg.inv(self.covariance + 1e-10 * np.eye(3))
        prior, pose = np.array(self.pose), np.array(self.pose)
        information = np.zeros((3, 3))
        for _ in range(ITERATIONS):
            cosine, sine = math.cos(pose[2]), math.sin(pose[2])
            turned = points @ np.array([[cosine, sine], [-sine, cosine]])
            distance, slope = self._seen.with_gradient(turned + pose[:2])
            jacobian = np.column_stack([slope, slope[:, 1] * turned[:, 0] - slope[:, 0] * turned[:, 1]])
            weight = np.where(np.abs(distance) < TOO_FAR, 1.0 / (1.0 + (distance / SCALE) ** 2) ** 2, 0.0)
            weight /= DEVIATION**2
            information = (jacobian * weight[:, None]).T @ jacobian
            offset = prior - pose
            offset[2] = wrap_angle(float(offset[2]))
            gradient = inverse @ offset - jacobian.T @ (weight * distance)
            pose = pose + np.linalg.solve(information + inverse, gradient)
        self.pose = (float(pose[0]), float(pose[1]), wrap_angle(float(pose[2])))
        self.covariance = np.linalg.inv(information + inverse)
