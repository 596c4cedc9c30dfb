"""The training environment: the benchmark's, on training drives, with the network's input as observation."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from labgym.envs import LabPointNavEnv, RewardWeights
from labgym.envs.episode import Episode
from labgym.envs.robot import ROBOT
from labgym.envs.tasks import Task
from labgym.errors import OptionError
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
        self._env = _DrivenEnv(drives, sensor, scaled)
        self.action_space = self._env.action_space
        self._memory = DriveMemory(sensor)
        self._horizon, self._steps = horizon, 0
        self._task: Task | None = None

    @property
    def task(self) -> Task:
        """The current drive.

        Raises:
            OptionError: `reset` was not called.
        """
        if self._task is None:
            raise OptionError("the environment has no drive yet; call reset() first")
        return self._task

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Vector, dict[str, Any]]:
        """Begin the next drive."""
        super().reset(seed=seed)
        observation, info = self._env.reset(seed=seed, options=options)
        self._task = self.drives.latest
        self._memory.reset()
        self._steps = 0
        return self._memory.vector(observation, info["pose"]), info

    def step(self, action: NDArray[np.float32]) -> tuple[Vector, float, bool, bool, dict[str, Any]]:
        """Drive for 0.1 s."""
        observation, reward, terminated, _, info = self._env.step(action)
        self._steps += 1
        truncated = not terminated and self._steps >= self._horizon
        return self._memory.vector(observation, info["pose"]), reward, terminated, truncated, info

    def close(self) -> None:
        """Close the wrapped environment."""
        self._env.close()


class _DrivenEnv(LabPointNavEnv):
    """The benchmark's environment on training drives; its info holds only what training reads."""

    def __init__(self, drives: TrainingDrives, sensor: Sensor, weights: RewardWeights) -> None:
        super().__init__(split="train", observation=sensor, weights=weights)
        self._tasks = drives

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        gym.Env.reset(self, seed=seed)
        self._episode = Episode(self._tasks.draw(self.np_random, options or {}, fresh=seed is not None))
        return self._observe(self._episode), {"pose": self._episode.simulation.pose}

    def step(self, action: NDArray[np.float32]) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        episode = self._running()
        episode.drive(*ROBOT.twist(float(action[0]), float(action[1])))
        terms = self._weights.terms(episode.progress, episode.success, episode.collision)
        info = {"pose": episode.simulation.pose, "success": episode.success, "collision": episode.collision}
        return self._observe(episode), sum(terms.values()), episode.success, False, info
