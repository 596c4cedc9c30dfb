"""Stand still: the level below which no score may lie."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from labgym.policies.policy import EpisodeStart, Observation, Policy


class StillPolicy(Policy):
    """Never moves and never stops the drive."""

    name: ClassVar[str] = "still"

    def reset(self, episode: EpisodeStart) -> None:
        """Begin an episode."""

    def act(self, observation: Observation) -> NDArray[np.floating[Any]]:  # noqa: ARG002
        """Stay."""
        return np.zeros(2)
