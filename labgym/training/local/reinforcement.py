"""PPO (Schulman et al. 2017) for the local planner, from the weights of the imitation.

Drives are driven to their end by LabNav's rules; the update is that of stable-baselines3.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3 import PPO
from stable_baselines3.common.buffers import RolloutBuffer
from stable_baselines3.common.logger import Logger
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.common.utils import FloatSchedule
from torch import nn

from labgym.policies.learned.checkpoint import load_checkpoint, save_checkpoint
from labgym.policies.learned.training_loop import CHECKPOINT, finish, train_identity
from labgym.policies.local.policy import FILE, checked_actor
from labgym.runs import ExecutorOptions, RunFolder
from labgym.runs.manifest import file_digest
from labgym.training.local.collection import Mode, Records, TrainingDrive, driven
from labgym.training.local.imitation import (
    HISTORY,
    OPTIONS,
    VALIDATION,
    means,
    timed,
    validation_record,
    write_history,
)
from labgym.training.local.model import actor_parts, load_actor, model_arguments, save_actor
from labgym.training.local.options import ReinforcementOptions
from labgym.training.local.practice import digest_of, validation_floors
from labgym.training.local.schedule import check_tasks, drawn_drives, validation_drives, weights_by_failure

NETWORK = "network.safetensors"
ALGORITHM = "PPO"
ITERATION = "iteration"
CRITIC_RATE, CRITIC_EPOCHS = 1e-3, 20
"""Learning rate, and passes over the drives, while only the critic learns."""


def reinforce(
    options: ReinforcementOptions,
    start: Path,
    floors: Sequence[Path],
    out: Path,
    executor: ExecutorOptions | None = None,
    fresh: bool = False,
) -> Path:
    """Train, or resume, the run in a folder and return the file of the policy after the last update.

    Args:
        options: of the run.
        start: file of the policy to begin with. floors: files of `make_practice`.
        out: folder of the run: policies, `history.jsonl` and a checkpoint.
        executor: where drives are driven. fresh: move the files of the folder aside and start anew.

    Raises:
        UnknownNameError: a task does not exist.
        OptionError: the folder is in use or holds another run.
        DocumentError: the first policy or the checkpoint is damaged, or a finished run was changed.
    """
    check_tasks(options.tasks)
    torch.set_num_threads(1)
    checked_actor(start)
    inputs = options.to_json() | {"practice": digest_of(floors), "start": file_digest(start)}
    identity = train_identity("local-ppo", ("stable-baselines3",), **inputs)
    with RunFolder.open(out, identity, fresh) as run:
        if not run.finished:
            options.save(out / OPTIONS)
            Reinforcement(options, start, floors, out, executor).train()
            finish(run, (OPTIONS, HISTORY, FILE))
        (out / CHECKPOINT).unlink(missing_ok=True)
    return out / FILE


class Reinforcement:
    """A run of PPO.

    Args:
        options: of the run. start: file of the first policy. floors: to practice on. out: folder.
        executor: where drives are driven.
    """

    def __init__(
        self,
        options: ReinforcementOptions,
        start: Path,
        floors: Sequence[Path],
        out: Path,
        executor: ExecutorOptions | None,
    ) -> None:
        self._options, self._floors, self._out, self._executor = options, floors, out, executor
        self._validation = validation_floors(out)
        self._learner = make_learner(options)
        load_actor(self._learner.policy, checked_actor(start))
        self._history: list[dict[str, Any]] = []

    def train(self) -> None:
        """Train to the end."""
        if (self._out / CHECKPOINT).exists():
            self._history = load_checkpoint(self._out / CHECKPOINT, self._parts, _is_history)
        else:
            self._judge(0)
            self._keep()
        begun = sum(record["kind"] == ITERATION for record in self._history)
        for number in range(begun, self._options.iterations):
            with timed(self._out, number):
                self._iterate(number)
                if (number + 1) % self._options.evaluate_every == 0 or number + 1 == self._options.iterations:
                    self._judge(number + 1)
                self._keep()
        save_actor(self._learner.policy, self._out / FILE, ALGORITHM)
        (self._out / NETWORK).unlink(missing_ok=True)

    @property
    def _parts(self) -> dict[str, Any]:
        return {"policy": self._learner.policy, "optimizer": self._learner.policy.optimizer}

    def _keep(self) -> None:
        """Write checkpoint and history."""
        save_checkpoint(self._out / CHECKPOINT, self._parts, self._history)
        write_history(self._out, self._history)

    def _iterate(self, number: int) -> None:
        """Drive, and learn of it."""
        options = self._options
        latest = next(record for record in reversed(self._history) if record["kind"] == VALIDATION)
        weights = weights_by_failure(latest["scores"])
        drives = drawn_drives(self._floors, options.tasks, options.drives, options.seed, 1000 + number, weights)
        noise = tuple(torch.exp(self._learner.policy.log_std.detach()).tolist())
        records, rows = self._driven(drives, "noisy", noise, f"{ITERATION} {number}")
        warming = number < options.critic_iterations
        facts = update(self._learner, records, options, number, warming)
        samples = sum(len(each["inputs"]) for each in records)
        record = {"kind": ITERATION, "number": number, "samples": samples, **facts, **means(rows)}
        self._history.append(record)

    def _judge(self, number: int) -> None:
        """Drive the drafts on floors-val without noise; the scores decide how often each task is practiced."""
        episodes = validation_drives(self._validation, self._options.tasks, self._options.validation)
        _, rows = self._driven(episodes, "alone", None, f"{VALIDATION} {number}")
        self._history.append(validation_record(number, rows))

    def _driven(
        self, drives: list[TrainingDrive], mode: Mode, noise: tuple[float, ...] | None, title: str
    ) -> tuple[list[Records], list[dict[str, Any]]]:
        """Return the records and the rows of drives, in their order."""
        network = save_actor(self._learner.policy, self._out / NETWORK, ALGORITHM)
        return driven(drives, self._options.shard, network, mode, title, self._executor, noise=noise)


def make_learner(options: ReinforcementOptions) -> PPO:
    """Return a PPO learner with new weights, without an environment: its drives come from elsewhere."""
    learner = PPO(
        "MlpPolicy",
        None,  # type: ignore[arg-type] # as when stable-baselines3 loads a model
        learning_rate=options.rate,
        n_steps=options.batch,
        batch_size=options.batch,
        n_epochs=options.epochs,
        gamma=options.discount,
        gae_lambda=options.trace,
        clip_range=options.clip,
        ent_coef=options.entropy,
        target_kl=options.divergence,
        seed=options.seed,
        device="cpu",
        _init_setup_model=False,
    )
    observations, actions, arguments = model_arguments(options.noise)
    learner.observation_space, learner.action_space, learner.n_envs = observations, actions, 1
    learner.policy_kwargs = arguments
    learner._setup_model()
    learner.set_logger(Logger(None, []))
    return learner


def update(
    learner: PPO, records: list[Records], options: ReinforcementOptions, number: int, warming: bool
) -> dict[str, float]:
    """Learn of some drives, and return the mean return, the explained variance and the standard deviations.

    Args:
        learner: learns. records: of the drives. options: of the run. number: of the iteration.
        warming: whether only the critic learns.
    """
    done = number / options.iterations
    rate = CRITIC_RATE if warming else options.rate * (1.0 - 0.9 * done)
    learner.lr_schedule = FloatSchedule(rate)
    learner.n_epochs = CRITIC_EPOCHS if warming else options.epochs
    learner.target_kl = None if warming else options.divergence
    learner.set_random_seed(int(np.random.SeedSequence([options.seed, number]).generate_state(1)[0]) % 2**31)
    learner.rollout_buffer = filled(learner.policy, records, options)
    actor = [*(each for part in actor_parts(learner.policy) for each in part.parameters()), learner.policy.log_std]
    _freeze(actor, warming)
    learner.train()
    _freeze(actor, False)
    values, returns = learner.rollout_buffer.values.ravel(), learner.rollout_buffer.returns.ravel()
    explained = 1.0 - float(np.var(returns - values)) / max(float(np.var(returns)), 1e-9)
    deviations = torch.exp(learner.policy.log_std.detach()).tolist()
    return {
        "reward": round(math.fsum(float(each["rewards"].sum()) for each in records) / _drives(records), 5),
        "explained": round(explained, 4),
        "noise_forward": round(deviations[0], 4),
        "noise_turn": round(deviations[1], 4),
        "divergence": round(float(learner.logger.name_to_value.get("train/approx_kl", 0.0)), 5),
    }


def filled(policy: ActorCriticPolicy, records: list[Records], options: ReinforcementOptions) -> RolloutBuffer:
    """Return the buffer of stable-baselines3 with drives one after the other, and their advantages.

    The end of each drive is the end of an episode: time and patience that run out are failures. The drives of a shift
    are separate episodes.
    """
    inputs, actions, rewards = (
        np.concatenate([each[name] for each in records]) for name in ("inputs", "actions", "rewards")
    )
    starts = np.zeros(len(inputs), np.float32)
    lengths = np.concatenate([each["lengths"] for each in records])
    starts[np.cumsum(np.concatenate([[0], lengths]))[:-1][lengths > 0]] = 1.0
    policy.set_training_mode(False)
    with torch.inference_mode():
        values, likelihoods, _ = policy.evaluate_actions(torch.from_numpy(inputs), torch.from_numpy(actions))
    buffer = RolloutBuffer(
        len(inputs), policy.observation_space, policy.action_space, "cpu", options.trace, options.discount, 1
    )
    buffer.observations, buffer.actions = inputs[:, None], actions[:, None]
    buffer.rewards, buffer.episode_starts = rewards[:, None], starts[:, None]
    buffer.values, buffer.log_probs = _column(values), _column(likelihoods)
    buffer.pos, buffer.full = len(inputs), True
    buffer.compute_returns_and_advantage(torch.zeros(1), np.ones(1))
    return buffer


def _column(values: torch.Tensor) -> NDArray[np.float32]:
    return values.reshape(-1, 1).clone().numpy()


def _drives(records: list[Records]) -> int:
    """Return the number of drives, those of a shift one by one."""
    return max(1, sum(len(each["lengths"]) for each in records))


def _freeze(parameters: list[nn.Parameter], frozen: bool) -> None:
    for each in parameters:
        each.requires_grad_(not frozen)


def _is_history(record: Any) -> bool:
    """Return whether a checkpoint's record is a history."""
    return isinstance(record, list) and all(
        isinstance(each, dict) and each.get("kind") in (ITERATION, VALIDATION) for each in record
    )
