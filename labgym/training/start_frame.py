"""Goal environments in the frame of the episode's start, in which a robot can know its own pose."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

Observation = dict[str, NDArray[np.float32]]


class StartFrame(gym.ObservationWrapper[Observation, NDArray[np.float32], Observation]):
    """`LabFloorNavGoal-v0` with poses and positions in the start frame: origin at the robot's start, x ahead, y left.

    `LabFloorNavGoal-v0` gives poses in the room frame, which a robot without a map does not know. In the start frame
    they are what a `Policy` receives: odometry and goal. Rewards depend on distances alone and stay the same.

    Args:
        env: an environment whose `observation` begins with x, y, cosine and sine of the yaw.
    """

    def __init__(self, env: gym.Env[Any, Any]) -> None:
        super().__init__(env)
        self._place = np.zeros(2)
        self._axes = np.eye(2)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin an episode; its first pose is the frame."""
        observation, info = self.env.reset(seed=seed, options=options)
        x, y, cosine, sine = observation["observation"][:4].astype(np.float64).tolist()
        self._place, self._axes = np.array([x, y]), np.array([[cosine, sine], [-sine, cosine]])
        return self.observation(observation), info

    def observation(self, observation: Observation) -> Observation:
        """Return an observation in the start frame."""
        joint = observation["observation"].astype(np.float32)
        joint[:2], joint[2:4] = self._local(joint[:2]), self._axes @ joint[2:4]
        return {
            "observation": joint,
            "achieved_goal": self._local(observation["achieved_goal"]),
            "desired_goal": self._local(observation["desired_goal"]),
        }

    def _local(self, position: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return a position (2,) in the start frame."""
        return (self._axes @ (position - self._place)).astype(np.float32)
