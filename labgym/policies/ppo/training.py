"""Training, from the layouts to the weights. It may be interrupted at any time and resumes from its last checkpoint."""

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
from labgym.policies.learned.checkpoint import Stateful, load_checkpoint, save_checkpoint
from labgym.policies.learned.weights import save_weights
from labgym.policies.policy import Policy
from labgym.policies.ppo.cloning import clone_expert
from labgym.policies.ppo.drives import TrainingDrives
from labgym.policies.ppo.learner import actor_of, make_environments, make_learner
from labgym.policies.ppo.options import PPOOptions
from labgym.policies.ppo.policy import DRIVERS
from labgym.policies.ppo.pool import layout_pool
from labgym.policies.ppo.progress import Progress

Judge = Callable[[Policy], float]
"""Returns the success rate of a policy on the validation split."""


def train(
    options: PPOOptions, out: Path, judge: Judge | None = None, layouts: tuple[Layout, ...] | None = None
) -> Path:
    """Train, or resume, the run in a folder and return the folder of the best weights.

    On one machine with one number of threads, equal options give equal weights, whether the run was interrupted or
    not.

    Args:
        options: options of the run.
        out: its folder: `options.json`, `progress.json`, the checkpoint, and `last/` and `best/` with weights.
        judge: scores policies on the validation split; without it the last weights are the best.
        layouts: layouts to train in; None uses the pool of the options, stored in the folder next to `out`.

    Raises:
        OptionError: the folder holds a run with other options.
        DocumentError: the checkpoint is missing or damaged.
    """
    _claim(out, options)
    pool = layouts or layout_pool(out.parent / "layouts", options.layouts, options.seed)
    drives = TrainingDrives(pool, options.seed)
    environments = make_environments(drives, options)
    progress = Progress.load(out / "progress.json") if (out / "progress.json").exists() else None
    set_random_seed(options.seed)
    learner = make_learner(environments, options)
    if progress is None:
        records = clone_expert(learner, environments, options)
        progress = Progress(records=tuple({"kind": "warm start", **record} for record in records))
        _checkpoint(learner, progress, out)
    _restore(learner, progress, out)
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


def _leg(learner: PPO, drives: TrainingDrives, options: PPOOptions, leg: int) -> dict[str, Any]:
    """Train for some updates on new episodes; the result depends on the weights, the options and the leg alone."""
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
    """Records how the episodes of a leg ended."""

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
        """Return the number of episodes, the share that succeeded, and the share of steps in contact."""
        return {
            "episodes": len(self._ended),
            "success": float(np.mean(self._ended)) if self._ended else None,
            "touching": float(np.mean(self._touching)),
        }


def _judged(learner: PPO, progress: Progress, judge: Judge | None, options: PPOOptions, out: Path) -> Progress:
    """Score the weights on validation, record the score, and save them as the best if they are and PPO trained them."""
    actor = actor_of(learner, options.observation)
    save_weights(actor, out / "last")
    score = None if judge is None else judge(DRIVERS[options.observation](actor=actor))
    record = {"kind": "validation", "steps": learner.num_timesteps, "success": score}
    best = progress.best
    if learner.num_timesteps > 0 and (score is None or best is None or score >= best):
        save_weights(actor, out / "best")
        best = score
    return progress.model_copy(update={"best": best, "records": (*progress.records, record)})


def _claim(out: Path, options: PPOOptions) -> None:
    """Write the options into the folder, or check that it has the same ones; the number of steps may differ."""
    path = out / "options.json"
    if path.exists():
        before = PPOOptions.load(path)
        changed = [name for name in PPOOptions.model_fields if getattr(before, name) != getattr(options, name)]
        if changed and changed != ["steps"]:
            raise OptionError(
                f"{out} holds a run with another {', '.join(changed)}; choose another folder or remove it"
            )
    options.save(path)


def _checkpoint(learner: PPO, progress: Progress, out: Path) -> None:
    """Write the state of the learner, then the progress that names the file; remove the previous checkpoint."""
    path = _checkpoint_path(out, progress)
    save_checkpoint(path, _parts(learner), {"steps": learner.num_timesteps, "updates": learner._n_updates})
    progress.save(out / "progress.json")
    for old in path.parent.glob("leg-*.pt"):
        if old != path:
            old.unlink()


def _checkpoint_path(out: Path, progress: Progress) -> Path:
    return out / "checkpoint" / f"leg-{progress.legs:05d}.pt"


def _restore(learner: PPO, progress: Progress, out: Path) -> None:
    """Give a learner the state of the checkpoint: weights, optimizer and the number of steps."""
    record = load_checkpoint(_checkpoint_path(out, progress), _parts(learner), _is_record)
    learner.num_timesteps, learner._n_updates = record["steps"], record["updates"]


def _is_record(record: Any) -> bool:
    """Return whether a checkpoint's record is the numbers of control steps and of updates."""
    return isinstance(record, dict) and all(
        type(record.get(name)) is int and record[name] >= 0 for name in ("steps", "updates")
    )


def _parts(learner: PPO) -> dict[str, Stateful]:
    return {"policy": learner.policy, "optimizer": learner.policy.optimizer}
