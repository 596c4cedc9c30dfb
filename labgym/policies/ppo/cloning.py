"""The warm start: the network copies the expert where it comes itself (DAgger, Ross et al. 2011)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import DummyVecEnv
from tqdm import tqdm

from labgym.policies.ppo.expert import Atlas, Expert
from labgym.policies.ppo.inputs import SPEED
from labgym.policies.ppo.options import TrainingOptions
from labgym.policies.ppo.practice import PracticeEnv

Floats = NDArray[np.float32]
NUDGE = 0.3
"""Standard deviation of what is added to the driver's actions, so that states beside the path are seen."""


@dataclass(frozen=True, eq=False)
class Lessons:
    """Control steps of one round.

    Attributes:
        vectors: (n, SIZE). actions: (n, 2), the expert's.
        returns: (n,), discounted, of whoever drove; NaN where the round ended before the episode.
    """

    vectors: Floats
    actions: Floats
    returns: Floats


def clone_expert(learner: PPO, environments: DummyVecEnv, options: TrainingOptions) -> list[dict[str, float | None]]:
    """Train the learner's actor on the expert's actions, and its critic on the returns; one record a round.

    In the first round the expert drives, in the later ones the learner, its chance to do so rising to one.
    """
    optimiser = torch.optim.Adam(learner.policy.parameters(), lr=options.cloning_rate)
    lessons: list[Lessons] = []
    atlases: dict[str, Atlas] = {}
    records: list[dict[str, float | None]] = []
    updates = options.cloning_rounds * options.cloning_epochs
    for round_ in range(options.cloning_rounds):
        share = min(1.0, round_ / max(1.0, options.cloning_rounds / 2.0))
        found, success = _drive(learner, environments, options, atlases, share, round_)
        lessons.append(found)
        loss = 0.0
        for epoch in range(options.cloning_epochs):
            done = (round_ * options.cloning_epochs + epoch) / updates
            optimiser.param_groups[0]["lr"] = options.cloning_rate * (1.0 - 0.9 * done)
            loss = _fit(learner, optimiser, lessons, options, seed=round_ * options.cloning_epochs + epoch)
        records.append({"round": round_, "driven": share, "success": success, "loss": loss})
    return records


def _drive(
    learner: PPO,
    environments: DummyVecEnv,
    options: TrainingOptions,
    atlases: dict[str, Atlas],
    share: float,
    round_: int,
) -> tuple[Lessons, float | None]:
    """Drive one round; return what was seen and the share of episodes that succeeded."""
    rng = np.random.default_rng([options.seed, round_])
    practice: list[PracticeEnv] = [env for env in environments.envs if isinstance(env, PracticeEnv)]
    experts = [Expert(atlases) for _ in practice]
    environments.seed(int(rng.integers(2**31)))
    vectors: Any = environments.reset()
    poses = [(*env.task.pair.start, 0.0) for env in practice]
    student = rng.random(len(practice)) < share
    seen, taught, rewards, ends, outcomes = [], [], [], [], []
    for _ in tqdm(range(options.cloning_steps // len(practice)), desc=f"warm start {round_ + 1}", mininterval=10.0):
        actions = np.array(
            [
                expert.action(env.task, pose[:3], pose[3])
                for expert, env, pose in zip(experts, practice, poses, strict=True)
            ],
            dtype=np.float32,
        )
        own, _ = learner.predict(vectors, deterministic=True)
        driven = np.where(student[:, None], own, actions) + rng.normal(0.0, NUDGE, actions.shape)
        seen.append(vectors)
        taught.append(actions)
        vectors, reward, done, infos = environments.step(np.clip(driven, -1.0, 1.0).astype(np.float32))
        rewards.append(reward)
        ends.append(done)
        for k, info in enumerate(infos):
            poses[k] = (*info["pose"], float(vectors[k][SPEED]))
            if done[k]:
                outcomes.append(bool(info["success"]))
                poses[k] = (*practice[k].task.pair.start, 0.0)
                student[k] = rng.random() < share
    returns = _returns(np.array(rewards), np.array(ends), options.discount)
    lessons = Lessons(np.concatenate(seen), np.concatenate(taught), returns.ravel())
    return lessons, float(np.mean(outcomes)) if outcomes else None


def _returns(rewards: Floats, ends: NDArray[np.bool_], discount: float) -> Floats:
    """Return the discounted sum of what followed each step (steps, environments); NaN where the end was not seen."""
    found = np.full(rewards.shape, np.nan, dtype=np.float32)
    after = np.full(rewards.shape[1], np.nan, dtype=np.float32)
    for k in range(len(rewards) - 1, -1, -1):
        after = rewards[k] + discount * np.where(ends[k], 0.0, after)
        found[k] = after
    return found


def _fit(
    learner: PPO, optimiser: torch.optim.Optimizer, lessons: list[Lessons], options: TrainingOptions, seed: int
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
        hidden, judged = policy.mlp_extractor(features)
        copying = (policy.action_net(hidden) - actions[batch]).abs().mean()
        known = ~returns[batch].isnan()
        judging = (policy.value_net(judged)[:, 0] - returns[batch])[known].square().mean()
        loss = copying + 0.5 * torch.nan_to_num(judging)
        optimiser.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(policy.parameters(), 1.0)
        optimiser.step()
        total += float(copying.detach()) * len(batch)
    return total / len(vectors)
