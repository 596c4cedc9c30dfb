"""Bug2: along the straight line to the goal, and around obstacles until the line is met again nearer to it."""

from __future__ import annotations

import math
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from labgym.envs.robot import ROBOT, RobotSpec, turn_towards
from labgym.geometry import Array, wrap_angle
from labgym.navigation import Pose
from labgym.policies.arrival import ArrivingPolicy
from labgym.policies.dwa import DISC_MARGIN_M, lidar_points, stopping_speed
from labgym.policies.policy import EpisodeStart, Observation, Sensors
from labgym.policies.tracking import velocities_to_action
from labgym.policies.via_point import straight_clearance

DISC_RADIUS_M = ROBOT.planning_radius
"""Radius of the disc that is kept clear, meters."""
FREE_DISTANCE_M = 0.25
"""A direction is free if the disc can travel this far, meters."""
LINE_TOLERANCE_M = 0.10
"""Distance from the line within which the robot has met it, meters."""
LEAVE_MARGIN_M = 0.20
"""Distance by which a meeting with the line must be nearer to the goal than the point where it was left, meters."""
DIRECTION_COUNT = 120
"""Directions that are tried around the robot."""
TURN_IN_PLACE_RAD = 0.5
"""Bearing beyond which the robot turns in place, radians."""
OBSTACLE_DECELERATION = 1.0
"""Deceleration that limits the speed towards obstacles, m/s2."""


class Bug2Policy(ArrivingPolicy):
    """Bug2 of V. J. Lumelsky and A. A. Stepanov (Algorithmica 2, 1987) with a lidar and a disc for a robot.

    The robot drives along the line from start to goal. Where an obstacle blocks it, it follows the obstacle's boundary,
    to its left, until it meets the line at a point nearer to the goal than the one where it left it. It keeps no map.
    Following a boundary means: of all directions, taken counter-clockwise from the side of the obstacle, it takes the
    first in which the disc is free to travel. The paper's robot is a point with a sensor of touch.
    """

    name: ClassVar[str] = "bug2"
    observation: ClassVar[Sensors] = "lidar"

    def __init__(self) -> None:
        self._robot: RobotSpec = ROBOT
        self._goal = (0.0, 0.0)
        self._hit: float | None = None
        self._direction = 0.0

    def reset(self, episode: EpisodeStart) -> None:
        """Begin on the line from the start to the goal."""
        super().reset(episode)
        self._goal = episode.goal
        self._hit, self._direction = None, math.atan2(episode.goal[1], episode.goal[0])

    def drive(self, observation: Observation, pose: Pose) -> NDArray[np.floating[Any]]:
        """Choose a direction and drive in it."""
        points = lidar_points(np.asarray(observation["lidar"], dtype=np.float64))
        nearest = float(np.hypot(points[:, 0], points[:, 1]).min(initial=math.inf))
        radius = min(DISC_RADIUS_M, nearest - DISC_MARGIN_M)
        self._direction = self._chosen(pose, points, radius)
        bearing = wrap_angle(self._direction - pose[2])
        return self._driven(bearing, points, radius)

    def _chosen(self, pose: Pose, points: Array, radius: float) -> float:
        """Return the direction to drive in, radians in the start frame."""
        gx, gy = self._goal[0] - pose[0], self._goal[1] - pose[1]
        away, towards = math.hypot(gx, gy), math.atan2(gy, gx)
        free = min(FREE_DISTANCE_M, away)
        if self._hit is not None and self._on_line(pose) and away < self._hit - LEAVE_MARGIN_M:
            if _clearance(towards - pose[2], points, radius) >= free:
                self._hit = None
        if self._hit is None:
            if _clearance(towards - pose[2], points, radius) >= free:
                return towards
            self._hit = away
            self._direction = towards
        # The obstacle is on the right: begin there, and turn to the left until the way is free.
        sweep = self._direction - math.pi / 2.0 + 2.0 * math.pi / DIRECTION_COUNT * np.arange(DIRECTION_COUNT)
        heading = sweep - pose[2]
        rays = np.column_stack([np.cos(heading), np.sin(heading)])
        clear = straight_clearance(np.zeros_like(rays), rays, points, radius) >= FREE_DISTANCE_M
        return wrap_angle(float(sweep[int(np.argmax(clear))])) if clear.any() else self._direction

    def _on_line(self, pose: Pose) -> bool:
        """Return whether the robot is on the line from start to goal."""
        gx, gy = self._goal
        return abs(gx * pose[1] - gy * pose[0]) <= LINE_TOLERANCE_M * math.hypot(gx, gy)

    def _driven(self, bearing: float, points: Array, radius: float) -> NDArray[np.floating[Any]]:
        """Return the action that drives at a bearing, as fast as the free way ahead allows."""
        if abs(bearing) > TURN_IN_PLACE_RAD:
            return turn_towards(bearing, self._robot)
        free = min(_clearance(0.0, points, radius), _clearance(bearing, points, radius))
        fastest = float(stopping_speed(np.array([free]), OBSTACLE_DECELERATION, self._robot.control_dt)[0])
        v = min(self._robot.v_max * math.cos(bearing), fastest)
        return velocities_to_action(v, 2.0 * bearing, self._robot)


def _clearance(bearing: float, points: Array, radius: float) -> float:
    """Return how far the disc can travel at a bearing before it touches a point, meters."""
    ray = np.array([[math.cos(bearing), math.sin(bearing)]])
    return float(straight_clearance(np.zeros((1, 2)), ray, points, radius)[0])
