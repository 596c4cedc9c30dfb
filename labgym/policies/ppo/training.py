"""Training, from the layouts to the weights; it goes on from its last checkpoint and may be stopped at any time."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.utils import FloatSchedule, set_random_seed
from tqdm import tqdm

from labgym.errors import OptionError
from labgym.layouts import Layout
from labgym.policies.policy import Policy
from labgym.policies.ppo.cloning import clone_expert
from labgym.policies.ppo.drives import TrainingDrives
from labgym.policies.ppo.learner import actor_of, make_environments, make_learner
from labgym.policies.ppo.options import TrainingOptions
from labgym.policies.ppo.policy import DRIVERS
from labgym.policies.ppo.pool import layout_pool
from labgym.policies.ppo.progress import Progress
from labgym.policies.ppo.weights import save_actor

Judge = Callable[[Policy], float]
"""Says what a policy is worth on the validation split: its success rate."""


def train(
    options: TrainingOptions, out: Path, judge: Judge | None = None, layouts: tuple[Layout, ...] | None = None
) -> Path:
    """Train, or go on with, the run in a folder; return the folder of the best weights.

    Equal options give equal weights, also when the run was stopped and went on, on one machine with one number of
    threads.

    Args:
        options: of the run.
        out: its folder: `options.json`, `progress.json`, the checkpoint, `last/` and `best/` with weights.
        judge: of the validation split; without one the last weights are the best.
        layouts: to train in; None takes the pool of the options, kept in the folder beside `out`.

    Raises:
        OptionError: the folder holds a run with other options.
    """
    _claim(out, options)
    pool = layouts or layout_pool(out.parent / "layouts", options.layouts, options.seed)
    drives = TrainingDrives(pool, options.seed)
    environments = make_environments(drives, options)
    progress = Progress.load(out / "progress.json") if (out / "progress.json").exists() else None
    if progress is None:
        set_random_seed(options.seed)
        learner = make_learner(environments, options)
        records = clone_expert(learner, environments, options)
        progress = Progress(records=tuple({"kind": "warm start", **record} for record in records))
        _checkpoint(learner, progress, out)
    learner = PPO.load(_checkpoint_path(out, progress), env=environments, device="cpu")
    if progress.records and progress.records[-1]["kind"] == "warm start":
        progress = _judged(learner, progress, judge, options, out)
        _checkpoint(learner, progress, out)
    bar = tqdm(desc="ppo", total=options.steps, initial=learner.num_timesteps, unit="step", mininterval=10.0)
    while learner.num_timesteps < options.steps:
        begun = time.perf_counter()
        record = _leg(learner, drives, options, progress.legs)
        record["seconds"] = time.perf_counter() - begun
        progress = progress.model_copy(update={"legs": progress.legs + 1, "records": (*progress.records, record)})
        last = learner.num_timesteps >= options.steps
        if last or progress.legs % options.evaluate_every == 0:
            progress = _judged(learner, progress, judge, options, out)
        _checkpoint(learner, progress, out)
        bar.update(learner.num_timesteps - bar.n)
        bar.set_postfix(training=record["success"], validation=progress.best)
    bar.close()
    return out / "best"


def _leg(learner: PPO, drives: TrainingDrives, options: TrainingOptions, leg: int) -> dict[str, Any]:
    """Train for some updates on new episodes; the outcome depends on the weights, the options and the leg alone."""
    done = learner.num_timesteps / options.steps
    drives.farthest = options.nearest + (options.farthest - options.nearest) * min(1.0, 3.0 * done)
    rate = options.rate * (1.0 - 0.9 * min(1.0, done))
    learner.lr_schedule = FloatSchedule(rate)
    seed = int(np.random.SeedSequence([options.seed, leg]).generate_state(1)[0])
    learner.set_random_seed(seed % 2**31)
    learner._last_obs = None
    outcomes = Outcomes()
    learner.learn(options.leg * options.rollout * options.environments, outcomes, reset_num_timesteps=False)
    return {"kind": "leg", "steps": learner.num_timesteps, "rate": rate, **outcomes.means()}


class Outcomes(BaseCallback):
    """Notes how the episodes of a leg ended."""

    def __init__(self) -> None:
        super().__init__()
        self._ended: list[bool] = []
        self._touching: list[bool] = []

    def _on_step(self) -> bool:
        for done, info in zip(self.locals["dones"], self.locals["infos"], strict=True):
            self._touching.append(bool(info["collision"]))
            if done:
                self._ended.append(bool(info["success"]))
        return True

    def means(self) -> dict[str, Any]:
        """Return how many episodes ended, the share that succeeded, and the share of steps in contact."""
        return {
            "episodes": len(self._ended),
            "success": float(np.mean(self._ended)) if self._ended else None,
            "touching": float(np.mean(self._touching)),
        }


def _judged(learner: PPO, progress: Progress, judge: Judge | None, options: TrainingOptions, out: Path) -> Progress:
    """Score the weights on validation and note it; keep them as the best where they are and PPO had a part in them."""
    actor = actor_of(learner, options.observation)
    save_actor(actor, out / "last")
    score = None if judge is None else judge(DRIVERS[options.observation](actor=actor))
    record = {"kind": "validation", "steps": learner.num_timesteps, "success": score}
    best = progress.best
    if learner.num_timesteps > 0 and (score is None or best is None or score >= best):
        save_actor(actor, out / "best")
        best = score
    return progress.model_copy(update={"best": best, "records": (*progress.records, record)})


def _claim(out: Path, options: TrainingOptions) -> None:
    """Write the options into the folder, or hold them against those that are there; more steps may be asked for."""
    path = out / "options.json"
    if path.exists():
        before = TrainingOptions.load(path)
        other = [name for name in TrainingOptions.model_fields if getattr(before, name) != getattr(options, name)]
        if other and other != ["steps"]:
            raise OptionError(f"{out} holds a run with another {', '.join(other)}; choose another folder or remove it")
    options.save(path)


def _checkpoint(learner: PPO, progress: Progress, out: Path) -> None:
    """Write the learner with its optimiser, then the progress that names it; remove the checkpoint before."""
    path = _checkpoint_path(out, progress)
    path.parent.mkdir(parents=True, exist_ok=True)
    learner.save(path)
    progress.save(out / "progress.json")
    for old in path.parent.glob("leg-*.zip"):
        if old != path:
            old.unlink()


def _checkpoint_path(out: Path, progress: Progress) -> Path:
    return out / "checkpoint" / f"leg-{progress.legs:05d}.zip"
