"""Reward and ending that depend on the achieved and the desired goal alone, so that goals can be relabeled."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from labgym.envs.checks import positive
from labgym.envs.parts.endings import REST_DISTANCE
from labgym.envs.parts.protocols import Ending, RewardTerm
from labgym.envs.parts.registry import registered
from labgym.envs.state import State, Verdict


def reached(achieved: ArrayLike, desired: ArrayLike, radius: float = REST_DISTANCE) -> NDArray[np.bool_]:
    """Return whether positions are within a radius of goals, shape (...).

    Args:
        achieved, desired: x and y, meters, shape (..., 2), in single precision as in the observation.
    """
    difference = np.asarray(achieved, np.float32) - np.asarray(desired, np.float32)
    near: NDArray[np.bool_] = np.square(difference).sum(axis=-1) <= np.float32(radius * radius)
    return near


@registered("ending", "goal")
class GoalEnding(Ending):
    """Success when the robot is within `radius` meters of the goal, at any speed, by `reached`."""

    radius: float = REST_DISTANCE
    name: str = "goal"

    def __post_init__(self) -> None:
        positive(self, "radius")

    def verdict(self, state: State) -> Verdict | None:
        """Return "success" within the radius."""
        return "success" if reached(state.pose[:2], state.pair.goal[:2], self.radius) else None


@registered("reward term", "goal")
class GoalTerm(RewardTerm):
    """-1 for an action that does not end within `radius` meters of the goal, else 0, by `reached`."""

    weight: float = 1.0
    radius: float = REST_DISTANCE
    name: str = "goal"

    def __post_init__(self) -> None:
        positive(self, "radius")

    def value(self, state: State) -> float:
        """Return -1 or 0."""
        return float(sparse(state.pose[:2], state.pair.goal[:2], self.radius))


def sparse(achieved: ArrayLike, desired: ArrayLike, radius: float = REST_DISTANCE) -> Any:
    """Return the reward of positions for goals: 0 if reached, else -1; float64, shape (...)."""
    return np.where(reached(achieved, desired, radius), 0.0, -1.0)
