"""How an agent's action becomes commands to the robot."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from gymnasium import spaces

from labgym.counts import check_switch, is_whole
from labgym.envs.parts.protocols import Actions, Command, Robot
from labgym.envs.parts.registry import registered
from labgym.envs.state import State
from labgym.errors import OptionError


@registered("actions")
@dataclass
class VelocityActions(Actions):
    """Target velocities: `Box(-1, 1, (n,), float32)`, one component per axis of the robot, for one control step.

    Attributes:
        stop: whether a further component declares the arrival: above 0 it is STOP, and the robot brakes.
        delay: number of control steps by which the robot obeys later, at rest until then.
    """

    stop: bool = False
    delay: int = 0
    kind: str = field(default="velocity", init=False)

    def __post_init__(self) -> None:
        check_switch("VelocityActions: stop", self.stop)
        if not is_whole(self.delay) or self.delay < 0:
            raise OptionError(f"VelocityActions: delay is {self.delay!r}, expected a whole number of control steps")

    def space(self, robot: Robot) -> spaces.Space[Any]:
        """Return the box."""
        return spaces.Box(-1.0, 1.0, (len(robot.axes) + self.stop,), np.float32)

    def reset(self, state: State, rng: np.random.Generator) -> None:  # noqa: ARG002
        """Begin an episode at rest."""
        rest = state.robot.command([0.0] * len(state.robot.axes))
        self._axes = (*state.robot.axes, "stop") if self.stop else tuple(state.robot.axes)
        self._waiting = deque([rest] * self.delay)
        self._stopped = False

    def commands(self, action: Any, state: State, rng: np.random.Generator) -> Iterable[Command]:  # noqa: ARG002
        """Return one command.

        Raises:
            OptionError: not one finite number per axis.
        """
        values = numbers(action, self._axes)
        if self.stop:
            self._stopped = values.pop() > 0.0
            values = [0.0] * len(values) if self._stopped else values
        command = state.robot.command(values)
        if not self.delay:
            return (command,)
        self._waiting.append(command)
        return (self._waiting.popleft(),)

    def is_stop(self, action: Any) -> bool:  # noqa: ARG002
        """Whether the action was STOP."""
        return self._stopped


def numbers(action: Any, names: tuple[str, ...]) -> list[float]:
    """Return the components of an action.

    Raises:
        OptionError: not one finite number per name.
    """
    try:
        values = np.asarray(action, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        values = np.empty(0)
    components: list[float] = values.tolist() if values.shape == (len(names),) else []
    if not components or not all(map(math.isfinite, components)):
        shown = " ".join(repr(action).split())[:80]
        count = {2: "two", 3: "three"}.get(len(names), str(len(names)))
        raise OptionError(f"action {shown} must be {count} finite numbers in [-1, 1]: {', '.join(names)}")
    return components
