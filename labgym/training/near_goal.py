"""Environments with the goal up close as a further entry of the observation."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium import spaces
from stable_baselines3.common.vec_env import VecEnv, VecEnvWrapper

from labgym.errors import OptionError
from labgym.policies.adapters.inputs import NEAR_GOAL_SCALE, near_goal

NEAR_GOAL = "near_goal"
"""Name of the entry."""


class NearGoal(VecEnvWrapper):
    """Environments whose observation has the entry `near_goal`, as `labgym.policies.adapters.inputs`.

    Args:
        venv: environments that observe `goal`.

    Raises:
        OptionError: they do not.
    """

    def __init__(self, venv: VecEnv) -> None:
        space = venv.observation_space
        if not isinstance(space, spaces.Dict) or "goal" not in space.spaces:
            raise OptionError("near_goal needs environments whose observation has the entry goal")
        self.observation_space: spaces.Dict
        entry = spaces.Box(-NEAR_GOAL_SCALE, NEAR_GOAL_SCALE, (3,), np.float32)
        super().__init__(venv, spaces.Dict({**space.spaces, NEAR_GOAL: entry}))

    def reset(self) -> Any:
        """Begin the episodes of all environments."""
        return _extended(self.venv.reset())

    def step_wait(self) -> Any:
        """Carry out the actions."""
        observations, rewards, dones, infos = self.venv.step_wait()
        for info in infos:
            if "terminal_observation" in info:
                info["terminal_observation"] = _extended(info["terminal_observation"])
        return _extended(observations), rewards, dones, infos


def _extended(observation: Any) -> dict[str, Any]:
    return {**observation, NEAR_GOAL: near_goal(observation["goal"])}
