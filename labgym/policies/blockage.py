"""Notice that an unseen obstacle stops the robot, and back off."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from labgym.envs.robot import ROBOT, RobotSpec
from labgym.policies.tracking import velocities_to_action

DRIVING_SPEED = 0.10
"""Commanded forward velocity above which the robot is expected to move, m/s."""

BLOCKED_SHARE = 0.25
"""The robot is held up if it drives at less than this share of the commanded velocity."""


class BlockageDetector:
    """Compares the commanded with the actual forward velocity.

    Args:
        robot: limits of the robot.
        patience: consecutive control steps of being held up after which the robot counts as blocked; more than its
            acceleration takes.
        retreat: control steps of backing off.
    """

    def __init__(self, robot: RobotSpec = ROBOT, patience: int = 4, retreat: int = 6) -> None:
        self._robot, self._patience, self._retreat = robot, patience, retreat
        self._commanded = 0.0
        self._held_up = 0
        self._left = 0

    @property
    def backing(self) -> bool:
        """Whether the robot is backing off."""
        return self._left > 0

    def note(self, v: float) -> None:
        """Record the forward velocity that is commanded now, m/s."""
        self._commanded = v

    def blocked(self, speed: float) -> bool:
        """Return whether the robot is blocked at an actual forward velocity, m/s; it then starts to back off."""
        held_up = not self.backing and self._commanded >= DRIVING_SPEED and speed < BLOCKED_SHARE * self._commanded
        self._held_up = self._held_up + 1 if held_up else 0
        if self._held_up < self._patience:
            return False
        self._held_up, self._commanded, self._left = 0, 0.0, self._retreat
        return True

    def back_off(self) -> NDArray[np.floating[Any]]:
        """Return the action of one step of backing off."""
        self._left -= 1
        return velocities_to_action(self._robot.v_min, 0.0, self._robot)
