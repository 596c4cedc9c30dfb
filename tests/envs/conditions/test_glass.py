"""Glass: what lidar and camera read of a pane in closed form, shares of outcomes, and panes across routes."""

from __future__ import annotations

import copy
import math
import pickle

import gymnasium as gym
import numpy as np
import pytest
from condition_tasks import POSE, Fixed
from laboratories import island_laboratory
from scipy.stats import chisquare, kstest

import labgym  # noqa: F401 -- registers the ids
from labgym.envs.conditions.glass import Glass, shares
from labgym.envs.conditions.panes import FRAMELESS, GlassPane, panes_of, with_panes
from labgym.envs.robot import ROBOT
from labgym.envs.tasks import Task
from labgym.errors import OptionError
from labgym.layouts import load_published, published
from labgym.navigation import PLANNING_RADIUS, shortest_path

LAYOUT = island_laboratory()


def data(panes=(), **changes):
    return {"panes": list(panes), "seed": 5, "void": 0.4, "true": 0.1, "steel": 0.3, **changes}


def make(given, **options):
    options = {"observation": "lidar", "measures": ("pose", "touched", "conditions"), "endings": (), **options}
    options = {"tasks": Fixed("glass", given), "conditions": ["glass"], **options}
    return gym.make("LabFloorNav-v0", disable_env_checker=True, **options)


def pane_ahead(distance, turn=0.0):
    x, y, _ = POSE
    return {"x": x + distance, "y": y, "yaw": math.pi / 2.0 + turn, "width": 1.2}


@pytest.mark.parametrize("exact", [False, True])
@pytest.mark.parametrize(("turn", "seen"), [(0.0, True), (math.radians(9.0), True), (math.radians(12.0), False)])
def test_a_lidar_sees_glass_near_its_normal_only(turn, seen, exact):
    env = make(data([pane_ahead(1.5, turn)]), exact=exact)
    lidar = env.reset(seed=0)[0]["lidar"]
    plain = gym.make("LabFloorNav-v0", tasks=Fixed("glass", data()), disable_env_checker=True, exact=exact)
    behind = plain.reset(seed=0)[0]["lidar"]
    assert lidar[90] == pytest.approx(1.5 - 0.015 / math.cos(turn) if seen else behind[90], abs=1e-5)
    # At 20 degrees from ahead the ray still meets the pane, at more than ten degrees from its normal.
    assert lidar[100] == pytest.approx(behind[100], abs=1e-6) or turn > 0.0
    plain.close()
    env.close()


def test_a_camera_reads_behind_void_or_glass_in_the_stated_shares():
    void = behind = true = total = 0
    for seed in range(150):
        env = make(data([pane_ahead(1.0)], seed=seed), observation="depth")
        depth = env.reset(seed=0)[0]["depth"].reshape(72, 128)
        env.close()
        middle = depth[20:50, 30:98]
        near = np.isclose(middle, 0.985 - ROBOT.camera_forward, atol=0.003)
        zero = middle == 0.0
        void, true, total = void + zero.sum(), true + near.sum(), total + middle.size
        behind += (middle > 0.9).sum()
    assert void + true + behind == total
    assert void / total == pytest.approx(0.4, abs=0.06)
    assert true / total == pytest.approx(0.1, abs=0.04)


def test_the_outcome_of_a_place_stays_while_the_robot_stands_and_within_a_patch():
    env = make(data([pane_ahead(1.0)]), observation="depth")
    first = env.reset(seed=0)[0]["depth"]
    again, *_ = env.step(np.zeros(2, np.float32))
    np.testing.assert_array_equal(first, again["depth"])
    other = make(data([pane_ahead(1.0)], seed=6), observation="depth")
    assert not np.array_equal(first, other.reset(seed=0)[0]["depth"])
    for each in (env, other):
        each.close()


def test_shares_are_uniform_and_differ_between_neighbors():
    rng = np.random.default_rng(0)
    keys = rng.integers(-40, 40, size=(20000, 6))
    drawn = shares(keys, 7)
    assert kstest(drawn, "uniform").pvalue > 0.001
    pairs = np.histogram2d(drawn, shares(keys + np.array([0, 0, 0, 0, 0, 1]), 7), bins=8)[0]
    assert chisquare(pairs.ravel()).pvalue > 0.001
    np.testing.assert_array_equal(drawn, shares(keys, 7))


def test_a_robot_touches_the_pane():
    env = make(data([pane_ahead(1.0)]))
    env.reset(seed=0)
    for _ in range(30):
        info = env.step(np.array([1.0, 0.0], np.float32))[4]
        if info["touched"]:
            break
    assert info["touched"] == ("GlassScreen_1",)
    assert info["pose"][0] == pytest.approx(POSE[0] + 1.0 - 0.015 - 0.27, abs=0.02)
    env.close()


def test_panes_lengthen_the_shortest_route_and_are_on_no_map():
    found = 0
    for name in published("floors-val")[:8]:
        layout = load_published("floors-val", name)
        from labgym.navigation import goal_pairs

        pair = max(goal_pairs(layout), key=lambda one: math.dist(one.start[:2], one.goal[:2]))
        task, glass = Task(layout, layout.protocol, pair), Glass()
        drawn = glass.draw(task, np.random.default_rng(1))
        prepared = glass.prepare(task, drawn)
        if not drawn["panes"]:
            continue
        found += 1
        before, after = (shortest_path(one, pair.start, pair.goal) for one in (layout, prepared.layout))
        assert after.length >= 1.05 * before.length
        assert prepared.old_map is layout
        assert [one.asset for one in prepared.layout.placements[len(layout.placements) :]] == ["GlassScreenFramed"]
        assert PLANNING_RADIUS == 0.3
    assert found >= 2


def test_a_layout_with_panes_survives_pickling():
    layout = with_panes(LAYOUT, [GlassPane(POSE[0] + 1.0, POSE[1], 0.3)])
    copied = pickle.loads(pickle.dumps(layout))
    assert copied.hash == layout.hash != LAYOUT.hash
    assert copied.placements[-1].asset == FRAMELESS in copied.catalog


def test_an_environment_with_glass_goes_on_after_pickling_and_copying():
    env = make(data([pane_ahead(1.0)]), observation="depth", physics="mujoco")
    env.reset(seed=0)
    env.step(np.array([0.3, 0.1], np.float32))
    others = [pickle.loads(pickle.dumps(env)), copy.deepcopy(env)]
    expected = env.step(np.array([0.3, 0.1], np.float32))[0]["depth"]
    for other in others:
        np.testing.assert_array_equal(other.step(np.array([0.3, 0.1], np.float32))[0]["depth"], expected)


@pytest.mark.parametrize(
    "value",
    [
        7,
        {"panes": []},
        data([{"x": 0.0}]),
        data([{"x": math.nan, "y": 0.0, "yaw": 0.0}]),
        data([{"x": 0.0, "y": 0.0, "yaw": 0.0, "width": 99.0}]),
        data([{"x": 0.0, "y": 0.0, "yaw": 0.0}] * 40),
        data(void=2.0),
        data(seed="x"),
    ],
)
def test_data_that_is_not_of_glass_is_refused(value):
    with pytest.raises(OptionError):
        make(value).reset(seed=0)


@pytest.mark.parametrize("arguments", [{"void": 0.9, "true": 0.2}, {"panes": -1}, {"width": 0.1}, {"width": 9.0}])
def test_arguments_out_of_range_are_refused(arguments):
    with pytest.raises(OptionError):
        Glass(**arguments)
    with pytest.raises(OptionError):
        panes_of("x")
