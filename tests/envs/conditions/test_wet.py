"""Wet floor: time in a puddle in closed form, and the errors of odometry in it."""

from __future__ import annotations

import math

import gymnasium as gym
import numpy as np
import pytest
from condition_tasks import POSE, Fixed

from labgym.envs.conditions.wet import WetFloor
from labgym.envs.parts.odometry import OdometrySensor
from labgym.errors import OptionError


def make(data, **options):
    options = {"measures": ("pose", "outcomes"), "endings": (), **options}
    options = {"tasks": Fixed("wet_floor", data), "conditions": ["wet_floor"], **options}
    return gym.make("LabFloorNav-v0", disable_env_checker=True, **options)


def test_the_time_in_a_puddle_is_its_chord_over_the_speed():
    x, y, _ = POSE
    env = make({"zones": [{"x": x + 1.2, "y": y + 0.3, "radius": 0.5}], "slip": 2.0})
    env.reset(seed=0)
    for _ in range(45):
        outcome = env.step(np.array([0.5, 0.0], np.float32))[4]["outcomes"]["wet_floor"]
    assert outcome["entries"] == 1
    assert outcome["seconds"] == pytest.approx(2.0 * 0.4 / 0.5, abs=0.11)
    env.close()


def test_odometry_errs_more_in_a_puddle():
    x, y, _ = POSE
    spread = {}
    for slip in (1.0, 4.0):
        errors = []
        env = make(
            {"zones": [{"x": x, "y": y, "radius": 5.0}], "slip": slip},
            sensors=("goal", OdometrySensor(along=0.05, heading=2.0)),
        )
        for seed in range(30):
            env.reset(seed=seed)
            for _ in range(15):
                observation, _, _, _, info = env.step(np.array([0.6, 0.0], np.float32))
            errors.append(observation["odometry"][0] - (info["pose"][0] - x))
        env.close()
        spread[slip] = float(np.std(errors))
    assert spread[4.0] / spread[1.0] == pytest.approx(4.0, rel=0.3)


def test_puddles_are_drawn_near_the_route():
    task = Fixed("wet_floor", {}).task
    drawn = WetFloor(zones=3, radius=0.4).draw(task, np.random.default_rng(0))
    assert len(drawn["zones"]) == 3
    for zone in drawn["zones"]:
        along = min(max(zone["x"] - POSE[0], 0.0), 2.0)
        assert math.hypot(zone["x"] - POSE[0] - along, zone["y"] - POSE[1]) < math.sqrt(2.0)
        assert 0.15 <= zone["radius"] <= 0.4


@pytest.mark.parametrize(
    "value",
    [3, {"zones": []}, {"zones": "x", "slip": 1.0}, {"zones": [{"x": 0.0}], "slip": 1.0}, {"zones": [], "slip": -1.0}],
)
def test_data_that_is_no_wet_floor_is_refused(value):
    with pytest.raises(OptionError):
        make(value).reset(seed=0)
    with pytest.raises(OptionError):
        WetFloor(zones=1000)
