"""Seeded streams of the LabNav tasks: people, glass, odometry, noise and what moved are those of the published rows.

The numbers were written by the code that drove the published rows. They pin every shipped default on the way from a
seed to an observation: a test that passes its own parameters would not see a changed one.
"""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import labgym  # noqa: F401  (registers the environments)
from labgym.envs import RewardWeights

FILE = Path(__file__).parent / "data" / "labnav_streams.json"
LAYOUT = "floors-val-0003"
STEPS = 40
ROUNDING_DIGITS = 6
"""Readings that are not exact differ in the last bits from processor to processor."""
TASKS = ("Aisle", "Moved", "People", "Dock", "Odometry", "Glass", "Carry", "Shift")


def stream(task: str) -> list[list[float]]:
    """Return numbers of every eighth step of a seeded episode on level 2, driven by seeded actions."""
    env = gym.make(f"LabNav{task}-v0", level=2, stop="action", weights=RewardWeights())
    observation, info = env.reset(seed=7, options={"layout": LAYOUT})
    actions = np.random.default_rng(5)
    rows = [numbers(observation, info, 0.0)]
    for step in range(1, STEPS + 1):
        forward, turn = actions.uniform(-0.7, 0.5), actions.uniform(0.0, 1.0)
        action = np.array([forward, turn, -1.0], dtype=np.float32)
        observation, reward, terminated, truncated, info = env.step(action)
        if step % 8 == 0 or terminated or truncated:
            rows.append(numbers(observation, info, float(reward)))
        if terminated or truncated:
            break
    env.close()
    return rows


def numbers(observation: dict[str, np.ndarray], info: dict[str, Any], reward: float) -> list[float]:
    lidar = observation["lidar"].astype(float)
    values = [*observation["odometry"], *observation["goal"], *observation["velocity"], *info["pose"]]
    values += [lidar.mean(), lidar[::30].min(), (lidar >= lidar.max()).sum(), info["cost"], info["clearance"], reward]
    return [round(float(value), ROUNDING_DIGITS) for value in values]


@pytest.mark.parametrize("task", TASKS)
def test_a_seed_gives_the_published_stream(task: str) -> None:
    found = {**json.loads(FILE.read_text(encoding="utf-8")), **written(task)}
    np.testing.assert_allclose(stream(task), found[task], atol=2e-6, rtol=0)


def written(task: str) -> dict[str, Any]:
    """Write the task's stream where LABGYM_GOLDEN=1 asks for it: only after a change that the changelog names."""
    if os.environ.get("LABGYM_GOLDEN") != "1":
        return {}
    FILE.parent.mkdir(exist_ok=True)
    streams = json.loads(FILE.read_text(encoding="utf-8")) if FILE.exists() else {}
    streams[task] = stream(task)
    FILE.write_text(json.dumps(streams, indent=0) + "\n", encoding="utf-8")
    return {task: streams[task]}
