"""The weights of the usual reward."""

from __future__ import annotations

from dataclasses import dataclass

from labgym.envs.parts.protocols import RewardTerm
from labgym.envs.parts.rewards import CollisionTerm, ProgressTerm, SuccessTerm, TimeTerm
from labgym.navigation import Method


@dataclass(frozen=True)
class RewardWeights:
    """Weight of each term of the usual reward.

    Attributes:
        progress: per meter by which the shortest path to the goal became shorter.
        success: once, when the goal is reached.
        collision: per action during which the robot touched something.
        time: per action.
    """

    progress: float = 1.0
    success: float = 10.0
    collision: float = -0.1
    time: float = -0.01

    def terms(self, method: Method = "grid") -> tuple[RewardTerm, ...]:
        """Return the terms.

        Args:
            method: how progress measures the way to the goal.
        """
        return (
            ProgressTerm(self.progress, method),
            SuccessTerm(self.success),
            CollisionTerm(self.collision),
            TimeTerm(self.time),
        )
