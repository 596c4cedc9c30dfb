"""The reward of point navigation, term by term."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class RewardWeights:
    """Weight of each term of the reward.

    Attributes:
        progress: per meter by which the shortest path to the goal became shorter.
        success: once, when the goal is reached.
        collision: per control step in which the robot touched something.
        time: per control step.
    """

    progress: float = 1.0
    success: float = 10.0
    collision: float = -0.1
    time: float = -0.01

    def terms(self, progress: float, success: bool, collision: bool, steps: int = 1) -> dict[str, float]:
        """Return the weighted terms of one control step; their sum is the reward.

        Args:
            progress: decrease of the distance to go, meters.
            success: whether the goal was reached in this step.
            collision: whether the robot touched something in this step.
            steps: number of control steps: 1, or 0 for a reset, whose terms are all zero.
        """
        return {
            "progress": self.progress * progress,
            "success": self.success * success,
            "collision": self.collision * collision,
            "time": self.time * steps,
        }
