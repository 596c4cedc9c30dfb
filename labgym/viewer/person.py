"""A person as the driver of an episode."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from labgym.policies import EpisodeStart
from labgym.policies.policy import Observation, Policy
from labgym.viewer.console import Console


class Person(Policy):
    """Drives by the keys that a page reports.

    The page shows the whole laboratory, the shortest path and the sensors: a person has the map.

    Args:
        console: receives the keys.
    """

    name = "person"
    privileged = True

    def __init__(self, console: Console) -> None:
        self._console = console

    def reset(self, episode: EpisodeStart) -> None:
        """Do nothing: a person sees the new episode on the page."""

    def act(self, observation: Observation) -> NDArray[np.float32]:  # noqa: ARG002
        """Return the action of the keys that are down."""
        return np.array(self._console.action, dtype=np.float32)
