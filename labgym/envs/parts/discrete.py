"""Discrete actions: stop, a step forward, a turn to either side."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from gymnasium import spaces

from labgym.counts import is_whole
from labgym.envs.checks import positive
from labgym.envs.parts import actuation  # noqa: F401 - errors may be named by their kind
from labgym.envs.parts.protocols import Actions, ActuationNoise, Command, Robot
from labgym.envs.parts.registry import part_of, registered
from labgym.envs.state import State
from labgym.errors import OptionError
from labgym.geometry import wrap_angle

STOP, FORWARD, LEFT, RIGHT = range(4)
BRAKING = 0.6
"""Share of the robot's acceleration with which an action brakes."""
SLOWEST = 0.25
"""Time constant of the last centimeters, seconds."""
DISTANCE_ERROR, ANGLE_ERROR = 0.002, math.radians(0.1)
"""An action ends within these of its amount, meters and radians."""
LONGEST = 4.0
"""Seconds after which an action ends in any case, as against a wall."""


@registered("actions")
@dataclass(frozen=True)
class DiscreteActions(Actions):
    """`Discrete(4)`, in the order of Habitat: 0 STOP, 1 forward, 2 turn left, 3 turn right.

    The robot carries out an action in the simulation, by velocity commands over several control steps, and ends it at
    rest within 2 mm or 0.1 degrees of its amount; an obstacle stops it earlier. STOP takes one control step.

    Attributes:
        forward: meters. turn: degrees.
        noise: error of the amounts; None for exact ones.
    """

    forward: float = 0.25
    turn: float = 15.0
    noise: ActuationNoise | None = None
    kind: str = field(default="discrete", init=False)

    def __post_init__(self) -> None:
        positive(self, "forward", "turn")
        if self.noise is not None:
            object.__setattr__(self, "noise", part_of(self.noise, "actuation noise"))

    def space(self, robot: Robot) -> spaces.Space[Any]:
        """Return the four actions.

        Raises:
            OptionError: the robot does not turn on the spot by "forward" and "turn".
        """
        if robot.axes != ("forward", "turn"):
            raise OptionError(f"discrete actions need a robot with the axes forward and turn, got {robot.axes}")
        return spaces.Discrete(4)

    def commands(self, action: Any, state: State, rng: np.random.Generator) -> Iterator[Command]:
        """Yield the commands of an action.

        Raises:
            OptionError: not 0, 1, 2 or 3.
        """
        return self._motions(checked(action), state, rng)

    def _motions(self, action: int, state: State, rng: np.random.Generator) -> Iterator[Command]:
        if action == STOP:
            yield (0.0, 0.0)
            return
        ahead, turn = (self.forward, 0.0) if action == FORWARD else (0.0, math.radians(self.turn) * (5 - 2 * action))
        if self.noise is not None:
            more, turned = self.noise.errors(ahead, turn, rng)
            ahead, turn = ahead + more, turn + turned
        if ahead:
            yield from _drive(ahead, state)
        if turn:
            yield from _turn(turn, state)

    def is_stop(self, action: Any) -> bool:
        """Whether the action is 0."""
        return checked(action) == STOP


def checked(action: Any) -> int:
    """Return a discrete action.

    Raises:
        OptionError: not 0, 1, 2 or 3.
    """
    whole = is_whole(action) or (isinstance(action, np.ndarray) and action.ndim == 0)
    if not whole or action not in range(4):
        shown = " ".join(repr(action).split())[:80]
        raise OptionError(f"action {shown} must be 0 (stop), 1 (forward), 2 (left) or 3 (right)")
    return int(action)


def _drive(distance: float, state: State) -> Iterator[Command]:
    """Yield commands that move the robot along its heading, and let it rest."""
    (x, y, yaw), size, until = state.pose, state.robot.size, state.time + LONGEST
    while state.time < until - 1e-9:
        left = distance - math.cos(yaw) * (state.pose[0] - x) - math.sin(yaw) * (state.pose[1] - y)
        if abs(left) < DISTANCE_ERROR and abs(state.velocity[0]) < 0.01:
            break
        limit = size.v_max if left > 0.0 else -size.v_min
        yield (math.copysign(_speed(abs(left), limit, size.acceleration), left), 0.0)
    yield (0.0, 0.0)


def _turn(angle: float, state: State) -> Iterator[Command]:
    """Yield commands that turn the robot on the spot, and let it rest."""
    yaw, size, until = state.pose[2], state.robot.size, state.time + LONGEST
    while state.time < until - 1e-9:
        left = wrap_angle(yaw + angle - state.pose[2])
        if abs(left) < ANGLE_ERROR and abs(state.velocity[1]) < 0.02:
            break
        yield (0.0, math.copysign(_speed(abs(left), size.w_max, size.turn_acceleration), left))
    yield (0.0, 0.0)


def _speed(left: float, limit: float, acceleration: float) -> float:
    """Return the speed at which the robot can still brake within a way."""
    return min(limit, math.sqrt(2.0 * BRAKING * acceleration * left), left / SLOWEST)
