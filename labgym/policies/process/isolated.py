"""A policy in a separate process as a `Policy`, for those who call one: the server of `labgym serve`."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from labgym.policies.policy import EpisodeStart, Observation, Policy
from labgym.policies.process.proxy import PolicyProcess
from labgym.policies.process.source import PolicySource


class IsolatedPolicy(Policy):
    """Calls a policy in its process, a foreign one in its box; the process lasts over episodes.

    Ask `stop` before `act`, with the same observation.

    Args:
        source: the policy.

    Raises:
        LabgymError: the policy cannot be loaded.
    """

    def __init__(self, source: PolicySource) -> None:
        self._process = process = PolicyProcess(source)
        self.name, self.observation = process.name, process.observation  # type: ignore[misc] # the process decides
        self.privileged, self.foresees = process.privileged, process.foresees  # type: ignore[misc]
        self.goal_kinds = process.goal_kinds  # type: ignore[misc]
        self._action: NDArray[np.float32] | None = None

    @property
    def box(self) -> str:
        """Level of the box."""
        return self._process.box

    def reset(self, episode: EpisodeStart) -> None:
        """Begin an episode in the same process."""
        self._process.continue_with(episode)

    def stop(self, observation: Observation) -> bool:
        """Return whether the policy stops; otherwise the action is there."""
        self._action = self._process.decide(observation)
        return self._action is None

    def act(self, observation: Observation) -> NDArray[np.floating[Any]]:
        """Return the action of the last decision, or that for an observation if there was none."""
        action, self._action = self._action, None
        return self._process.act(observation) if action is None else action

    def planned_path(self) -> NDArray[np.float64] | None:
        """Return the path that the last action follows."""
        return self._process.planned_path()

    def close(self) -> None:
        """End the process."""
        self._process.close()
