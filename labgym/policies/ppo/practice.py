"""The training environment: the benchmark's, on training drives, with the network's input as observation."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from labgym.envs import LabPointNavEnv, RewardWeights
from labgym.envs.tasks import Task
from labgym.policies.ppo.drives import TrainingDrives
from labgym.policies.ppo.inputs import SIZES, DriveMemory, Sensor

Vector = NDArray[np.float32]

REWARD_SCALE = 0.2
"""Factor on the environment's reward that makes returns of order one."""


class PracticeEnv(gym.Env[Vector, NDArray[np.float32]]):
    """`LabPointNav-v0` with a sensor, on drives of a pool; the observation is the vector of `DriveMemory`.

    The reward is the environment's, scaled; collisions cost `caution` times as much. An episode is truncated after
    `horizon` steps.

    Attributes:
        drives: source of the drives; environments of a process may share it only if they are stepped in turn.
    """

    def __init__(
        self, drives: TrainingDrives, sensor: Sensor = "lidar", horizon: int = 400, caution: float = 2.0
    ) -> None:
        usual = RewardWeights()
        scaled = RewardWeights(
            progress=REWARD_SCALE * usual.progress,
            success=REWARD_SCALE * usual.success,
            collision=REWARD_SCALE * caution * usual.collision,
            time=REWARD_SCALE * usual.time,
        )
        self.drives = drives
        self.observation_space = spaces.Box(-np.inf, np.inf, (SIZES[sensor],), np.float32)
        self._env = LabPointNavEnv(tasks=drives, observation=sensor, weights=scaled, measures=())
        self.action_space = self._env.action_space
        self._memory = DriveMemory(sensor)
        self._horizon, self._steps = horizon, 0

    @property
    def task(self) -> Task:
        """The current drive.

        Raises:
            ResetNeeded: `reset` was not called.
        """
        return self._env.state.task

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Vector, dict[str, Any]]:
        """Begin the next drive."""
        super().reset(seed=seed)
        observation, _ = self._env.reset(seed=seed, options=options)
        self._memory.reset()
        self._steps = 0
        pose = self._env.state.pose
        return self._memory.vector(observation, pose), {"pose": pose}

    def step(self, action: NDArray[np.float32]) -> tuple[Vector, float, bool, bool, dict[str, Any]]:
        """Drive for 0.1 s."""
        observation, reward, terminated, _, _ = self._env.step(action)
        self._steps += 1
        truncated = not terminated and self._steps >= self._horizon
        state = self._env.state
        info = {"pose": state.pose, "success": state.success, "collision": state.collision}
        return self._memory.vector(observation, state.pose), reward, terminated, truncated, info

    def close(self) -> None:
        """Close the wrapped environment."""
        self._env.close()
