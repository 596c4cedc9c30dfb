"""Gentle driving: limits on acceleration and jerk for a base that carries a liquid."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING

from labgym.envs.robot import ROBOT, RobotSpec

if TYPE_CHECKING:
    from labgym.envs.conditions.beaker import Beaker

FREEBOARD_SHARE = 0.5
"""Share of the freeboard that a constant acceleration along the way, or one across it, raises the surface by. The
other part is for both at once, for the oscillation about that level and for the steps of the commands."""
HARD_BRAKING_SHARE = 0.93
"""Share of the robot's acceleration with which it brakes hard."""


@dataclass(frozen=True)
class GentleLimits:
    """Limits of a base that carries something.

    Attributes:
        acceleration: along the way, m/s2.
        lateral: across the way in turns, m/s2.
        weights: of the latest commands, newest first, with sum 1: the velocity that is driven is their mean.
    """

    acceleration: float
    lateral: float
    weights: tuple[float, ...]

    @classmethod
    def of(cls, beaker: Beaker, robot: RobotSpec = ROBOT) -> GentleLimits:
        """Return the limits for a beaker: of the acceleration by its freeboard, of the jerk by its frequency."""
        level = beaker.freeboard / beaker.rise(1.0 / beaker.frequency**2)
        limit = min(FREEBOARD_SHARE * level, robot.acceleration)
        return cls(limit, limit, shaping_weights(beaker.frequency, robot.control_dt))

    @property
    def delay(self) -> float:
        """Mean age of the commands that are driven, control steps."""
        return sum(age * weight for age, weight in enumerate(self.weights))


def shaping_weights(frequency: float, dt: float) -> tuple[float, ...]:
    """Return the weights of a filter of commands after which an undamped oscillator of a frequency is at rest.

    The filter is (1 - 2 cos(w k dt) z^-k + z^-2k), divided by its sum: its zeros are at the frequency. The spacing k is
    the smallest for which no weight is negative, so that the filter exceeds no limit that its input obeys (input
    shaping: N. C. Singer and W. P. Seering, Journal of Dynamic Systems, Measurement and Control 112(1), 1990).

    Args:
        frequency: angular frequency, rad/s. dt: time between commands, seconds.
    """
    spacing = max(1, math.ceil(math.pi / 2.0 / (frequency * dt) - 1e-9))
    middle = max(0.0, -2.0 * math.cos(frequency * dt * spacing))
    between = (0.0,) * (spacing - 1)
    raw = (1.0, *between, middle, *between, 1.0)
    return tuple(weight / sum(raw) for weight in raw)


class GentleCommands:
    """Turns wanted forward velocities into commands within the limits.

    The wanted velocity is approached at the greatest acceleration; the command is the weighted mean of the latest
    velocities, so that its acceleration rises and falls over the filter's length.

    Args:
        limits: of the commands. robot: its control step.
    """

    def __init__(self, limits: GentleLimits, robot: RobotSpec = ROBOT) -> None:
        self.limits = limits
        self._step, self._hard = (
            limits.acceleration * robot.control_dt,
            HARD_BRAKING_SHARE * robot.acceleration * robot.control_dt,
        )
        self._ramp = deque([0.0] * len(limits.weights), maxlen=len(limits.weights))

    def command(self, v: float, hard: bool = False) -> float:
        """Return the forward velocity to command, m/s, for the wanted one.

        Args:
            v: the wanted velocity, m/s. hard: brake as hard as the robot can, without an oscillation as before.
        """
        last = self._ramp[0]
        slower = self._hard if hard else self._step
        self._ramp.appendleft(min(max(v, last - slower), last + self._step))
        return sum(weight * speed for weight, speed in zip(self.limits.weights, self._ramp, strict=True))

    @property
    def history(self) -> tuple[float, ...]:
        """The velocities of which the latest command is the mean, oldest first, m/s."""
        return tuple(reversed(self._ramp))

    @property
    def speed(self) -> float:
        """The forward velocity that the commands tend to, m/s."""
        return self._ramp[0]
