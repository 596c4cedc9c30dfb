"""Dead reckoning: the motion of a base that follows its commands."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labgym.envs.robot import ROBOT, RobotSpec
from labgym.geometry import wrap_angle
from labgym.navigation import Pose


class DeadReckoning:
    """Pose and velocity of a base that reaches commanded velocities at its greatest accelerations.

    Attributes:
        pose: (x, y, yaw) in the start frame.
        velocity: forward velocity, m/s, and turn rate, rad/s.
    """

    def __init__(self, robot: RobotSpec = ROBOT) -> None:
        self._robot = robot
        self.pose: Pose = (0.0, 0.0, 0.0)
        self.velocity: tuple[float, float] = (0.0, 0.0)

    def drive(self, action: NDArray[np.floating[Any]]) -> None:
        """Advance by one control step under an action, (2,) in [-1, 1]."""
        robot, dt = self._robot, self._robot.timestep
        targets = robot.twist(float(action[0]), float(action[1]))
        (x, y, yaw), (v, w) = self.pose, self.velocity
        for _ in range(robot.substeps):
            v += _servo(targets[0] - v, robot.acceleration, robot.lag, dt)
            w += _servo(targets[1] - w, robot.turn_acceleration, robot.lag, dt)
            yaw += w * dt
            x, y = x + v * math.cos(yaw) * dt, y + v * math.sin(yaw) * dt
        self.pose, self.velocity = (x, y, wrap_angle(yaw)), (v, w)


def _servo(error: float, limit: float, lag: float, dt: float) -> float:
    """Return the change of a velocity in one physics step under a servo with a force limit (implicit Euler)."""
    return min(max(error * dt / (lag + dt), -limit * dt), limit * dt)
