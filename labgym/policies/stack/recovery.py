"""Recovery: notice that the robot is stuck; wait, back off, forget marks, turn, plan again."""

from __future__ import annotations

import math
from collections import deque

import numpy as np

from labgym.envs.robot import ROBOT, RobotSpec
from labgym.geometry import Array
from labgym.navigation import Pose
from labgym.policies.stack.costmap import Costmap

STUCK_STEPS = 60
"""Control steps after which a robot that has hardly moved is stuck; those near people do not count."""
STUCK_DISTANCE_M = 0.25
"""Distance that a robot that is not stuck moves in this time, meters."""
BACK_STEPS, TURN_STEPS = 12, 25
"""Control steps of backing off and of turning."""
BACK_SPEED = -0.15
"""Speed of backing off, m/s."""
BACK_ROOM_M = 0.10
"""Room behind the robot that backing off needs, meters."""
FORGET_RADIUS_M = 2.5
"""Radius around the robot within which marks are forgotten, meters."""


class Recovery:
    """Takes over when the robot is stuck.

    Args:
        robot: its dimensions and limits.
    """

    def __init__(self, robot: RobotSpec = ROBOT) -> None:
        self._robot = robot
        self._places: deque[Pose] = deque(maxlen=STUCK_STEPS)
        self._backing = self._turning = 0

    def step(
        self,
        pose: Pose,
        waiting: bool,
        arrived: bool,
        points: Array,
        costmap: Costmap,
    ) -> tuple[float, float] | None:
        """Return the velocities of a recovery; None while the robot is not stuck.

        Args:
            pose: of the robot. waiting: whether a person is near. arrived: whether it rests at its goal.
            points: (n, 2) returns of the scan in the robot frame. costmap: whose marks are forgotten.
        """
        if waiting or arrived:
            self._backing = self._turning = 0
            return None
        if self._backing or self._turning:
            return self._recovered(points)
        self._places.append(pose)
        stuck = len(self._places) == STUCK_STEPS and math.dist(self._places[0][:2], pose[:2]) < STUCK_DISTANCE_M
        if stuck:
            self._places.clear()
            self._backing, self._turning = BACK_STEPS, TURN_STEPS
            costmap.forget(pose, FORGET_RADIUS_M)
        return None

    def _recovered(self, points: Array) -> tuple[float, float]:
        """Return the velocities of backing off, while there is room, and then of turning."""
        if self._backing:
            self._backing -= 1
            behind = points[(points[:, 0] < 0.0) & (np.abs(points[:, 1]) < self._robot.chassis_radius + 0.03)]
            room = np.hypot(behind[:, 0], behind[:, 1]).min(initial=math.inf) - self._robot.chassis_radius
            if room > BACK_ROOM_M:
                return BACK_SPEED, 0.0
            self._backing = 0
        self._turning -= 1
        return 0.0, 0.6 * self._robot.w_max
