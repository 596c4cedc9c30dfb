"""The vector environment as a `VecEnv` of stable-baselines3."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from labgym.envs.vector import vector_env
from labgym.errors import optional_package

with optional_package("stable-baselines3", "the adapter for stable-baselines3", "train"):
    from stable_baselines3.common.vec_env import VecEnv

OF_EACH = {"climb": "climb", "state": "states"}
"""Attributes of single environments, and those of the vector environment that list them."""


class LabVecEnv(VecEnv):
    """Point navigation environments on the planar kernel, or in processes, for stable-baselines3.

        model = PPO("MultiInputPolicy", LabVecEnv(64, split="train"))

    An info is empty while its episode goes on. At the end it holds the info of the last step, `terminal_observation`
    and `TimeLimit.truncated`.

    Args:
        num_envs: number of environments. max_episode_steps: steps after which an episode is truncated.
        options: as of `labgym.envs.vector.vector_env`.
    """

    def __init__(self, num_envs: int, max_episode_steps: int | None = 600, **options: Any) -> None:
        self.envs: Any = vector_env(
            num_envs, autoreset_mode=AutoresetMode.SAME_STEP, max_episode_steps=max_episode_steps, **options
        )
        self.render_mode = None
        super().__init__(num_envs, self.envs.single_observation_space, self.envs.single_action_space)
        self._actions: NDArray[np.float32] | None = None

    def reset(self) -> dict[str, NDArray[np.float32]]:
        """Begin the episodes of all environments, from the seeds of `seed` if it was called."""
        seeds = None if all(each is None for each in self._seeds) else self._seeds
        observations: dict[str, NDArray[np.float32]]
        observations, infos = self.envs.reset(seed=seeds)
        self.reset_infos = [_row(infos, row) for row in range(self.num_envs)]
        self._reset_seeds()
        self._reset_options()
        return observations

    def step_async(self, actions: NDArray[np.float32]) -> None:
        """Take actions (n, 2)."""
        self._actions = actions

    def step_wait(self) -> Any:
        """Carry out the actions; environments that ended are reset."""
        observations, rewards, terminated, truncated, infos = self.envs.step(np.asarray(self._actions))
        dones = terminated | truncated
        each: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        for row in np.flatnonzero(dones).tolist():
            each[row] = {
                **_row(infos["final_info"], row),
                "terminal_observation": infos["final_obs"][row],
                "TimeLimit.truncated": bool(truncated[row] and not terminated[row]),
            }
            self.reset_infos[row] = _row(infos, row)
        return observations, rewards.astype(np.float32), dones, each

    def close(self) -> None:
        """Close all environments."""
        self.envs.close()

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """Return an attribute of the vector environment, once for each index; of `climb` and `state`, that of each."""
        if attr_name in OF_EACH:
            values = getattr(self.envs, OF_EACH[attr_name])
            return [values[row] for row in self._rows(indices)]
        return [getattr(self.envs, attr_name)] * len(self._rows(indices))

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Set an attribute of the vector environment, which all environments share."""
        if len(self._rows(indices)) != self.num_envs:
            raise AttributeError(f"{attr_name} belongs to all environments: it cannot be set for some")
        setattr(self.envs, attr_name, value)

    def env_method(self, method_name: str, *args: Any, indices: Any = None, **kwargs: Any) -> list[Any]:
        """Call a method of the vector environment, or `resume_climb` of each; return a result for each index."""
        if method_name == "resume_climb":
            return [self.envs.resume_climb(row, *args, **kwargs) for row in self._rows(indices)]
        return [getattr(self.envs, method_name)(*args, **kwargs)] * len(self._rows(indices))

    def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> list[bool]:  # noqa: ARG002
        """Whether environments are wrapped: none is."""
        return [False] * len(self._rows(indices))

    def _rows(self, indices: Any) -> Sequence[int]:
        return list(indices) if isinstance(indices, Iterable) else list(self._get_indices(indices))


def _row(infos: dict[str, Any], row: int) -> dict[str, Any]:
    """Return the info of one environment from those of all."""
    return {
        name: _row(column, row) if isinstance(column, dict) else column[row]
        for name, column in infos.items()
        if not name.startswith("_") and name not in ("final_obs", "final_info")
    }
