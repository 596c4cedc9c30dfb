"""Success rate and SPL in evaluations during training, against values by hand."""

from __future__ import annotations

import math

import gymnasium as gym
import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

from stable_baselines3 import PPO
from stable_baselines3.common.logger import configure
from stable_baselines3.common.vec_env import DummyVecEnv, VecMonitor

from labgym.training import ScoreCallback
from labgym.training.scores import success_by_length

ROUTES = [(True, 4.0, 4.0), (True, 4.0, 8.0), (False, 4.0, 3.0), (True, 5.0, 4.9)]
"""Success, shortest path and length driven of the episodes of an evaluation: SPL is (1 + 1/2 + 0 + 1) / 4."""


class Routes(gym.Env):
    """Episodes of two steps with the lengths of `ROUTES`, which begin anew when the environment is seeded."""

    observation_space = gym.spaces.Box(-1.0, 1.0, (2,), np.float32)
    action_space = gym.spaces.Box(-1.0, 1.0, (2,), np.float32)

    def __init__(self) -> None:
        self.episode = -1

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.episode = 0 if seed is not None else (self.episode + 1) % len(ROUTES)
        self.steps = 0
        return np.zeros(2, np.float32), {}

    def step(self, action):
        self.steps += 1
        success, shortest, driven = ROUTES[self.episode]
        info = {"is_success": success, "shortest_path_length": shortest, "path_length": driven}
        return np.zeros(2, np.float32), 1.0, self.steps == 2, False, info


def learn(callback: ScoreCallback, folder, steps: int = 16):
    model = PPO("MlpPolicy", VecMonitor(DummyVecEnv([Routes])), n_steps=8, batch_size=8, n_epochs=1, device="cpu")
    model.set_logger(configure(str(folder), ["csv"]))
    model.learn(steps, callback)
    return model


def test_an_evaluation_logs_success_rate_and_spl(tmp_path):
    best = []
    callback = ScoreCallback(VecMonitor(DummyVecEnv([Routes])), best.append, n_eval_episodes=4, eval_freq=8, verbose=0)
    model = learn(callback, tmp_path)
    assert [record["steps"] for record in callback.records] == [8, 16]
    for record in callback.records:
        assert record["success_rate"] == pytest.approx(0.75)
        assert record["spl"] == pytest.approx(2.5 / 4.0)
        assert record["mean_reward"] == pytest.approx(2.0)
    assert best == [model], "an equal score is no better"
    text = (tmp_path / "progress.csv").read_text()
    assert "eval/spl" in text
    assert "eval/success_rate" in text


@pytest.mark.parametrize(
    ("info", "expected"),
    [
        ({"is_success": True, "shortest_path_length": 3.0, "path_length": 4.0}, 0.75),
        ({"is_success": True, "shortest_path_length": 3.0, "path_length": 2.9}, 1.0),
        ({"is_success": True, "shortest_path_length": 0.0, "path_length": 0.0}, 1.0),
        ({"is_success": True, "shortest_path_length": math.inf, "path_length": 2.0}, 0.0),
        ({"is_success": False, "shortest_path_length": 3.0, "path_length": 3.0}, 0.0),
    ],
)
def test_success_by_length_follows_its_definition(info, expected):
    assert success_by_length(info) == pytest.approx(expected)
