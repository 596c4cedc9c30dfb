"""Random actions: the level of chance."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from labgym.policies.policy import EpisodeStart, GoalKind, Observation, Policy


class RandomPolicy(Policy):
    """Draws each action uniformly from the action space."""

    name: ClassVar[str] = "random"
    goal_kinds: ClassVar[tuple[GoalKind, ...]] = ("point", "image", "none")

    def __init__(self) -> None:
        self._rng = np.random.default_rng(0)

    def reset(self, episode: EpisodeStart) -> None:
        """Store the episode's random generator."""
        self._rng = episode.rng

    def act(self, observation: Observation) -> NDArray[np.floating[Any]]:  # noqa: ARG002
        """Return two independent draws from [-1, 1)."""
        return self._rng.uniform(-1.0, 1.0, 2)
