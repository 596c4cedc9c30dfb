"""A path planned on the map and driven without any sensor."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from labgym.navigation import Pose
from labgym.policies.astar import AStarPolicy
from labgym.policies.policy import EpisodeStart, Observation
from labgym.policies.reckoning import DeadReckoning


class BlindPolicy(AStarPolicy):
    """Plans as `astar` and follows the path by dead reckoning of its commands. Privileged.

    It reads no sensor, not even the odometry. Its estimate of the pose is that of a base that reaches the commanded
    velocities at its greatest accelerations.
    """

    name: ClassVar[str] = "blind"

    def reset(self, episode: EpisodeStart) -> None:
        """Plan from the true start to the goal."""
        super().reset(episode)
        self._reckoning = DeadReckoning(episode.robot)

    def act(self, observation: Observation) -> NDArray[np.floating[Any]]:
        """Follow the path."""
        action = super().act({**observation, "velocity": np.array(self._reckoning.velocity)})
        self._reckoning.drive(action)
        return action

    def stop(self, observation: Observation) -> bool:
        """Whether the robot rests at the goal by dead reckoning."""
        return super().stop({**observation, "velocity": np.array(self._reckoning.velocity)})

    def estimate(self, observation: Observation) -> Pose:  # noqa: ARG002
        """Return the pose by dead reckoning."""
        return self._reckoning.pose
