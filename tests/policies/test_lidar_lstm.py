"""The published end-to-end policy drives, remembers, and forgets between episodes."""

from __future__ import annotations

import gymnasium as gym
import numpy as np
import pytest

pytest.importorskip("torch")
pytest.importorskip("safetensors")

import labgym  # noqa: F401 -- registers the environments
from labgym.policies import EpisodeStart, make_policy


def drive(env, policy, seed):
    """Return the actions of a drive, and whether it ended in success."""
    observation, info = env.reset(seed=seed)
    policy.reset(EpisodeStart(goal=(0.0, 0.0), rng=np.random.default_rng(0)))
    actions, ended = [], False
    while not ended:
        actions.append(policy.act(observation))
        observation, _, terminated, truncated, info = env.step(actions[-1].astype(np.float32))
        ended = terminated or truncated
    return np.array(actions), bool(info["is_success"])


def test_it_reaches_its_goals_at_level_0_and_repeats_a_drive():
    env = gym.make("LabNavAisle-v0", level=0, split="floors-val", max_episode_steps=600)
    policy = make_policy("lidar-lstm")
    drives = [drive(env, policy, seed) for seed in (0, 1, 2)]
    assert sum(success for _, success in drives) >= 2
    again, _ = drive(env, policy, 0)
    np.testing.assert_array_equal(again, drives[0][0])
    assert policy.observation == "lidar"
    assert not policy.privileged
    env.close()
