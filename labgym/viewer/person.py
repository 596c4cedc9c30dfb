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


class LabNavPerson(Person):
    """Drives an episode of LabNav, and gives STOP.

    The page shows the floor as it is, people, glass and the true pose, so that rows are of the privileged track.

    Args:
        console: receives the keys.
    """

    foresees = True

    def reset(self, episode: EpisodeStart) -> None:  # noqa: ARG002
        """Forget a STOP of the drive before."""
        self._console.take_stop()

    def stop(self, observation: Observation) -> bool:  # noqa: ARG002
        """Return whether STOP was given since the last step."""
        return self._console.take_stop()
