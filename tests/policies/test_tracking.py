from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from labgym.envs.robot import ROBOT, turn_towards
from labgym.errors import OptionError
from labgym.policies import PathTracker, TrackingOptions, velocities_to_action

STEP = 0.005


def drive(
    path: np.ndarray, start: tuple[float, float, float], steps: int = 600, near: float = 0.1, tracker=PathTracker
) -> np.ndarray:
    """Follow a path with an acceleration-limited unicycle; return rows (x, y, yaw, v, w), one a control step."""
    tracker = tracker(path)
    x, y, yaw = start
    v = w = 0.0
    rows = [(x, y, yaw, v, w)]
    for _ in range(steps):
        wanted_v, wanted_w = ROBOT.twist(*tracker.action((x, y, yaw), v))
        for _ in range(ROBOT.substeps):
            v += np.clip(wanted_v - v, -ROBOT.acceleration * STEP, ROBOT.acceleration * STEP)
            w += np.clip(wanted_w - w, -ROBOT.turn_acceleration * STEP, ROBOT.turn_acceleration * STEP)
            x, y, yaw = x + v * math.cos(yaw) * STEP, y + v * math.sin(yaw) * STEP, yaw + w * STEP
        rows.append((x, y, yaw, v, w))
        if math.dist((x, y), path[-1]) < near:
            break
    return np.array(rows)


def deviation(path: np.ndarray, driven: np.ndarray) -> float:
    line = shapely.LineString(path)
    return max(shapely.Point(x, y).distance(line) for x, y in driven[:, :2])


def arrived(path: np.ndarray, driven: np.ndarray) -> bool:
    return math.dist(driven[-1, :2], path[-1]) < 0.1


def test_a_straight_path_is_driven_straight_and_fast():
    path = np.array([[0.0, 0.0], [4.0, 0.0]])
    driven = drive(path, (0.0, 0.0, 0.0))
    assert arrived(path, driven)
    assert deviation(path, driven) < 1e-6
    assert driven[:, 3].max() == pytest.approx(ROBOT.v_max, abs=1e-6)


@pytest.mark.parametrize("yaw", [math.pi, -math.pi / 2, 2.0])
def test_it_turns_in_place_before_it_drives_the_other_way(yaw):
    path = np.array([[0.0, 0.0], [3.0, 0.0]])
    driven = drive(path, (0.0, 0.0, yaw))
    assert arrived(path, driven)
    assert deviation(path, driven) < 0.08


@pytest.mark.parametrize("angle", [30, 60, 90, 120, 150])
def test_a_sharp_corner_is_cut_by_less_than_the_planner_leaves(angle):
    bend = math.radians(angle)
    path = np.array([[0.0, 0.0], [3.0, 0.0], [3.0 + 3.0 * math.cos(bend), 3.0 * math.sin(bend)]])
    driven = drive(path, (0.0, 0.0, 0.0))
    assert arrived(path, driven)
    assert deviation(path, driven) < 0.08


@pytest.mark.parametrize("radius", [0.3, 0.5, 1.0])
def test_an_arc_is_followed_within_the_robots_margin(radius):
    angles = np.linspace(-math.pi / 2, math.pi / 2, 60)
    arc = np.column_stack([2.0 + radius * np.cos(angles), radius + radius * np.sin(angles)])
    path = np.concatenate([[[0.0, 0.0]], arc, [[0.0, 2.0 * radius]]])
    driven = drive(path, (0.0, 0.0, 0.0))
    assert arrived(path, driven)
    assert deviation(path, driven) < 0.045


def test_it_returns_to_a_path_that_it_starts_next_to():
    path = np.array([[0.0, 0.0], [5.0, 0.0]])
    driven = drive(path, (0.0, 0.4, 0.0))
    assert arrived(path, driven)
    assert abs(driven[driven[:, 0] > 2.0][:, 1]).max() < 0.03


def test_a_loop_that_crosses_itself_is_driven_in_order():
    path = np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 2.0], [1.5, 2.0], [1.5, -2.0]])
    driven = drive(path, (0.0, 0.0, 0.0))
    assert arrived(path, driven)
    assert deviation(path, driven) < 0.08
    assert shapely.LineString(driven[:, :2]).length > 0.95 * shapely.LineString(path).length


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_any_path_with_room_between_its_corners_is_driven_to_its_end(seed):
    rng = np.random.default_rng(seed)
    turns = np.cumsum(rng.uniform(-2.2, 2.2, 5))
    lengths = rng.uniform(1.0, 2.5, 5)
    pieces = lengths[:, None] * np.column_stack([np.cos(turns), np.sin(turns)])
    path = np.concatenate([[[0.0, 0.0]], np.cumsum(pieces, axis=0)])
    driven = drive(path, (0.0, 0.0, float(rng.uniform(-3.0, 3.0))))
    assert arrived(path, driven)
    assert deviation(path, driven) < 0.15


@pytest.mark.parametrize("v, w", [(0.0, 0.0), (1.0, 1.5), (-0.3, -1.5), (0.4, -0.2), (-0.1, 0.7)])
def test_an_action_is_the_inverse_of_the_robots_twist(v, w):
    assert ROBOT.twist(*velocities_to_action(v, w)) == pytest.approx((v, w))


def test_velocities_beyond_the_limits_are_clipped():
    assert velocities_to_action(5.0, -9.0) == pytest.approx([1.0, -1.0])
    assert velocities_to_action(-5.0, 9.0) == pytest.approx([-1.0, 1.0])


def test_turning_goes_the_short_way():
    assert turn_towards(3.0)[1] > 0.0
    assert turn_towards(-3.0)[1] < 0.0
    assert turn_towards(2.0 * math.pi - 0.5)[1] < 0.0
    assert turn_towards(0.7)[0] == 0.0


@pytest.mark.parametrize("path", [[], [[0.0, 1.0, 2.0]], [[math.nan, 0.0]], [1.0, 2.0]])
def test_an_invalid_path_is_refused(path):
    with pytest.raises(OptionError, match="path"):
        PathTracker(path)


def test_a_path_of_one_point_is_reached():
    path = np.array([[0.3, 0.0]])
    assert arrived(path, drive(path, (0.0, 0.0, 0.0)))


def test_the_tracker_returns_its_path():
    corner = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.5]])
    path = PathTracker(corner).path
    assert path[0] == pytest.approx([0.0, 0.0])
    assert path[-1] == pytest.approx([1.0, 1.5])
    assert shapely.LineString(path).hausdorff_distance(shapely.LineString(corner)) < 0.02
    assert np.linalg.norm(np.diff(path, axis=0), axis=1).max() <= 0.02 + 1e-9


@pytest.mark.parametrize("heading", [None, 0.0, 2.5, -3.0])
@pytest.mark.parametrize("path", [[[0.0, 0.0], [2.0, 0.0]], [[0.0, 0.0], [1.5, 0.0], [1.5, -1.5]], [[0.3, 0.0]]])
def test_the_tracker_ends_at_rest_at_its_end_and_heading(path, heading):
    class Ending(PathTracker):
        def __init__(self, points):
            super().__init__(points, options=TrackingOptions(rest=True), heading=heading)

    path = np.array(path)
    rows = drive(path, (0.0, 0.0, 0.0), steps=150, near=0.0, tracker=Ending)
    x, y, yaw, v, w = rows[-1]
    assert math.dist((x, y), path[-1]) < 0.02
    assert (abs(v), abs(w)) < (0.001, 0.01)
    assert heading is None or abs(math.remainder(yaw - heading, 2.0 * math.pi)) < 0.01
