"""Matching of scans with the old map: the pose of the robot, and the place of the lidar on it."""

from __future__ import annotations

import math

import numpy as np

from labgym.geometry import Array, compose, relative, to_local, to_world, wrap_angle
from labgym.navigation import Pose
from labgym.policies.distance_field import DistanceField

PLACE_DRIFT_M, HEADING_DRIFT_RAD = 0.015, math.radians(1.5)
"""Assumed standard deviation of the odometry after one meter: of the place, m, and of the heading, rad. One and a half
times RoboTHOR's noise."""

RETURN_DEVIATION_M = 0.15
"""Standard deviation of a return about the map, meters: the noise of the lidar is less, but the errors of the map are
shared by many returns."""

WEIGHT_SCALE_M = 0.10
"""Distance of a return from the map at which its weight has fallen to a quarter, meters."""

LONGEST_MATCH_M = 0.40
"""Returns farther than this from everything in the map are ignored, meters."""

ITERATIONS = 4

LEAST_RETURNS = 20
"""Number of returns below which a scan says nothing."""


class Localizer:
    """Tracks the pose in the map's frame by the greatest posterior probability.

    Odometry moves the estimate and widens its covariance. Each scan is then matched by Gauss-Newton steps that minimize

        sum_i w_i d(p_i)^2 / RETURN_DEVIATION_M^2 + (x - x0)' P^-1 (x - x0),

    d the signed distance of the return p_i from the map, w_i = 1 / (1 + (d / WEIGHT_SCALE_M)^2)^2 (Geman and McClure),
    x0 and P the moved estimate and its covariance. With `drift` 0 the odometry is taken as exact, and scans change
    nothing.

    Args:
        seen: distances to what the lidar sees in the map.
        start: pose of the robot in the map's frame.
        drift: multiple of the assumed errors of the odometry.

    Attributes:
        seen: the distances, to be replaced where the map grows.
        pose: the estimate (x, y, yaw).
        reckoned: the pose by the odometry alone.
        covariance: (3, 3) of the estimate.
    """

    def __init__(self, seen: DistanceField, start: Pose, drift: float = 1.0) -> None:
        self.seen, self._drift = seen, drift
        self._odometry: Pose = (0.0, 0.0, 0.0)
        self.pose = self.reckoned = start
        self.covariance: Array = np.zeros((3, 3))

    def restart(self) -> None:
        """Begin a new odometry frame at the present place; the estimate stays."""
        self._odometry = (0.0, 0.0, 0.0)

    def move(self, odometry: Pose) -> None:
        """Move the estimate by the odometry since the last call."""
        step = relative(self._odometry, odometry)
        self._odometry = odometry
        dx, dy = to_world([step[:2]], (0.0, 0.0, self.pose[2]))[0]
        self.pose, self.reckoned = compose(self.pose, step), compose(self.reckoned, step)
        transition = np.array([[1.0, 0.0, -dy], [0.0, 1.0, dx], [0.0, 0.0, 1.0]])
        way = self._drift**2 * math.hypot(dx, dy)
        turned = self._drift**2 * abs(step[2]) / (2.0 * math.pi)
        noise = np.diag([PLACE_DRIFT_M**2 * way, PLACE_DRIFT_M**2 * way, HEADING_DRIFT_RAD**2 * (way + turned)])
        self.covariance = transition @ self.covariance @ transition.T + noise

    def match(self, points: Array) -> None:
        """Correct the estimate by the returns of a scan, (n, 2) in the robot frame, meters."""
        if len(points) < LEAST_RETURNS or not self.covariance.any():
            return
        inverse = np.linalg.inv(self.covariance + 1e-10 * np.eye(3))
        prior, pose = np.array(self.pose), np.array(self.pose)
        information = np.zeros((3, 3))
        for _ in range(ITERATIONS):
            cosine, sine = math.cos(pose[2]), math.sin(pose[2])
            turned = points @ np.array([[cosine, sine], [-sine, cosine]])
            distance, slope = self.seen.with_gradient(turned + pose[:2])
            jacobian = np.column_stack([slope, slope[:, 1] * turned[:, 0] - slope[:, 0] * turned[:, 1]])
            weight = np.where(
                np.abs(distance) < LONGEST_MATCH_M, 1.0 / (1.0 + (distance / WEIGHT_SCALE_M) ** 2) ** 2, 0.0
            )
            weight /= RETURN_DEVIATION_M**2
            information = (jacobian * weight[:, None]).T @ jacobian
            offset = prior - pose
            offset[2] = wrap_angle(float(offset[2]))
            gradient = inverse @ offset - jacobian.T @ (weight * distance)
            pose = pose + np.linalg.solve(information + inverse, gradient)
        self.pose = (float(pose[0]), float(pose[1]), wrap_angle(float(pose[2])))
        self.covariance = np.linalg.inv(information + inverse)


MOUNTING_DEVIATION_M, MOUNTING_DEVIATION_RAD = 0.02, math.radians(1.5)
"""Assumed standard deviations of the lidar's place along each axis, meters, and of its direction, radians."""

MOUNTING_RETURN_DEVIATION_M, MOUNTING_WEIGHT_SCALE_M, MOUNTING_LONGEST_MATCH_M = 0.10, 0.08, 0.30
"""Standard deviation of a return about the map, distance at which its weight falls to a quarter, and distance beyond
which it is ignored, meters."""

MOUNTING_ITERATIONS = 2

STATION_RADIUS_M = 1.5
"""Returns within this distance of the docking pose do not count, meters: the station may have moved."""


class LidarMounting:
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
        self._information: Array = np.diag(
            [MOUNTING_DEVIATION_M**-2, MOUNTING_DEVIATION_M**-2, MOUNTING_DEVIATION_RAD**-2]
        )
        self.offset: Pose = (0.0, 0.0, 0.0)

    def corrected(self, points: Array) -> Array:
        """Return returns (n, 2) in the robot frame for a lidar that is where it was thought to be."""
        return to_world(points, self.offset) if len(points) else points

    def observe(self, pose: Pose, points: Array) -> None:
        """Take in the returns of a scan, (n, 2) meters in the frame of the lidar, at a pose of the robot on the map."""
        places = to_world(self.corrected(points), pose) if len(points) else points
        away = np.hypot(*(places - self._goal[:2]).T) if len(points) else np.empty(0)
        points = points[away > STATION_RADIUS_M]
        if len(points) < 10:
            return
        prior, offset = np.array(self.offset), np.array(self.offset)
        information = self._information
        for _ in range(MOUNTING_ITERATIONS):
            local = to_world(points, (float(offset[0]), float(offset[1]), float(offset[2])))
            distance, slope = self._seen.with_gradient(to_world(local, pose))
            slope = to_local(slope, (0.0, 0.0, pose[2]))
            arm = local - offset[:2]
            jacobian = np.column_stack([slope, slope[:, 1] * arm[:, 0] - slope[:, 0] * arm[:, 1]])
            weight = (
                np.where(
                    np.abs(distance) < MOUNTING_LONGEST_MATCH_M,
                    (1.0 + (distance / MOUNTING_WEIGHT_SCALE_M) ** 2) ** -2,
                    0.0,
                )
                / MOUNTING_RETURN_DEVIATION_M**2
            )
            gained = (jacobian * weight[:, None]).T @ jacobian
            gradient = self._information @ (prior - offset) - jacobian.T @ (weight * distance)
            information = self._information + gained
            offset = offset + np.linalg.solve(information, gradient)
        self._information = information
        self.offset = (float(offset[0]), float(offset[1]), float(offset[2]))
