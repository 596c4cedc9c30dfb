"""How an agent's action becomes commands to the robot."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from gymnasium import spaces

from labgym.envs.parts.protocols import Actions, Command, Robot
from labgym.envs.state import State
from labgym.errors import OptionError


@dataclass(frozen=True)
class VelocityActions(Actions):
    """Target velocities: `Box(-1, 1, (n,), float32)`, one component per axis of the robot, for one control step."""

    kind: str = field(default="velocity", init=False)

    def space(self, robot: Robot) -> spaces.Space[Any]:
        """Return the box."""
        return spaces.Box(-1.0, 1.0, (len(robot.axes),), np.float32)

    def commands(self, action: Any, state: State, rng: np.random.Generator) -> Iterable[Command]:  # noqa: ARG002
        """Return one command.

        Raises:
            OptionError: not one finite number per axis.
        """
        return (state.robot.command(numbers(action, state.robot.axes)),)


def numbers(action: Any, names: tuple[str, ...]) -> list[float]:
    """Return the components of an action.

    Raises:
        OptionError: not one finite number per name.
    """
    try:
        values = np.asarray(action, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        values = np.empty(0)
    if values.shape != (len(names),) or not np.isfinite(values).all():
        shown = " ".join(repr(action).split())[:80]
        count = {2: "two", 3: "three"}.get(len(names), str(len(names)))
        raise OptionError(f"action {shown} must be {count} finite numbers in [-1, 1]: {', '.join(names)}")
    return [float(value) for value in values]
