"""The mapless stack: what it learns of a floor by its lidar, and its drives."""

import math

import numpy as np
import pytest

from labgym.envs.labnav.task import TaskProperties
from labgym.envs.sensors import LIDAR_RAYS, RANGE
from labgym.errors import LabgymError
from labgym.geometry import OrientedBox, compose, to_world, wrap_angle
from labgym.policies import EpisodeStart
from labgym.policies.distance_field import DistanceField
from labgym.policies.dwa import lidar_points
from labgym.policies.stack.docking import FrontEstimate
from labgym.policies.stack.mapless import LOOK_STEPS, MaplessStackPolicy
from labgym.policies.stack.old_map import ray_lengths
from labgym.policies.stack.oracle import MaplessOraclePolicy
from labgym.policies.stack.seen_floor import STANDING_RETURNS, PaneReturns, SeenFloor

ROOM = (
    OrientedBox(0.0, 4.1, 8.4, 0.2),
    OrientedBox(0.0, -4.1, 8.4, 0.2),
    OrientedBox(4.1, 0.0, 0.2, 8.4),
    OrientedBox(-4.1, 0.0, 0.2, 8.4),
)
"""Walls of a room of 8 m x 8 m around the origin."""
PERSON = OrientedBox(2.0, 0.5, 0.4, 0.4)


def scan(pose: tuple[float, float, float], *boxes: OrientedBox) -> np.ndarray:
    """Return the ranges of a perfect lidar among boxes, (180,) meters."""
    angles = -math.pi + 2.0 * math.pi / LIDAR_RAYS * np.arange(LIDAR_RAYS) + pose[2]
    rays = np.column_stack([np.cos(angles), np.sin(angles)])
    return np.minimum(ray_lengths(np.tile(pose[:2], (LIDAR_RAYS, 1)), rays, boxes).min(axis=1), RANGE)


def returns(pose: tuple[float, float, float], ranges: np.ndarray) -> np.ndarray:
    return to_world(lidar_points(ranges), pose)


@pytest.fixture
def floor() -> SeenFloor:
    return SeenFloor(DistanceField.of_boxes((), (-6.0, -6.0, 6.0, 6.0)))


def test_what_enters_seen_floor_moves_and_walls_do_not(floor: SeenFloor) -> None:
    pose = (0.0, 0.0, 0.3)
    for _ in range(3):
        ranges = scan(pose, *ROOM)
        points = returns(pose, ranges)
        assert not floor.moving(pose, points).any()
        floor.observe(pose, ranges, points)
    points = returns(pose, scan(pose, *ROOM, PERSON))
    on_person = np.hypot(points[:, 0] - PERSON.x, points[:, 1] - PERSON.y) < 0.35
    assert on_person.sum() >= 3
    np.testing.assert_array_equal(floor.moving(pose, points), on_person)


def test_what_stays_is_a_thing(floor: SeenFloor) -> None:
    pose = (0.0, 0.0, 0.0)
    empty = scan(pose, *ROOM)
    floor.observe(pose, empty, returns(pose, empty))
    ranges = scan(pose, *ROOM, PERSON)
    points = returns(pose, ranges)
    moved = []
    for _ in range(STANDING_RETURNS + 1):
        moved.append(bool(floor.moving(pose, points).any()))
        floor.observe(pose, ranges, points)
    assert moved == [True] * STANDING_RETURNS + [False]
    # Once rays have passed the place again, the next one there moves.
    floor.observe(pose, empty, returns(pose, empty))
    assert floor.moving(pose, points).any()


def test_what_was_never_seen_does_not_move(floor: SeenFloor) -> None:
    pose = (0.0, 0.0, 0.0)
    shelf = OrientedBox(1.5, 0.0, 0.2, 2.0)
    ranges = scan(pose, *ROOM, shelf)
    floor.observe(pose, ranges, returns(pose, ranges))
    # From beside the shelf the robot sees what is behind it for the first time.
    behind = (1.5, 1.6, 0.0)
    points = returns(behind, scan(behind, *ROOM, shelf, OrientedBox(2.6, 0.0, 0.4, 0.4)))
    hidden = np.hypot(points[:, 0] - 2.6, points[:, 1]) < 0.35
    assert hidden.any()
    assert not floor.moving(behind, points)[hidden].any()


def test_a_pane_is_where_a_ray_ended_and_others_pass() -> None:
    panes = PaneReturns()
    pane, here, aside = (1.5, 0.0), (0.0, 0.0, 0.0), (0.2, 1.0, 0.0)
    ranges = scan(here, *ROOM)
    ranges[LIDAR_RAYS // 2] = 1.5
    found, _ = panes.observe(here, ranges, returns(here, ranges))
    assert len(found) == 0
    found, origins = panes.observe(aside, scan(aside, *ROOM), returns(aside, scan(aside, *ROOM)))
    assert len(found) == 1
    np.testing.assert_allclose(found[0], pane, atol=1e-9)
    np.testing.assert_allclose(origins[0], here[:2])


def test_corners_and_walls_are_no_panes() -> None:
    panes = PaneReturns()
    box = OrientedBox(1.5, 0.0, 0.6, 0.8, 0.4)
    for k in range(60):
        angle = 2.0 * math.pi * k / 60.0
        pose = (1.5 + 1.6 * math.cos(angle), 1.6 * math.sin(angle), angle)
        ranges = scan(pose, *ROOM, box)
        found, _ = panes.observe(pose, ranges, returns(pose, ranges))
        assert len(found) == 0, k


def start(goal: tuple[float, float], **task: bool) -> EpisodeStart:
    return EpisodeStart(goal, np.random.default_rng(0), task=TaskProperties(rests=True, **task))


def observation(pose: tuple[float, float, float], ranges: np.ndarray) -> dict[str, np.ndarray]:
    return {"odometry": np.array(pose), "lidar": ranges, "velocity": np.zeros(2), "goal": np.zeros(2)}


def test_it_plans_round_what_it_sees_and_straight_through_what_it_does_not() -> None:
    policy = MaplessStackPolicy()
    policy.reset(start((3.0, 0.0)))
    policy.act(observation((0.0, 0.0, 0.0), np.full(LIDAR_RAYS, RANGE)))
    path = policy.planned_path()
    assert path is not None
    assert np.abs(path[:, 1]).max() < 0.06
    wall = OrientedBox(1.5, 0.0, 0.2, 2.0)
    policy.reset(start((3.0, 0.0)))
    policy.act(observation((0.0, 0.0, 0.0), scan((0.0, 0.0, 0.0), wall)))
    path = policy.planned_path()
    assert path is not None
    crossing = path[np.abs(path[:, 0] - 1.5) < 0.1]
    assert np.abs(crossing[:, 1]).min() > 1.2


def test_scan_matching_keeps_the_pose_where_wheels_and_lidar_err() -> None:
    policy, rng = MaplessStackPolicy(), np.random.default_rng(7)
    policy.reset(start((3.0, 3.0), drift=True))
    at = true = odometry = (0.0, 0.0, 0.0)
    for _ in range(200):
        ranges = scan(true, *ROOM, OrientedBox(-1.0, 2.0, 0.8, 0.5, 0.3))
        policy.act(observation(odometry, np.clip(ranges + rng.normal(0.0, 0.05, LIDAR_RAYS), 0.0, RANGE)))
        at = true
        # A circle of 0.6 m, whose odometry turns too little by a tenth and errs along the way.
        true = compose(true, (0.06, 0.0, 0.1))
        odometry = compose(odometry, (0.06 * (1.0 + 0.1 * float(rng.normal())), 0.0, 0.09))
    assert abs(wrap_angle(odometry[2] - true[2])) > 1.0
    assert math.dist(policy.pose[:2], at[:2]) < 0.15
    assert abs(wrap_angle(policy.pose[2] - at[2])) < 0.05


@pytest.mark.parametrize(("closer", "turn"), [(0.0, 0.0), (0.12, 0.0), (-0.10, 0.0), (0.05, 0.14), (-0.05, -0.10)])
def test_the_front_of_a_station_tells_distance_and_heading(closer: float, turn: float) -> None:
    """The docking pose is 0.6 m before the middle of the front of a cabinet 0.7 m deep, turned about its middle."""
    announced, rng = (1.0, 0.0, 0.0), np.random.default_rng(3)
    middle = compose(announced, (0.95 - closer, 0.0, turn))
    cabinet = OrientedBox(middle[0], middle[1], 0.7, 1.2, middle[2])
    true = compose(middle, (-0.95, 0.0, 0.0))
    front = FrontEstimate(announced)
    assert front.goal == pytest.approx(announced)
    for k in range(12):
        pose = (0.1 * k - 0.5, 0.3 - 0.02 * k, 0.1)
        front.observe(pose, np.clip(scan(pose, *ROOM, cabinet) + rng.normal(0.0, 0.03, LIDAR_RAYS), 0.0, RANGE))
    assert front.goal == pytest.approx(true, abs=0.015)


def test_without_a_front_the_announced_pose_holds() -> None:
    front = FrontEstimate((0.0, 0.0, 0.0))
    front.observe((-0.5, 0.0, 0.0), scan((-0.5, 0.0, 0.0), *ROOM))
    assert front.goal == pytest.approx((0.0, 0.0, 0.0))


def test_it_looks_who_moves_before_it_sets_off_among_people() -> None:
    for peopled, rests in ((True, LOOK_STEPS), (False, 0)):
        policy = MaplessStackPolicy()
        policy.reset(start((3.0, 0.0), people=peopled))
        seen = observation((0.0, 0.0, 0.0), scan((0.0, 0.0, 0.0), *ROOM))
        actions = [policy.act(seen) for _ in range(LOOK_STEPS + 1)]
        at_rest = [not action.any() for action in actions]
        assert sum(at_rest) == rests
        assert not at_rest[-1]


def test_the_next_goal_has_the_errors_of_the_odometry() -> None:
    policy = MaplessStackPolicy()
    policy.reset(start((3.0, 0.0), drift=True))
    policy.act(observation((2.0, 0.0, math.pi / 2.0), scan((2.0, 0.0, math.pi / 2.0), *ROOM)))
    policy.next_goal(start((1.0, 0.0), drift=True))
    policy.act(observation((0.0, 0.0, 0.0), np.full(LIDAR_RAYS, RANGE)))
    path = policy.planned_path()
    assert path is not None
    np.testing.assert_allclose(path[-1], (2.0, 1.0), atol=0.05)


def test_the_oracle_sees_exactly_what_is_in_sight() -> None:
    policy = MaplessOraclePolicy()
    with pytest.raises(LabgymError, match="needs the world"):
        policy.reset(start((3.0, 0.0)))
    policy._boxes = list(ROOM)
    ranges = policy._true_ranges((1.0, 0.0, 0.0))
    assert ranges[LIDAR_RAYS // 2] == pytest.approx(3.0)
    assert ranges[LIDAR_RAYS // 4] == pytest.approx(4.0)
    assert ranges[0] == pytest.approx(5.0)
