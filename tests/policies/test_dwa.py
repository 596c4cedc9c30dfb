from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from laboratories import island_laboratory

from labgym.eval import evaluate
from labgym.layouts import Layout
from labgym.policies import EpisodeStart, make_policy
from labgym.policies.dwa import arc_clearance, dynamic_window, heading_error, lidar_points, stopping_speed
from labgym.policies.via_point import ViaPoints, straight_clearance

RADIUS = 0.3


def one(v: float, w: float, *points: tuple[float, float]) -> float:
    return float(arc_clearance(np.array([v]), np.array([w]), np.array(points).reshape(-1, 2), RADIUS)[0])


def wall(x: float, y0: float, y1: float) -> np.ndarray:
    ys = np.arange(y0, y1 + 1e-9, 0.05)
    return np.column_stack([np.full(len(ys), x), ys])


def test_the_clearance_straight_ahead_is_the_distance_less_the_radius():
    assert one(1.0, 0.0, (2.0, 0.0)) == pytest.approx(1.7)
    assert one(0.5, 0.0, (2.0, 0.1)) == pytest.approx(2.0 - math.sqrt(0.09 - 0.01))
    assert one(1.0, 0.0, (2.0, 0.31)) == math.inf
    assert one(1.0, 0.0, (-1.0, 0.0)) == math.inf
    assert one(1.0, 0.0) == math.inf


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_on_a_circle_a_point_on_it_is_touched_a_chord_early(sense):
    quarter = one(1.0, sense, (1.0, sense))
    assert quarter == pytest.approx(math.pi / 2.0 - 2.0 * math.asin(RADIUS / 2.0))
    assert one(0.5, sense, (1.0, sense)) == math.inf


def test_a_turn_in_place_meets_nothing():
    assert one(0.0, 1.0, (0.31, 0.0)) == math.inf


def test_a_touching_point_blocks_only_motion_towards_it():
    assert one(0.5, 0.0, (0.29, 0.0)) == 0.0
    assert one(0.5, 0.0, (-0.29, 0.0)) == math.inf


@settings(max_examples=60, deadline=None)
@given(v=st.floats(0.05, 1.0), w=st.floats(-1.5, 1.5), x=st.floats(-2, 2), y=st.floats(-2, 2))
def test_the_clearance_along_an_arc_is_that_of_a_disc_moved_in_small_steps(v, w, x, y):
    if math.hypot(x, y) <= RADIUS + 0.01 or 0.0 < abs(w) < 0.05:
        return
    time = np.arange(0.0, min(2.0 * math.pi / abs(w), 12.0) if w else 12.0, 0.0005)
    cx, cy = (v * time, 0.0 * time) if w == 0 else (v / w * np.sin(w * time), v / w * (1.0 - np.cos(w * time)))
    away = np.hypot(cx - x, cy - y)
    hits = np.flatnonzero(away < RADIUS)
    free = one(v, w, (x, y))
    if len(hits):
        assert free == pytest.approx(v * time[hits[0]], abs=0.05 if away.min() > RADIUS - 0.002 else 0.002)
    elif away.min() > RADIUS + 0.001:
        assert free == math.inf or free > v * time[-1] - 0.01


@given(v=st.floats(0.0, 1.0), w=st.floats(-1.5, 1.5))
def test_the_window_holds_the_velocities_that_the_accelerations_allow_within_the_limits(v, w):
    vs, ws = dynamic_window(v, w, (5, 9))
    assert len(vs) == len(ws) == 45
    assert vs.min() == pytest.approx(max(0.0, v - 0.15))
    assert vs.max() == pytest.approx(min(1.0, v + 0.15))
    assert ws.min() == pytest.approx(max(-1.5, w - 0.4))
    assert ws.max() == pytest.approx(min(1.5, w + 0.4))
    assert bool((ws == 0.0).any()) is (abs(w) <= 0.4)


@given(distance=st.floats(0.0, 20.0), braking=st.floats(0.2, 3.0), delay=st.floats(0.0, 0.5))
def test_an_admissible_speed_stops_right_at_the_obstacle(distance, braking, delay):
    v = float(stopping_speed(np.array([distance]), braking, delay)[0])
    assert v >= -1e-12
    assert v * delay + v**2 / (2.0 * braking) == pytest.approx(distance, abs=1e-9)


def test_without_delay_the_admissible_speed_is_the_papers():
    assert stopping_speed(np.array([0.5, math.inf]), 1.0, 0.0) == pytest.approx([1.0, math.inf])


def test_the_heading_error_vanishes_on_the_way_to_the_target_and_is_half_a_turn_behind():
    ahead, behind = (heading_error(np.array([0.5]), np.array([0.0]), (x, 0.0), 0.6)[0] for x in (3.0, -3.0))
    assert ahead == pytest.approx(0.0)
    assert behind == pytest.approx(math.pi)
    left = heading_error(np.array([0.0, 0.0]), np.array([1.0, -1.0]), (0.0, 3.0), 0.6)
    assert left == pytest.approx([math.pi / 2.0 - 0.6, math.pi / 2.0 + 0.6])


def test_the_heading_error_is_taken_at_the_end_of_the_arc():
    quarter_circle = heading_error(np.array([1.0]), np.array([math.pi / 2.0]), (2.0 / math.pi, 5.0), 1.0)
    assert quarter_circle == pytest.approx([0.0], abs=1e-9)


def test_standing_before_a_wall_it_turns_to_the_target_rather_than_stay():
    policy = make_policy("dwa")
    policy.reset(EpisodeStart(goal=(0.0, 3.0), rng=np.random.default_rng(0)))
    ranges = np.full(180, 10.0, dtype=np.float32)
    angles = -math.pi + 2.0 * math.pi / 180 * np.arange(180)
    facing = np.abs(angles) < 1.0
    ranges[facing] = 0.32 / np.cos(angles[facing])
    seen = {"lidar": ranges, "velocity": np.zeros(2, np.float32)}
    _, turn = policy.act({**seen, "odometry": np.array([0.0, 0.0, 0.8])})
    assert turn > 0.0


def test_it_backs_off_when_something_blocks_it():
    policy = make_policy("dwa")
    policy.reset(EpisodeStart(goal=(3.0, 0.0), rng=np.random.default_rng(0)))
    seen = {"lidar": np.full(180, 10.0, np.float32), "velocity": np.zeros(2, np.float32), "odometry": np.zeros(3)}
    forward = [policy.act(seen)[0] for _ in range(8)]
    assert forward[0] > 0.0
    assert min(forward) == -1.0


def test_returns_lie_where_the_lidars_rays_end():
    ranges = np.full(180, 10.0)
    ranges[[0, 45, 90, 135]] = 1.0, 2.0, 3.0, 4.0
    expected = np.array([[-1.0, 0.0], [0.0, -2.0], [3.0, 0.0], [0.0, 4.0]])
    assert lidar_points(ranges) == pytest.approx(expected, abs=1e-12)


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_straight_clearance_is_where_a_swept_disc_first_touches(seed):
    rng = np.random.default_rng(seed)
    points = rng.uniform(-3.0, 3.0, (6, 2))
    start, angle = rng.uniform(-1.0, 1.0, 2), rng.uniform(-math.pi, math.pi)
    heading = np.array([math.cos(angle), math.sin(angle)])
    if np.linalg.norm(points - start, axis=1).min() < RADIUS:
        return
    free = float(straight_clearance(start[None], heading[None], points, RADIUS)[0])
    cloud = shapely.MultiPoint(points)
    reach = min(free, 20.0)
    assert shapely.LineString([start, start + reach * heading]).distance(cloud) >= RADIUS - 1e-6
    if free < 20.0:
        assert shapely.LineString([start, start + (free + 0.01) * heading]).distance(cloud) < RADIUS


def test_the_target_is_the_goal_if_the_way_is_open():
    assert ViaPoints((4.0, 1.0)).target(wall(2.0, 1.5, 3.0), (0.0, 0.0, 0.0), RADIUS) == (4.0, 1.0)


@pytest.mark.parametrize("pose", [(0.0, 0.0, 0.0), (0.3, -0.2, 1.0)])
def test_behind_a_wall_the_via_point_is_at_its_nearer_end(pose):
    fixed = wall(2.0, -3.0, 1.0)
    cosine, sine = math.cos(pose[2]), math.sin(pose[2])
    seen = (fixed - pose[:2]) @ np.array([[cosine, -sine], [sine, cosine]])
    via = ViaPoints((4.0, 0.0)).target(seen, pose, RADIUS)
    way = shapely.LineString([pose[:2], via, (4.0, 0.0)])
    assert way.distance(shapely.MultiPoint(fixed)) >= RADIUS - 1e-6
    assert via[1] > 1.0
    assert way.length < 5.5


def test_a_via_point_is_kept_while_it_is_useful():
    choice = ViaPoints((4.0, 0.0))
    fixed = wall(2.0, -1.5, 1.5)
    first = choice.target(fixed, (0.0, 0.0, 0.0), RADIUS)
    side = math.copysign(1.0, first[1])
    nudged = (0.0, -0.1 * side, 0.0)
    assert choice.target(fixed - nudged[:2], nudged, RADIUS) == first


def test_in_a_dead_end_the_target_is_the_farthest_open_point():
    ring = 4.0 * np.column_stack([np.cos(np.arange(0, 6.28, 0.05)), np.sin(np.arange(0, 6.28, 0.05))])
    ring = ring[(np.abs(ring[:, 1]) > 0.5) | (ring[:, 0] > 0.0)]
    box = np.concatenate([ring, wall(1.0, -3.0, 3.0)])
    x, y = ViaPoints((20.0, 0.0)).target(box, (0.0, 0.0, 0.0), RADIUS)
    assert x == pytest.approx(-6.0)
    assert y == pytest.approx(0.0, abs=0.5)


@pytest.fixture(scope="module")
def layout() -> Layout:
    return island_laboratory()


def test_a_course_around_an_island_is_driven_to_the_goal_the_same_way_each_time(layout):
    report = evaluate("dwa", [layout], progress=False)
    assert report["success"] == 1.0
    assert report["contacts_per_meter"] == 0.0
    assert not report.summary.privileged
    assert evaluate("dwa", [layout], progress=False).routes == report.routes
