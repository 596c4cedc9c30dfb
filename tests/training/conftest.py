"""Spaces of the environments without a simulation, for models whose networks alone are tested."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

SIZES = {"goal": 3, "lidar": 180, "velocity": 2}


class Blank(gym.Env):
    """Random observations in given spaces."""

    def __init__(self, space: gym.Space) -> None:
        self.observation_space = space
        self.action_space = gym.spaces.Box(-1.0, 1.0, (2,), np.float32)

    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[Any, dict]:
        super().reset(seed=seed)
        return self.observation_space.sample(), {}

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict]:
        return self.observation_space.sample(), 0.0, False, False, {}


@pytest.fixture
def usual_space() -> gym.spaces.Dict:
    return gym.spaces.Dict({name: gym.spaces.Box(-10.0, 10.0, (size,), np.float32) for name, size in SIZES.items()})


@pytest.fixture
def observations() -> list[dict[str, np.ndarray]]:
    """Observations as a policy receives them."""
    rng = np.random.default_rng(1)
    return [
        {name: rng.uniform(-10.0, 10.0, size).astype(np.float32) for name, size in SIZES.items()}
        | {"odometry": rng.uniform(-2.0, 2.0, 3)}
        for _ in range(20)
    ]


@pytest.fixture
def blank() -> type[Blank]:
    return Blank
