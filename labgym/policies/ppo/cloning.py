"""The warm start: the network imitates a privileged expert on the states that it visits (DAgger, Ross et al. 2011)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import DummyVecEnv
from tqdm import tqdm

from labgym.policies.learned.expert import Atlases, Expert
from labgym.policies.ppo.inputs import SPEED
from labgym.policies.ppo.options import PPOOptions
from labgym.policies.ppo.practice import PracticeEnv

Floats = NDArray[np.float32]

ACTION_NOISE = 0.3
"""Standard deviation of the noise on the driver's actions, so that states off the path are visited."""


@dataclass(frozen=True, eq=False)
class Lessons:
    """Control steps of one round.

    Attributes:
        vectors: (n, SIZES[sensor]), the network's inputs.
        actions: (n, 2) of the expert.
        returns: (n,) discounted returns of the driver; NaN where the round ended before the episode.
    """

    vectors: Floats
    actions: Floats
    returns: Floats


def clone_expert(learner: PPO, environments: DummyVecEnv, options: PPOOptions) -> list[dict[str, float | None]]:
    """Train the learner's actor on the expert's actions and its critic on the returns; return one record per round.

    The expert drives in the first round. The probability that the learner drives rises to one in the later rounds.
    """
    optimizer = torch.optim.Adam(learner.policy.parameters(), lr=options.cloning_rate)
    lessons: list[Lessons] = []
    atlases = Atlases()
    records: list[dict[str, float | None]] = []
    updates = options.cloning_rounds * options.cloning_epochs
    for round_ in range(options.cloning_rounds):
        share = min(1.0, round_ / max(1.0, options.cloning_rounds / 2.0))
        lesson, success = _drive(learner, environments, options, atlases, share, round_)
        lessons.append(lesson)
        loss = 0.0
        for epoch in range(options.cloning_epochs):
            done = (round_ * options.cloning_epochs + epoch) / updates
            optimizer.param_groups[0]["lr"] = options.cloning_rate * (1.0 - 0.9 * done)
            loss = _fit(learner, optimizer, lessons, options, seed=round_ * options.cloning_epochs + epoch)
        records.append({"round": round_, "driven": share, "success": success, "loss": loss})
    return records


def _drive(
    learner: PPO,
    environments: DummyVecEnv,
    options: PPOOptions,
    atlases: Atlases,
    share: float,
    round_: int,
) -> tuple[Lessons, float | None]:
    """Drive one round; return its control steps and the share of episodes that succeeded."""
    rng = np.random.default_rng([options.seed, round_])
    practice: list[PracticeEnv] = [env for env in environments.envs if isinstance(env, PracticeEnv)]
    experts = [Expert(atlases) for _ in practice]
    environments.seed(int(rng.integers(2**31)))
    vectors: Any = environments.reset()
    poses = [(*env.task.pair.start, 0.0) for env in practice]
    student = rng.random(len(practice)) < share
    inputs, labels, rewards, ends, outcomes = [], [], [], [], []
    for _ in tqdm(range(options.cloning_steps // len(practice)), desc=f"warm start {round_ + 1}", mininterval=10.0):
        actions = np.array(
            [
                expert.action(env.task, pose[:3], pose[3])
                for expert, env, pose in zip(experts, practice, poses, strict=True)
            ],
            dtype=np.float32,
        )
        own, _ = learner.predict(vectors, deterministic=True)
        noisy = np.where(student[:, None], own, actions) + rng.normal(0.0, ACTION_NOISE, actions.shape)
        inputs.append(vectors)
        labels.append(actions)
        vectors, reward, done, infos = environments.step(np.clip(noisy, -1.0, 1.0).astype(np.float32))
        rewards.append(reward)
        ends.append(done)
        for k, info in enumerate(infos):
            poses[k] = (*info["pose"], float(vectors[k][SPEED]))
            if done[k]:
                outcomes.append(bool(info["success"]))
                poses[k] = (*practice[k].task.pair.start, 0.0)
                student[k] = rng.random() < share
    returns = _returns(np.array(rewards), np.array(ends), options.discount)
    lessons = Lessons(np.concatenate(inputs), np.concatenate(labels), returns.ravel())
    return lessons, float(np.mean(outcomes)) if outcomes else None


def _returns(rewards: Floats, ends: NDArray[np.bool_], discount: float) -> Floats:
    """Return the discounted return of each step, (steps, environments); NaN where the episode did not end."""
    returns = np.full(rewards.shape, np.nan, dtype=np.float32)
    after = np.full(rewards.shape[1], np.nan, dtype=np.float32)
    for k in range(len(rewards) - 1, -1, -1):
        after = rewards[k] + discount * np.where(ends[k], 0.0, after)
        returns[k] = after
    return returns


def _fit(
    learner: PPO, optimizer: torch.optim.Optimizer, lessons: list[Lessons], options: PPOOptions, seed: int
) -> float:
    """Make one pass over the lessons; return the mean loss of the actions."""
    vectors, actions, returns = (
        torch.from_numpy(np.concatenate([getattr(lesson, name) for lesson in lessons]))
        for name in ("vectors", "actions", "returns")
    )
    policy: Any = learner.policy
    policy.train()
    order = torch.randperm(len(vectors), generator=torch.Generator().manual_seed(seed))
    total = 0.0
    for batch in torch.split(order, options.batch):
        features = policy.extract_features(vectors[batch])
        actor, critic = policy.mlp_extractor(features)
        copying = (policy.action_net(actor) - actions[batch]).abs().mean()
        complete = ~returns[batch].isnan()
        judging = (policy.value_net(critic)[:, 0] - returns[batch])[complete].square().mean()
        loss = copying + 0.5 * torch.nan_to_num(judging)
        optimizer.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(policy.parameters(), 1.0)
        optimizer.step()
        total += float(copying.detach()) * len(batch)
    return total / len(vectors)
