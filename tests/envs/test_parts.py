"""Sensors and noise models against closed forms."""

from __future__ import annotations

import itertools
import math
from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest

from labgym.assets import Catalog
from labgym.envs import LabPointNavEnv
from labgym.envs.parts.actuation import LOCOBOT, LoCoBotActuation, RoboThorActuation
from labgym.envs.parts.maps import BUILDING, NOTHING, asset_labels
from labgym.envs.parts.noise import BASELINE, Dropout, Gaussian, Quantization, RedwoodDepth, RimOcclusion
from labgym.envs.parts.odometry import OdometrySensor
from labgym.envs.parts.protocols import INTERFACES
from labgym.envs.parts.registry import kinds_of
from labgym.envs.state import State
from labgym.errors import OptionError
from labgym.geometry import to_local, to_world
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


def test_a_depth_image_is_that_of_the_published_simulator_pixel_by_pixel() -> None:
    depth = np.random.default_rng(1).uniform(0.4, 9.0, (12, 16)).astype(np.float32)
    depth[3:5, 4:7], depth[8:, 8:] = 0.0, 12.0
    read = RedwoodDepth(2.0).apply(depth, ANYWHERE, np.random.default_rng(0))
    errors = np.random.default_rng(0).standard_normal((3, 12, 16))
    for row in range(12):
        for column in range(16):
            y = min(max(row + 2.0 * 0.25 * errors[0, row, column], 0.0), 11.0) + 0.5
            x = min(max(column + 2.0 * 0.25 * errors[1, row, column], 0.0), 15.0) + 0.5
            true = float(depth[int(y) // 2 * 2, int(x) // 2 * 2])
            expected = 0.0
            if 0.0 < true < 10.0:
                expected = 35.13 * 8.0 / round((35.13 / true + 2.0 / 36.0 * errors[2, row, column]) * 8.0)
            assert read[row, column] == pytest.approx(expected, rel=1e-6)


def test_scaled_noise_has_its_errors_multiplied_and_its_rates_at_most_1() -> None:
    assert Gaussian(0.1, 0.2, -0.3).scaled(2.0) == Gaussian(0.2, 0.4, -0.6)
    assert Dropout(0.25).scaled(2.0).rate == 0.5
    assert Dropout(0.6).scaled(2.0).rate == RimOcclusion(rate=0.6).scaled(2.0).rate == 1.0
    assert RimOcclusion(rate=0.25).scaled(3.0).rate == 0.75
    assert Quantization(0.02).scaled(3.0).step == pytest.approx(0.06)
    assert Quantization(0.02).scaled(0.0) == Quantization(0.02)
    assert RedwoodDepth(0.5).scaled(3.0).multiplier == 1.5


def test_noise_without_arguments_is_as_documented() -> None:
    assert Gaussian() == Gaussian(0.0, 0.0, 0.0)
    assert Dropout() == Dropout(0.01, 0.0)
    assert Quantization() == Quantization(0.001)
    assert RedwoodDepth() == RedwoodDepth(1.0)
    assert RimOcclusion() == RimOcclusion(0.2, 1, 1.0, 0.0)


def test_a_seed_gives_the_noise_of_published_episodes() -> None:
    reading = np.array([[1.0, 2.0, 4.0, 1.5, 3.0]])
    draws = np.random.default_rng(7).standard_normal(reading.shape)
    noisy = Gaussian(0.1, 0.2, 0.5).apply(reading, ANYWHERE, np.random.default_rng(7))
    assert noisy == pytest.approx(reading + 0.5 + np.sqrt(0.01 + (0.2 * reading) ** 2) * draws)
    shares = np.random.default_rng(7).random(reading.shape)
    lost = Dropout(0.6, None).apply(reading, ANYWHERE, np.random.default_rng(7))
    assert (lost == np.where(shares < 0.6, 4.0, reading)).all()
    lost = RimOcclusion(0.5, 1, 0.6).apply(reading, ANYWHERE, np.random.default_rng(7))
    assert (lost == np.where([0, 1, 1, 0, 1] & (shares < 0.6), 0.0, reading)).all()


def test_a_jump_of_the_step_is_no_rim() -> None:
    depth = np.array([1.0, 1.25, 1.0, 1.3125])
    assert RimOcclusion(step=0.25).apply(depth, ANYWHERE, np.random.default_rng(0)).tolist() == [1.0, 1.25, 1.0, 0.0]


@pytest.mark.parametrize(
    "make",
    [
        lambda: Quantization(0.0), lambda: Gaussian(-0.1), lambda: Gaussian(relative=-0.1), lambda: Dropout(1.01),
        lambda: Dropout(-0.01), lambda: RedwoodDepth(-1.0), lambda: RimOcclusion(0.0), lambda: RimOcclusion(width=0),
        lambda: RimOcclusion(rate=1.01),
    ],
)  # fmt: skip
def test_noise_that_makes_no_sense_is_refused(make: Any) -> None:
    with pytest.raises(OptionError):
        make()


ALL_KINDS = [(role, kind) for role in INTERFACES for kind in kinds_of(role)]
WITH_MEMORY = {
    *(("sensor", kind) for kind in ("occupancy", "odometry", "odometry_velocity")),
    *(("ending", kind) for kind in ("rest", "limit", "stuck")),
    *(("reward term", "progress"), ("actions", "velocity"), ("actions", "slipping"), ("actions", "braking")),
}
"""Kinds of parts that keep something during an episode."""


@pytest.mark.parametrize(("role", "kind"), ALL_KINDS)
def test_parts_without_a_memory_do_not_change(role: str, kind: str) -> None:
    assert kinds_of(role)[kind].__dataclass_params__.frozen is ((role, kind) not in WITH_MEMORY)


@pytest.mark.parametrize(("role", "kind"), ALL_KINDS)
def test_the_kind_of_a_part_is_no_argument_and_its_noise_may_be_plain_data(role: str, kind: str) -> None:
    part_class = kinds_of(role)[kind]
    assert [one.init for one in fields(part_class) if one.name == "kind"] == [False]
    if role == "sensor" and "noise" in part_class.__dataclass_fields__:
        assert part_class(noise={"kind": "gaussian", "sigma": 0.1}).noise == (Gaussian(0.1),)


def test_odometry_adds_increments_in_its_own_frame_with_errors_in_a_fixed_order(state: State) -> None:
    errors = {"along": 0.1, "heading": 5.0, "turning": 20.0, "stretch": 0.05, "veer": 3.0, "overturn": 0.1}
    sensor, rng, draws = OdometrySensor(**errors), np.random.default_rng(3), np.random.default_rng(3)
    poses = [(0.0, 0.0, 0.4), (0.3, 0.2, 0.7), (0.5, 0.5, -0.2), (0.6, 0.4, -0.4)]
    sensor.reset(replace(state, pose=poses[0]), rng)
    x = y = yaw = 0.0
    for before, after in itertools.pairwise(poses):
        sensor.reading(replace(state, pose=after, slip=1.5), rng)
        ahead, left = to_local([after[:2]], before)[0]
        way, turn, (first, second, third) = (
            math.hypot(ahead, left),
            after[2] - before[2],
            1.5 * draws.standard_normal(3),
        )
        driven = 1.05 * ahead + 0.1 * math.sqrt(way) * first
        dx, dy = to_world([(driven, left)], (0.0, 0.0, yaw))[0]
        x, y = x + dx, y + dy
        yaw += 1.1 * turn + math.radians(3.0 * ahead + 5.0 * math.sqrt(way) * second)
        yaw += math.radians(20.0) * math.sqrt(abs(turn) / (2.0 * math.pi)) * third
        assert sensor.reckoned == pytest.approx((x, y, yaw))
