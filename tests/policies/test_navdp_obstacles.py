"""The obstacles that the NavDP-style policy has seen: the map, the veto, the check of the next steps, the guidance."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import torch

from labgym.envs.robot import ROBOT
from labgym.eval.driving.drive import drive_pair
from labgym.geometry import to_world
from labgym.layouts import load_published
from labgym.navigation import OccupancyGrid
from labgym.policies import EpisodeStart
from labgym.policies.distance_field import DistanceField
from labgym.policies.kernels import runs_pinned
from labgym.policies.navdp.diffusion import Guidance
from labgym.policies.navdp.policy import DrawnTrajectories, NavDPPolicy
from labgym.policies.navdp.seen_obstacles import SeenObstacles, braking_way, checked_velocities, clear_ways

SIDE, CELL = 120, 0.05
LENS = ROBOT.camera_forward
NOTHING = np.full((72, 128), 10.0, np.float32)


def wall_ahead(distance: float) -> np.ndarray:
    """Depth of a wall that fills the view."""
    return np.full((72, 128), distance, np.float32)


def around_cells(*cells: tuple[int, int]) -> DistanceField:
    """Clearance on a square of 6 m with the robot's place (0, 0) in the middle; cells are (row, column)."""
    occupied = np.zeros((SIDE, SIDE), dtype=bool)
    for cell in cells:
        occupied[cell] = True
    return DistanceField.of_cells(OccupancyGrid(occupied, CELL, (-SIDE * CELL / 2.0, -SIDE * CELL / 2.0)), 3.0)


def wall_from(x: float) -> DistanceField:
    """Clearance of a wall whose near face is at x, to the edge of the square."""
    first = round((x + SIDE * CELL / 2.0) / CELL)
    return around_cells((slice(None), slice(first, None)))


def straight(length: float, bearing: float = 0.0, y: float = 0.0) -> np.ndarray:
    along = np.linspace(0.0, length, 25)[:, None]
    return (along * [math.cos(bearing), math.sin(bearing)] + [0.0, y])[None]


# The map


def test_an_obstacle_counts_after_it_has_left_the_view() -> None:
    seen = SeenObstacles()
    seen.add(wall_ahead(1.0), (0.0, 0.0, math.pi / 2.0))
    for step in range(20):
        seen.add(NOTHING, (0.02 * step, 0.0, 0.0))
    places = np.array([[0.0, 0.0], [0.1, 0.3], [0.0, 0.7]])
    expected = 1.0 + LENS - places[:, 1]
    np.testing.assert_allclose(seen.around((0.0, 0.0), 2.0).at(places), expected, atol=0.06)


def test_the_map_follows_the_robot_and_forgets_what_is_far_behind() -> None:
    seen = SeenObstacles()
    seen.add(wall_ahead(2.0), (0.0, 0.0, math.pi))
    seen.add(wall_ahead(1.0), (9.0, 0.0, math.pi / 2.0))
    for x in range(9, 29):
        seen.add(NOTHING, (float(x), 0.0, 0.0))
    # The wall at x = 9 is 19 m behind the robot, the one at x = -2.2 more than 20 m.
    assert seen.around((9.0, 0.0), 2.0).at(np.array([9.0, 0.5])) == pytest.approx(0.5 + LENS, abs=0.06)
    seen.add(NOTHING, (40.0, 0.0, 0.0))
    assert seen.around((20.0, 0.0), 1.0).at(np.array([20.0, 0.0])) == pytest.approx(1.0)
    seen.add(wall_ahead(1.5), (40.0, 0.0, 0.0))
    assert seen.around((40.0, 0.0), 2.0).at(np.array([40.0, 0.0])) == pytest.approx(1.5 + LENS, abs=0.06)


def test_clearance_is_the_distance_to_the_nearest_cell_and_negative_inside() -> None:
    rng = np.random.default_rng(0)
    occupied = rng.random((30, 40)) < 0.03
    grid = OccupancyGrid(occupied, CELL, (1.0, -2.0))
    clearance = DistanceField.of_cells(grid, 5.0)
    xs, ys = grid.centres()
    for row, column in [(0, 0), (7, 31), (29, 39), (15, 20), (22, 3)]:
        apart = np.hypot(xs[None, :] - xs[column], ys[:, None] - ys[row])
        nearest = apart[occupied].min() - CELL / 2.0
        inside = -(apart[~occupied].min() - CELL / 2.0)
        value = inside if occupied[row, column] else nearest
        assert clearance.at(np.array([xs[column], ys[row]])) == pytest.approx(value, abs=1e-5)


def test_the_slope_is_the_derivative_of_the_clearance() -> None:
    clearance = around_cells((50, 70), (60, 30), (slice(80, 90), slice(80, 90)))
    points = np.random.default_rng(1).uniform(-2.0, 2.0, (50, 2))
    h = 1e-7
    for axis in range(2):
        step = h * np.eye(2)[axis]
        measured = (clearance.at(points + step) - clearance.at(points - step)) / (2.0 * h)
        np.testing.assert_allclose(clearance.with_gradient(points)[1][:, axis], measured, atol=1e-5)


def test_a_map_without_obstacles_is_free_as_far_as_it_reaches() -> None:
    assert SeenObstacles().around((0.0, 0.0), 2.0).at(np.array([0.3, 0.1])) == 2.0


# The veto


@pytest.mark.parametrize("radius", [0.27, 0.36])
def test_a_way_is_clear_if_the_disc_passes_the_cell(radius: float) -> None:
    clearance = around_cells((60, 80))  # From (1.00, 0.00) to (1.05, 0.05).
    for y, clear in [(0.05 + radius + 0.02, True), (0.05 + radius - 0.02, False), (-radius - 0.02, True)]:
        assert clear_ways(straight(2.0, y=y), clearance, radius, 2.0).tolist() == [clear], y


def test_only_the_first_meters_of_a_way_are_checked() -> None:
    clearance = wall_from(1.5)
    ways = np.concatenate([straight(length) for length in (1.0, 1.3, 3.0)])
    assert clear_ways(ways, clearance, 0.30, 3.0).tolist() == [True, False, False]
    assert clear_ways(ways, clearance, 0.30, 1.0).tolist() == [True, True, True]


def test_a_robot_that_stands_too_near_may_leave_but_not_come_nearer() -> None:
    clearance = wall_from(0.20)
    away, along, towards = straight(1.0, math.pi), straight(1.0, math.pi / 2.0), straight(0.15)
    assert clear_ways(np.concatenate([away, along, towards]), clearance, 0.30, 1.0).tolist() == [True, True, False]


def test_a_thin_obstacle_between_two_points_of_a_way_is_noticed() -> None:
    clearance = around_cells((slice(None), 80))
    assert clear_ways(np.array([[[0.0, 0.0], [2.5, 0.0]]]), clearance, 0.0, 2.5).tolist() == [False]


# The next control steps


def test_the_braking_way_is_that_of_the_limits() -> None:
    way = braking_way((1.0, 0.0), (1.0, 0.0), (0.0, 0.0, 0.0), ROBOT)
    assert way[-1, 0] == pytest.approx(0.1 + 1.0 / (2.0 * ROBOT.acceleration), abs=0.05)
    assert (np.diff(way[:, 0]) >= 0.0).all()
    assert way[:, 1].tolist() == [0.0] * len(way)
    turning = braking_way((0.5, 1.0), (0.5, 1.0), (0.0, 0.0, 0.0), ROBOT)
    # A robot that drives and turns evenly is on a circle of radius v / w until it brakes.
    assert np.hypot(turning[2, 0], turning[2, 1] - 0.5) == pytest.approx(0.5, abs=0.01)


def test_a_robot_that_turns_the_other_way_is_expected_to_swerve() -> None:
    way = braking_way((0.6, 1.2), (0.6, -1.2), (0.0, 0.0, 0.0), ROBOT)
    assert way[:, 1].min() < -0.01


@pytest.mark.parametrize("gap, least, most", [(0.10, 0.0, 0.0), (0.30, 0.25, 0.75), (0.60, 1.0, 1.0)])
def test_the_robot_slows_down_in_time_for_a_wall(gap: float, least: float, most: float) -> None:
    clearance = wall_from(0.30 + gap)
    v, w = checked_velocities((1.0, 0.2), (0.8, 0.0), (0.0, 0.0, 0.0), clearance, 0.30, ROBOT)
    assert least <= v <= most
    assert w == pytest.approx(0.2 * v if v > 0.0 else 0.2)
    if v > 0.0:
        assert braking_way((v, w), (0.8, 0.0), (0.0, 0.0, 0.0), ROBOT)[-1, 0] <= gap + 0.05


def test_turning_in_place_and_driving_backwards_are_not_slowed_down() -> None:
    clearance = wall_from(0.30)
    for wanted in [(0.0, 1.5), (-0.3, 0.0)]:
        assert checked_velocities(wanted, (0.0, 0.0), (0.0, 0.0, 0.0), clearance, 0.30, ROBOT) == wanted


def test_a_robot_that_cannot_stop_in_time_brakes_and_turns_as_wanted() -> None:
    clearance = wall_from(0.35)
    assert checked_velocities((1.0, 0.7), (1.0, 0.0), (0.0, 0.0, 0.0), clearance, 0.30, ROBOT) == (0.0, 0.7)


# Guidance


def guidance(clearance: DistanceField, pose: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Guidance:
    return Guidance(clearance, pose, margin=0.45, scale=4.0, last=4)


def steps_to(end: tuple[float, float]) -> torch.Tensor:
    """Even steps (1, 24, 3) to a place in the robot frame, with a turn in the third column."""
    return torch.tensor([4.0 * end[0] / 24, 4.0 * end[1] / 24, 0.1]).expand(1, 24, 3)


def test_the_push_is_the_negative_gradient_of_the_cost() -> None:
    pose = (0.4, -0.3, 0.8)
    guide = guidance(around_cells((slice(60, 64), slice(80, 86)), (75, 66)), pose)
    points = np.random.default_rng(2).uniform(-0.5, 1.5, (2, 24, 2))

    def cost(places: np.ndarray) -> np.ndarray:
        there = to_world(places.reshape(-1, 2), pose)
        return 0.5 * np.maximum(0.45 - guide.clearance.at(there), 0.0).reshape(2, 24) ** 2

    h = 1e-6
    for axis in range(2):
        step = h * np.eye(2)[axis]
        measured = (cost(points - step) - cost(points + step)) / (2.0 * h)
        np.testing.assert_allclose(guide.push(points)[..., axis], measured, atol=1e-4)
    assert np.abs(guide.push(points)).max() > 0.05


def test_guided_trajectories_leave_the_obstacle_and_keep_their_turns() -> None:
    guide = guidance(around_cells((slice(58, 61), slice(84, 88))))
    steps = steps_to((2.4, 0.0))
    before, after = steps, steps
    for _ in range(guide.last):
        after = guide.guided(after)
    nearest = [
        guide.clearance.at(each[0, :, :2].numpy().astype(np.float64).cumsum(axis=0) / 4.0).min()
        for each in (before, after)
    ]
    assert nearest[0] < 0.0
    assert nearest[1] > 0.20
    assert after.abs().max() <= 1.0
    assert torch.equal(after[..., 2], before[..., 2])
    assert after.dtype == before.dtype


def test_guidance_far_from_obstacles_changes_nothing() -> None:
    steps = steps_to((2.0, 0.5))
    torch.testing.assert_close(guidance(around_cells()).guided(steps), steps, atol=1e-6, rtol=0.0)


# The policy

OFF = {"veto": [], "guided": 0, "check": [], "settled": None}
"""The policy without the parts that were added to the trained network."""


def view(depth: np.ndarray, pose: tuple[float, float, float], bearing: float = 0.0, **motion: float) -> dict[str, Any]:
    return {
        "goal": np.array([3.0, math.cos(bearing), math.sin(bearing)], np.float32),
        "velocity": np.array([motion.get("speed", 0.0), motion.get("turning", 0.0)], np.float32),
        "odometry": np.array(pose),
        "depth": depth.ravel(),
        "rgb": np.full((72, 128, 3), 90, np.uint8),
    }


def trajectories(*ends: tuple[float, float]) -> np.ndarray:
    return np.array([np.linspace(0.0, 1.0, 25)[1:, None] * np.array(end) for end in ends])


def policy_that_draws(*draws: tuple[np.ndarray, list[float]], **options: object) -> tuple[NavDPPolicy, list[object]]:
    """The published policy with given draws, the last one repeated, after it has seen a wall to its left."""
    policy, calls = NavDPPolicy(options=options), []
    policy.reset(EpisodeStart(goal=(3.0, 0.0), rng=np.random.default_rng(0)))

    def draw(goal: tuple[float, float], guidance: Guidance | None = None) -> DrawnTrajectories:
        calls.append(guidance)
        paths, values = draws[min(len(calls), len(draws)) - 1]
        return DrawnTrajectories(paths, np.array(values))

    policy.draw = draw  # type: ignore[method-assign]
    policy.act(view(wall_ahead(0.6), (0.0, 0.0, math.pi / 2.0), bearing=-math.pi / 2.0))
    assert not calls
    return policy, calls


def test_a_trajectory_into_an_obstacle_out_of_view_is_not_followed() -> None:
    drawn = trajectories((0.3, 2.0), (2.0, 0.0)), [1.0, 0.0]
    for options, end in [({}, (2.0, 0.0)), ({"veto": []}, (0.3, 2.0)), (OFF, (0.3, 2.0))]:
        policy, _ = policy_that_draws(drawn, **options)
        policy.act(view(NOTHING, (0.0, 0.0, 0.0)))
        np.testing.assert_allclose(policy.planned_path()[-1], end, atol=1e-9)


def test_a_wider_berth_is_preferred_to_a_higher_value_and_waived_if_there_is_none() -> None:
    # The wall's face is at y = 0.8, up to x = 0.4: 0.54 m from the first path and 0.74 m from the second.
    near, wide = (0.8, 0.44), (2.0, 0.3)
    drawn = trajectories(near, wide), [1.0, 0.0]
    policy, _ = policy_that_draws(drawn, veto=(0.65, 0.30))
    policy.act(view(NOTHING, (0.0, 0.0, 0.0)))
    np.testing.assert_allclose(policy.planned_path()[-1], wide, atol=1e-9)
    policy, _ = policy_that_draws(drawn, veto=(0.90, 0.30))
    policy.act(view(NOTHING, (0.0, 0.0, 0.0)))
    np.testing.assert_allclose(policy.planned_path()[-1], near, atol=1e-9)


def test_it_draws_again_if_all_are_vetoed_and_then_turns_in_place() -> None:
    blocked, free = (trajectories((0.3, 2.0)), [1.0]), (trajectories((2.0, 0.0)), [0.0])
    policy, calls = policy_that_draws(blocked, blocked, free, redraws=2)
    policy.act(view(NOTHING, (0.0, 0.0, 0.0)))
    assert len(calls) == 3
    np.testing.assert_allclose(policy.planned_path()[-1], (2.0, 0.0), atol=1e-9)
    policy, calls = policy_that_draws(blocked, blocked, free, redraws=1)
    forward, turn = policy.act(view(NOTHING, (0.0, 0.0, 0.0)))
    assert len(calls) == 2
    assert forward == 0.0
    assert abs(turn) > 0.0
    assert policy.planned_path() is None


def test_it_brakes_for_an_obstacle_ahead_of_its_path_and_draws_another() -> None:
    drawn = trajectories((2.0, 0.0)), [1.0]
    for options, forward in [({"veto": [], "check": (0.30,)}, 0.0), ({"veto": [], "check": []}, 0.9)]:
        policy, calls = policy_that_draws(drawn, **options)
        policy.act(view(NOTHING, (0.0, 0.0, 0.0), speed=0.8))
        action = policy.act(view(wall_ahead(0.25), (0.08, 0.0, 0.0), speed=0.8))
        assert action[0] <= forward if forward == 0.0 else action[0] >= forward
        policy.act(view(wall_ahead(0.20), (0.13, 0.0, 0.0), speed=0.6))
        assert len(calls) == (2 if forward == 0.0 else 1)


def test_it_sets_off_only_after_a_turn_in_place_has_ended() -> None:
    drawn = trajectories((2.0, 0.0)), [1.0]
    policy, calls = policy_that_draws(drawn, settled=0.5)
    assert policy.act(view(NOTHING, (0.0, 0.0, 0.0), turning=-1.4)).tolist() == [0.0, 0.0]
    assert not calls
    assert policy.act(view(NOTHING, (0.0, 0.0, -0.1), turning=-0.3))[0] > 0.0
    policy, calls = policy_that_draws(drawn, settled=None)
    assert policy.act(view(NOTHING, (0.0, 0.0, 0.0), turning=-1.4))[0] > 0.0


def test_guided_draws_keep_farther_from_the_obstacles_seen_and_are_deterministic() -> None:
    policy = NavDPPolicy()
    clearance = around_cells((slice(54, 64), slice(82, 90)))
    frames = np.full((72, 128, 3), 90, np.uint8), wall_ahead(4.0)
    least = []
    for guide in (None, guidance(clearance)):
        policy.drawn_from(*frames, (3.0, 0.0), seed=3)
        drawn = [policy.draw((3.0, 0.0), guide).trajectories]
        policy.drawn_from(*frames, (3.0, 0.0), seed=3)
        drawn.append(policy.draw((3.0, 0.0), guide).trajectories)
        np.testing.assert_array_equal(drawn[0], drawn[1])
        least.append(clearance.at(drawn[0]).min(axis=1).mean())
    assert least[1] > least[0] + 0.05


@pytest.mark.slow
@pytest.mark.skipif(not runs_pinned(), reason="the poses are those of the pinned kernels")
def test_without_the_added_parts_it_drives_as_the_trained_network_alone_did() -> None:
    if torch.__version__.split("+")[0] != "2.13.0":
        pytest.skip(f"the poses are of torch 2.13.0, installed is {torch.__version__}")
    drive = drive_pair("navdp", load_published("val", "val-con_01"), 0, options={"options": OFF})
    # Recorded before the parts were added; the drive has contacts.
    poses = {40: (3.5, 1.36, -0.348), 60: (4.827, 1.696, 0.374), 100: (6.295, 4.864, 1.555), 138: (5.291, 8.237, 2.579)}
    assert len(drive.route) == 139
    assert {step: drive.route[step] for step in poses} == poses
