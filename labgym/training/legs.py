"""Learning in legs, each with new episodes and generators, so that a run resumes from any leg to the same end."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from stable_baselines3 import HerReplayBuffer
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.on_policy_algorithm import OnPolicyAlgorithm
from stable_baselines3.common.vec_env import VecEnv

from labgym.policies.learned.checkpoint import load_checkpoint, save_checkpoint
from labgym.training.scores import ScoreCallback
from labgym.training.snapshot import model_parts

CHECKPOINT = "checkpoint.pt"


ROLLOUTS, EPISODES = 8, 100
"""The log gets an entry after this many rollouts of PPO, or episodes of an algorithm with a replay buffer."""


def learn(
    model: BaseAlgorithm, scores: ScoreCallback, steps: int, leg: int, seed: int, out: Path, climbs: bool = False
) -> None:
    """Train a model up to a number of control steps, from the checkpoint in a folder if there is one.

    A leg depends on the state at its beginning, the seed and its number alone: on one machine with one number of
    threads, an interrupted run ends with the bits of an uninterrupted one.

    Args:
        model: the model, with its environments.
        scores: evaluates the model at the end of each leg.
        steps: control steps of the whole training, a multiple of `leg`.
        leg: control steps of a leg, a multiple of the rollouts.
        seed: random seed.
        out: folder of the checkpoint.
        climbs: whether the environments have a curriculum, whose rungs the checkpoint keeps.

    Raises:
        DocumentError: the checkpoint is damaged or of another model.
    """
    parts, path = model_parts(model), out / CHECKPOINT

    def end_leg() -> None:
        _end_episodes(model)
        record = {
            "steps": model.num_timesteps,
            "updates": model._n_updates,
            "best": None if scores.best is None else list(scores.best),
            "records": scores.records,
            "climbs": _environments(model).get_attr("climb") if climbs else [],
        }
        save_checkpoint(path, parts, record)
        _begin_leg(model, seed, model.num_timesteps // leg)

    if path.exists():
        record = load_checkpoint(path, parts, _is_record)
        model.num_timesteps, model._n_updates = record["steps"], record["updates"]
        scores.best, scores.records = record["best"] and tuple(record["best"]), record["records"]
        for index, climb in enumerate(record["climbs"]):
            _environments(model).env_method("resume_climb", climb, indices=index)
    if model.num_timesteps >= steps:
        return
    _begin_leg(model, seed, model.num_timesteps // leg)
    callbacks = [scores, LegCallback(leg, end_leg)]
    interval = ROLLOUTS if isinstance(model, OnPolicyAlgorithm) else EPISODES
    model.learn(steps - model.num_timesteps, callbacks, interval, reset_num_timesteps=False)


class LegCallback(BaseCallback):
    """Calls a function at the end of each leg but the last, before the next rollout.

    Args:
        leg: control steps of a leg.
        end_leg: the function.
    """

    def __init__(self, leg: int, end_leg: Callable[[], None]) -> None:
        super().__init__()
        self._leg, self._end_leg = leg, end_leg
        self._ended = 0

    def _on_training_start(self) -> None:
        self._ended = self.model.num_timesteps // self._leg

    def _on_rollout_start(self) -> None:
        legs = self.model.num_timesteps // self._leg
        if legs > self._ended:
            self._ended = legs
            self._end_leg()

    def _on_step(self) -> bool:
        return True


def _environments(model: BaseAlgorithm) -> VecEnv:
    """Return the environments of a model."""
    environments = model.get_env()
    assert environments is not None
    return environments


def _begin_leg(model: BaseAlgorithm, seed: int, leg: int) -> None:
    """Seed all generators and begin new episodes."""
    environments: Any = model.env
    model.set_random_seed(int(np.random.SeedSequence([seed, leg]).generate_state(1)[0]) % 2**31)
    model._last_obs = environments.reset()
    model._last_episode_starts = np.ones(environments.num_envs, dtype=np.bool_)
    for state in getattr(model, "_last_lstm_states", None) or ():
        for tensor in state:
            tensor.zero_()
    normalize = model.get_vec_normalize_env()
    if normalize is not None:
        model._last_original_obs = normalize.get_original_obs()


def _end_episodes(model: BaseAlgorithm) -> None:
    """Mark the unfinished episodes in a replay buffer as truncated: the next leg does not continue them."""
    buffer = getattr(model, "replay_buffer", None)
    if isinstance(buffer, HerReplayBuffer):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)
            buffer.truncate_last_trajectory()


def _is_record(record: Any) -> bool:
    """Return whether a checkpoint's record is one of `learn`."""
    return (
        isinstance(record, dict)
        and all(type(record.get(name)) is int and record[name] >= 0 for name in ("steps", "updates"))
        and isinstance(record.get("records"), list)
        and isinstance(record.get("climbs"), list)
        and (record.get("best") is None or (isinstance(record["best"], list) and len(record["best"]) == 2))
    )
