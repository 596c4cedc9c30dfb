"""Bringing the robot to rest at its goal: the evaluator's parking, and actions that end a drive by it."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labgym.counts import check_switch, whole_number
from labgym.envs.checks import positive
from labgym.envs.parts.actions import SlippingActions, numbers
from labgym.envs.parts.odometry import RECKONED, announced_goal
from labgym.envs.parts.protocols import Command
from labgym.envs.parts.registry import registered
from labgym.envs.robot import turn_towards
from labgym.envs.state import Pose, State
from labgym.errors import OptionError
from labgym.geometry import wrap_angle

REST = (0.01, 0.02)
"""Forward velocity, m/s, and turn rate, rad/s, below which the robot is at rest."""
HEADING = 0.005
"""Deviation from the goal's heading at which the turn at the goal ends, radians."""
TURNING = 80
"""Greatest number of control steps of that turn."""


class Parking:
    """Brings the robot to rest: after a policy's STOP, or in its place.

    Args:
        heading: to which the robot turns once it rests, radians in the start frame; None to leave it.
        stay: control steps that it must rest at the end.
    """

    def __init__(self, heading: float | None = None, stay: int = 0) -> None:
        self._heading, self._left, self._turning = heading, stay, TURNING

    def action(self, pose: Pose, velocity: tuple[float, float]) -> NDArray[np.floating] | None:
        """Return the next action, (2,), or None when the robot has been parked.

        Args:
            pose: by odometry, in the start frame.
            velocity: forward, m/s, and turn rate, rad/s.
        """
        resting = abs(velocity[0]) <= REST[0] and abs(velocity[1]) <= REST[1]
        off = 0.0 if self._heading is None else wrap_angle(self._heading - pose[2])
        if self._turning and abs(off) > HEADING and abs(velocity[0]) <= REST[0]:
            self._turning -= 1
            return turn_towards(off)
        if not resting:
            return np.zeros(2)
        if self._left <= 0:
            return None
        self._left -= 1
        return np.zeros(2)


@registered("actions", "braking", frozen=False)
class BrakingActions(SlippingActions):
    """Velocities as `SlippingActions`, until the evaluator's brake takes over near the goal.

    Once the robot is within `distance` of the announced goal by its odometry, the brake parks it, and the agent's
    actions have no effect. The parked robot says STOP, so that the ending "stop" judges where it rests. It needs the
    sensor "odometry".

    Attributes:
        distance: from the announced goal by odometry, meters. docks: whether the robot turns to the goal's heading.
        stay: control steps that it must rest.
    """

    distance: float = 0.25
    docks: bool = False
    stay: int = 0

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.stop:
            raise OptionError("BrakingActions: the brake says STOP; pass stop=False, or SlippingActions")
        positive(self, "distance")
        check_switch("BrakingActions: docks", self.docks)
        whole_number("BrakingActions: stay", self.stay, 0)

    def reset(self, state: State, rng: np.random.Generator) -> None:
        """Begin an episode at rest, with new errors."""
        super().reset(state, rng)
        self._leg = -1
        self._parking: Parking | None = None

    def commands(self, action: Any, state: State, rng: np.random.Generator) -> Iterable[Command]:
        """Return one command: the agent's, or the brake's.

        Raises:
            OptionError: not one finite number per axis, or no odometry has been read.
        """
        if RECKONED not in state.views:
            raise OptionError("actions 'braking' need an odometry sensor: add 'odometry' to `sensors`")
        if state.leg != self._leg:
            self._leg, self._stopped = state.leg, False
            self._parking = None
        here, goal = state.views[RECKONED], announced_goal(state)
        if self._parking is None and math.dist(here[:2], goal[:2]) <= self.distance:
            self._parking = Parking(goal[2] if self.docks else None, self.stay)
        if self._parking is not None:
            numbers(action, self._axes)
            parked = self._parking.action(here, state.velocity)
            self._stopped = parked is None
            action = np.zeros(2) if parked is None else parked
        return super().commands(action, state, rng)
