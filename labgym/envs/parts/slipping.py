"""Wheels that do not carry out commands exactly."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from labgym.envs.checks import positive
from labgym.envs.parts.actions import VelocityActions
from labgym.envs.parts.protocols import Command, Robot
from labgym.envs.parts.registry import registered
from labgym.envs.state import State
from labgym.errors import OptionError


@registered("actions")
@dataclass
class SlippingActions(VelocityActions):
    """Target velocities that the wheels carry out with errors, so that commands do not tell where the robot is.

    For each episode, factors on the forward velocity and on the turn rate are drawn from N(1, scale), and a veer, which
    turns the robot as it drives, from N(0, veer).

    Attributes:
        scale: standard deviation of the factors. veer: of the veer, degrees per meter.
    """

    scale: float = 0.03
    veer: float = 2.0
    kind: str = field(default="slipping", init=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        positive(self, "scale", "veer", zero=True)

    def space(self, robot: Robot) -> Any:
        """Return the box.

        Raises:
            OptionError: the robot has other axes than forward and turn.
        """
        if tuple(robot.axes) != ("forward", "turn"):
            raise OptionError(
                f"SlippingActions: the robot has the axes {', '.join(robot.axes)}, expected forward, turn"
            )
        return super().space(robot)

    def reset(self, state: State, rng: np.random.Generator) -> None:
        """Begin an episode at rest, with new errors."""
        super().reset(state, rng)
        drawn = rng.standard_normal(3).tolist()
        self._forward, self._turn = (1.0 + self.scale * each for each in drawn[:2])
        self._veer = math.radians(self.veer) * drawn[2]

    @property
    def errors(self) -> tuple[float, float, float]:
        """The errors of the episode: factors on forward velocity and turn rate, and the veer, radians per meter."""
        return self._forward, self._turn, self._veer

    def commands(self, action: Any, state: State, rng: np.random.Generator) -> Iterable[Command]:
        """Return one command, with the errors of the episode.

        Raises:
            OptionError: not one finite number per axis.
        """
        return [(v * self._forward, w * self._turn + v * self._veer) for v, w in super().commands(action, state, rng)]
