"""Notices that the robot is stopped by what its sensors do not show, and backs off."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from labgym.envs.robot import ROBOT, RobotSpec
from labgym.policies.tracking import velocities_to_action

ASKED = 0.10
"""Forward velocity from which on the robot is expected to move, m/s."""

SHARE = 0.25
"""It is held up where it drives at less than this share of what it was asked for."""


class Blockage:
    """Compares what was asked for with what was driven.

    Args:
        robot: its limits.
        patience: control steps in a row in which the robot is held up before it counts as blocked; longer than
            its acceleration takes.
        retreat: control steps of backing off.
    """

    def __init__(self, robot: RobotSpec = ROBOT, patience: int = 4, retreat: int = 6) -> None:
        self._robot, self._patience, self._retreat = robot, patience, retreat
        self._asked = 0.0
        self._held = 0
        self._left = 0

    @property
    def backing(self) -> bool:
        """Whether it is backing off."""
        return self._left > 0

    def note(self, v: float) -> None:
        """Note the forward velocity that is asked for now, m/s."""
        self._asked = v

    def blocked(self, speed: float) -> bool:
        """Whether the robot turns out to be blocked now, given its forward velocity in m/s; then it backs off."""
        held_up = not self.backing and self._asked >= ASKED and speed < SHARE * self._asked
        self._held = self._held + 1 if held_up else 0
        if self._held < self._patience:
            return False
        self._held, self._asked, self._left = 0, 0.0, self._retreat
        return True

    def back_off(self) -> NDArray[np.floating[Any]]:
        """Return the action of one step of backing off."""
        self._left -= 1
        return velocities_to_action(self._robot.v_min, 0.0, self._robot)
