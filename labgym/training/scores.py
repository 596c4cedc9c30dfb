"""Success rate and SPL while training."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import EvalCallback
from stable_baselines3.common.vec_env import VecEnv


class ScoreCallback(EvalCallback):
    """An `EvalCallback` of stable-baselines3 that also logs SPL, and compares models by success rate and SPL.

    The environments need the measures `labgym.training.environments.MEASURES`. They are seeded before each evaluation,
    so that all drive the same episodes. `eval/spl` is the mean over episodes of success times
    L* / max(L*, length driven) (Anderson et al. 2018); the other entries of the log are those of `EvalCallback`.

    Args:
        eval_env: the environments.
        on_best: called with the model when an evaluation has a higher success rate, or the same and a higher SPL.
        seed: random seed of the episodes.
        options: as of `EvalCallback`. With its `best_model_save_path`, models are compared by their mean reward.

    Attributes:
        best: highest (success rate, SPL) so far; None before the first evaluation.
        records: one for each evaluation, with the keys `steps`, `success_rate`, `spl` and `mean_reward`.
    """

    def __init__(
        self,
        eval_env: VecEnv,
        on_best: Callable[[BaseAlgorithm], object] | None = None,
        seed: int = 0,
        **options: Any,
    ) -> None:
        super().__init__(eval_env, **options)
        self.best: tuple[float, float] | None = None
        self.records: list[dict[str, float]] = []
        self._on_best, self._seed = on_best, seed
        self._lengths: list[float] = []

    def _on_step(self) -> bool:
        due = self.eval_freq > 0 and self.n_calls % self.eval_freq == 0
        if due:
            self._lengths = []
            self.eval_env.seed(self._seed)
        goes_on = super()._on_step()
        if due and self._lengths:
            score = float(np.mean(self._is_success_buffer)), float(np.mean(self._lengths))
            self.records.append(
                {
                    "steps": self.num_timesteps,
                    "success_rate": score[0],
                    "spl": score[1],
                    "mean_reward": self.last_mean_reward,
                }
            )
            if self.best is None or score > self.best:
                self.best = score
                if self._on_best is not None:
                    self._on_best(self.model)
        return goes_on

    def _log_success_callback(self, locals_: dict[str, Any], globals_: dict[str, Any]) -> None:
        """Record an episode that ended; `EvalCallback` writes the log after the last one."""
        super()._log_success_callback(locals_, globals_)
        if locals_["done"]:
            self._lengths.append(success_by_length(locals_["info"]))
            self.logger.record("eval/spl", float(np.mean(self._lengths)))


def success_by_length(info: dict[str, Any]) -> float:
    """Return success weighted by path length of an episode, in [0, 1], from the info of its last step."""
    shortest, driven = float(info["shortest_path_length"]), float(info["path_length"])
    if not info["is_success"] or not math.isfinite(shortest):
        return 0.0
    return shortest / driven if driven > shortest else 1.0
