"""Sensors and noise models against closed forms."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from labgym.assets import Catalog
from labgym.envs import LabPointNavEnv
from labgym.envs.parts.actuation import LOCOBOT, LoCoBotActuation, RoboThorActuation
from labgym.envs.parts.maps import BUILDING, NOTHING, asset_labels
from labgym.envs.parts.noise import BASELINE, Dropout, Quantization, RedwoodDepth, RimOcclusion
from labgym.envs.parts.odometry import OdometrySensor
from labgym.envs.state import State
from labgym.errors import OptionError
from labgym.layouts import Layout

ANYWHERE: Any = None
"""A state that the noise models of this file do not read."""


@pytest.fixture(scope="module")
def state(layout: Layout) -> State:
    env = LabPointNavEnv(layout=layout)
    env.reset(seed=0, options={"start": (4.0, 4.8, 0.5), "goal": (5.5, 4.8)})
    return env.state


def reckoned(sensor: OdometrySensor, state: State, track: np.ndarray, seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    sensor.reset(replace(state, pose=tuple(track[0])), rng)
    for pose in track:
        reading = sensor.reading(replace(state, pose=tuple(pose)), rng)
    return reading


def test_odometry_without_errors_is_the_pose_in_the_frame_of_the_start(state: State) -> None:
    rng = np.random.default_rng(0)
    track = np.cumsum(rng.normal(0.0, 0.1, (50, 3)), axis=0)
    (x, y, yaw), (u, v, w) = track[0], track[-1]
    c, s = math.cos(yaw), math.sin(yaw)
    expected = (c * (u - x) + s * (v - y), c * (v - y) - s * (u - x), math.cos(w - yaw), math.sin(w - yaw))
    assert reckoned(OdometrySensor(), state, track, 0) == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize("steps", [3, 12])
def test_odometry_drifts_with_the_way_and_not_with_the_number_of_readings(state: State, steps: int) -> None:
    way = 4.0
    track = np.column_stack([np.linspace(0.0, way, steps), np.zeros(steps), np.zeros(steps)])
    along = np.array([reckoned(OdometrySensor(along=0.01), state, track, k)[0] for k in range(300)])
    assert along.std() == pytest.approx(0.01 * math.sqrt(way), rel=0.12)
    heading = [math.atan2(*reckoned(OdometrySensor(heading=1.0), state, track, k)[:1:-1]) for k in range(300)]
    assert np.degrees(heading).std() == pytest.approx(1.0 * math.sqrt(way), rel=0.12)
    spin = np.column_stack([np.zeros(steps), np.zeros(steps), np.linspace(0.0, math.pi, steps)])
    turned = [reckoned(OdometrySensor(turning=2.0), state, spin, k) for k in range(300)]
    errors = [math.remainder(math.atan2(r[3], r[2]) - math.pi, 2.0 * math.pi) for r in turned]
    assert np.degrees(errors).std() == pytest.approx(2.0 * math.sqrt(0.5), rel=0.12)


def test_the_mean_errors_of_odometry_are_shares_of_way_and_turn(state: State) -> None:
    track = np.column_stack([np.linspace(0.0, 4.0, 9), np.zeros(9), np.zeros(9)])
    assert reckoned(OdometrySensor(stretch=0.03), state, track, 0)[0] == pytest.approx(4.12)
    veering = reckoned(OdometrySensor(veer=1.5), state, track, 0)
    assert math.degrees(math.atan2(veering[3], veering[2])) == pytest.approx(6.0)
    spin = np.column_stack([np.zeros(9), np.zeros(9), np.linspace(0.0, 2.0, 9)])
    turned = reckoned(OdometrySensor(overturn=0.05), state, spin, 0)
    assert math.atan2(turned[3], turned[2]) == pytest.approx(2.1)
    assert OdometrySensor(stretch=0.02, overturn=0.01).scaled(2.0) == OdometrySensor(stretch=0.04, overturn=0.02)


def test_odometry_at_rest_does_not_drift(state: State) -> None:
    track = np.tile((1.0, 2.0, 0.3), (50, 1))
    assert reckoned(OdometrySensor(along=1.0, heading=9.0, turning=9.0), state, track, 0) == pytest.approx([0, 0, 1, 0])


def test_redwood_depths_are_multiples_of_an_eighth_of_a_disparity() -> None:
    for distance in (0.8, 2.0, 5.0):
        depth = np.full((72, 128), distance, np.float32)
        read = RedwoodDepth().apply(depth, ANYWHERE, np.random.default_rng(0))
        eighths = 8.0 * BASELINE / read
        assert np.abs(eighths - np.round(eighths)).max() < 1e-3
        error = BASELINE / read - BASELINE / distance
        offset = np.round(8.0 * BASELINE / distance) / 8.0 - BASELINE / distance
        rounded = np.round((BASELINE / distance + np.random.default_rng(1).normal(0, 1 / 36, 200_000)) * 8.0) / 8.0
        assert error.mean() == pytest.approx(rounded.mean() - BASELINE / distance, abs=0.002)
        assert error.std() == pytest.approx(rounded.std(), abs=0.002)
        assert abs(offset) <= 1 / 16
    far = RedwoodDepth().apply(np.full((4, 4), 10.0, np.float32), ANYWHERE, np.random.default_rng(0))
    assert (far == 0.0).all()
    with pytest.raises(OptionError, match="depth cameras"):
        RedwoodDepth().apply(np.ones(5, np.float32), ANYWHERE, np.random.default_rng(0))


def test_a_rim_shadows_the_farther_side() -> None:
    depth = np.array([[3.0, 3.0, 3.0, 1.0, 1.0, 3.0, 3.05, 3.1]], np.float32)
    read = RimOcclusion(step=0.2, width=2).apply(depth, ANYWHERE, np.random.default_rng(0))
    assert read.tolist() == [[3.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, depth[0, 7]]]


def test_dropout_has_its_rate_and_quantization_its_step() -> None:
    rng, reading = np.random.default_rng(0), np.linspace(0.5, 9.0, 20_000, dtype=np.float32)
    lost = Dropout(0.1).apply(reading, ANYWHERE, rng)
    assert (lost == 0.0).mean() == pytest.approx(0.1, abs=0.01)
    assert (Dropout(1.0, None).apply(reading, ANYWHERE, rng) == np.float32(9.0)).all()
    rounded = Quantization(0.25).apply(reading, ANYWHERE, rng)
    assert np.abs(rounded / 0.25 - np.round(rounded / 0.25)).max() < 1e-5
    assert np.abs(rounded - reading).max() <= 0.125 + 1e-5


def test_actuation_errors_have_the_published_moments() -> None:
    rng = np.random.default_rng(0)
    steps = np.array([RoboThorActuation().errors(0.25, 0.0, rng) for _ in range(3000)])
    assert steps[:, 0].std() == pytest.approx(0.005, rel=0.06)
    assert (steps[:, 1] == 0.0).all()
    mean, variance = LOCOBOT["movebase"].turned_turning
    turns = np.array([LoCoBotActuation("movebase", 1.0).errors(0.0, 0.5, rng) for _ in range(400)])
    assert turns[:, 1].mean() == pytest.approx(mean, abs=0.03)
    assert turns[:, 1].std() == pytest.approx(math.sqrt(variance), rel=0.12)
    assert np.abs(turns[:, 1] - mean).max() <= 3.0 * math.sqrt(variance)
    back = np.array([LoCoBotActuation("movebase", 1.0).errors(0.0, -0.5, rng) for _ in range(200)])
    assert back[:, 1].mean() == pytest.approx(-mean, abs=0.04)


def test_the_occupancy_picture_shows_the_bench_ahead(layout: Layout) -> None:
    env = LabPointNavEnv(layout=layout, sensors=["occupancy"])
    observation, info = env.reset(seed=0, options={"pair": 0})
    picture = observation["occupancy"][:, :, 0]
    bench = layout.box("PreparationBench_1")
    x, y, yaw = info["pose"]
    for row in range(0, 64, 7):
        for column in range(0, 64, 7):
            ahead, left = (31.5 - row) * 0.1, (31.5 - column) * 0.1
            u = x + ahead * math.cos(yaw) - left * math.sin(yaw)
            v = y + ahead * math.sin(yaw) + left * math.cos(yaw)
            if not (0.1 < u < 7.9 and 0.1 < v < 5.9):
                assert picture[row, column] == 255 or 0.0 < u < 8.0
            elif abs(u - bench.x) < bench.depth / 2 - 0.1 and abs(v - bench.y) < bench.width / 2 - 0.1:
                assert picture[row, column] == 255
    assert picture[32, 32] == 0


def test_segmentation_names_the_asset_in_front(layout: Layout) -> None:
    env = LabPointNavEnv(layout=layout, sensors=["segmentation", "depth", "bumper"])
    observation, _ = env.reset(seed=0, options={"pair": 0})
    labels = observation["segmentation"].reshape(72, 128)
    assert labels[40, 64] == asset_labels()["PreparationBench"]
    assert labels[71, 64] in (BUILDING, asset_labels()["PreparationBench"])
    assert set(asset_labels()) == set(Catalog.load().names)
    assert ((observation["depth"].reshape(72, 128) < 10.0) | (labels == NOTHING)).all()
    assert observation["bumper"][0] == 0.0
    for _ in range(10):
        observation, *_, info = env.step(np.array([1.0, 0.0]))
    assert observation["bumper"][0] == float(info["collision"]) == 1.0
    assert observation in env.observation_space
