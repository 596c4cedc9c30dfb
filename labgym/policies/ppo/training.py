"""Training, from the layouts to the weights. It may be interrupted at any time and resumes from its last checkpoint."""

from __future__ import annotations

import json
import shutil
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import torch
from gymnasium import spaces
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from stable_baselines3.common.utils import FloatSchedule, set_random_seed
from stable_baselines3.common.vec_env import DummyVecEnv, VecEnv
from torch import Tensor, nn
from tqdm import tqdm

from labgym.documents import append_text
from labgym.layouts import Layout
from labgym.layouts.batch import catalog_digest
from labgym.policies.learned.checkpoint import Stateful, load_checkpoint, save_checkpoint
from labgym.policies.learned.training_loop import TIMES, finish, train_identity
from labgym.policies.learned.weights import WEIGHTS, save_weights
from labgym.policies.policy import Policy
from labgym.policies.ppo.cloning import clone_expert
from labgym.policies.ppo.drives import TrainingDrives, layout_pool
from labgym.policies.ppo.inputs import Sensor
from labgym.policies.ppo.network import FEATURES, HIDDEN, Actor, Encoder
from labgym.policies.ppo.options import PPOOptions, TrainingProgress
from labgym.policies.ppo.policy import DRIVERS
from labgym.policies.ppo.practice import PracticeEnv
from labgym.runs import ExecutorOptions, RunFolder, RunIdentity

OPTIONS, PROGRESS, CHECKPOINTS = "options.json", "progress.json", "checkpoint"

Judge = Callable[[Policy], float]
"""Returns the success rate of a policy on the validation split."""


class EncoderExtractor(BaseFeaturesExtractor):
    """The encoder as a features extractor of stable-baselines3; actor and critic share it."""

    def __init__(self, observation_space: spaces.Box, sensor: Sensor) -> None:
        super().__init__(observation_space, FEATURES)
        self.encoder = Encoder(sensor)

    def forward(self, observations: Tensor) -> Tensor:
        """Return the features of vectors."""
        features: Tensor = self.encoder(observations)
        return features


def make_environments(drives: TrainingDrives, options: PPOOptions) -> DummyVecEnv:
    """Return the training environments, stepped in turn in this process."""
    return DummyVecEnv([lambda: PracticeEnv(drives, options.observation, options.horizon)] * options.environments)


def make_learner(environments: VecEnv, options: PPOOptions) -> PPO:
    """Return a PPO learner with new weights."""
    return PPO(
        "MlpPolicy",
        environments,
        learning_rate=options.rate,
        n_steps=options.rollout,
        batch_size=options.batch,
        n_epochs=options.epochs,
        gamma=options.discount,
        gae_lambda=options.trace,
        clip_range=options.clip,
        ent_coef=options.entropy,
        target_kl=0.03,
        policy_kwargs={
            "features_extractor_class": EncoderExtractor,
            "features_extractor_kwargs": {"sensor": options.observation},
            "net_arch": {"pi": [HIDDEN], "vf": [HIDDEN]},
            "activation_fn": nn.ReLU,
            "log_std_init": float(torch.tensor(options.noise).log()),
            "ortho_init": False,
        },
        seed=options.seed,
        device="cpu",
    )


def actor_of(learner: PPO, sensor: Sensor) -> Actor:
    """Return a copy of the actor: the policy without critic and noise."""
    actor = Actor(sensor)
    policy: Any = learner.policy
    actor.encoder.load_state_dict(policy.features_extractor.encoder.state_dict())
    actor.hidden.load_state_dict(policy.mlp_extractor.policy_net.state_dict())
    actor.action.load_state_dict(policy.action_net.state_dict())
    return actor.eval()


def train(
    options: PPOOptions,
    out: Path,
    judge: Judge | None = None,
    layouts: tuple[Layout, ...] | None = None,
    fresh: bool = False,
    executor: ExecutorOptions | None = None,
) -> Path:
    """Train, or resume, the run in a folder and return the folder of the best weights.

    On one machine with one number of threads, equal options give equal weights, whether the run was interrupted or
    not.

    Args:
        options: options of the run.
        out: its folder: `options.json`, `progress.json`, `times.jsonl`, `layouts/`, the checkpoint while it is
            unfinished, and `last/` and `best/` with weights.
        judge: scores policies on the validation split; without it the last weights are the best.
        layouts: layouts to train in; None generates the pool of the options.
        fresh: move the files of the folder aside and start anew.
        executor: where the layouts of the pool are generated.

    Raises:
        OptionError: the folder is in use or holds another run; the message names the differences.
        DocumentError: the checkpoint is missing or damaged, or a finished run was changed.
    """
    with RunFolder.open(out, _identity(options, judge, layouts), fresh) as run:
        if not run.finished:
            options.save(out / OPTIONS)
            pool = layouts or layout_pool(run, options.layouts, options.seed, executor)
            _train(options, out, judge, pool)
            finish(run, (OPTIONS, PROGRESS, *(f"{kind}/{WEIGHTS}" for kind in ("last", "best"))))
        shutil.rmtree(out / CHECKPOINTS, ignore_errors=True)
    return out / "best"


def _identity(options: PPOOptions, judge: Judge | None, layouts: tuple[Layout, ...] | None) -> RunIdentity:
    return train_identity(
        "ppo",
        ("stable-baselines3",),
        **options.model_dump(mode="json"),
        threads=torch.get_num_threads(),
        judged=judge is not None,
        pool=None if layouts is None else [layout.hash for layout in layouts],
        catalog=catalog_digest(),
    )


def _train(options: PPOOptions, out: Path, judge: Judge | None, pool: tuple[Layout, ...]) -> None:
    drives = TrainingDrives(pool, options.seed)
    environments = make_environments(drives, options)
    progress = TrainingProgress.load(out / PROGRESS) if (out / PROGRESS).exists() else None
    set_random_seed(options.seed)
    learner = make_learner(environments, options)
    if progress is None:
        records = clone_expert(learner, environments, options)
        progress = TrainingProgress(records=tuple({"kind": "warm start", **record} for record in records))
        _checkpoint(learner, progress, out)
    _restore(learner, progress, out)
    if progress.records and progress.records[-1]["kind"] == "warm start":
        progress = _judged(learner, progress, judge, options, out)
        _checkpoint(learner, progress, out)
    bar = tqdm(desc="ppo", total=options.steps, initial=learner.num_timesteps, unit="step", mininterval=10.0)
    while learner.num_timesteps < options.steps:
        begun = time.perf_counter()
        record = _leg(learner, drives, options, progress.legs)
        progress = progress.model_copy(update={"legs": progress.legs + 1, "records": (*progress.records, record)})
        last = learner.num_timesteps >= options.steps
        if last or progress.legs % options.evaluate_every == 0:
            progress = _judged(learner, progress, judge, options, out)
        _checkpoint(learner, progress, out)
        seconds = time.perf_counter() - begun
        append_text(out / TIMES, json.dumps({"leg": progress.legs, "seconds": seconds}) + "\n")
        bar.update(learner.num_timesteps - bar.n)
        bar.set_postfix(training=record["success"], validation=progress.best)
    bar.close()


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


def _judged(
    learner: PPO, progress: TrainingProgress, judge: Judge | None, options: PPOOptions, out: Path
) -> TrainingProgress:
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


def _checkpoint(learner: PPO, progress: TrainingProgress, out: Path) -> None:
    """Write the state of the learner, then the progress that names the file; remove the previous checkpoint."""
    path = _checkpoint_path(out, progress)
    save_checkpoint(path, _parts(learner), {"steps": learner.num_timesteps, "updates": learner._n_updates})
    progress.save(out / PROGRESS)
    for old in path.parent.glob("leg-*.pt"):
        if old != path:
            old.unlink()


def _checkpoint_path(out: Path, progress: TrainingProgress) -> Path:
    return out / CHECKPOINTS / f"leg-{progress.legs:05d}.pt"


def _restore(learner: PPO, progress: TrainingProgress, out: Path) -> None:
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
