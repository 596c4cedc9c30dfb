"""The parts of the clairvoyant, in a room made by hand."""

from __future__ import annotations

import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from laboratories import island_laboratory
from scipy.optimize import check_grad

from labgym.envs.conditions.beaker import Beaker
from labgym.navigation import ShortestPaths, goal_pairs
from labgym.policies.clairvoyant import smoothing
from labgym.policies.clairvoyant.planning import LEAST_CLEARANCE_M, WayRequest, fastest_way, reference_of
from labgym.policies.clairvoyant.policy import gentle_limits
from labgym.policies.clairvoyant.reaction import yielding_drive
from labgym.policies.clairvoyant.reference import rehearsed, turn, turning_time
from labgym.policies.clairvoyant.route import DriveLimits, Gait, Route, fastest_times
from labgym.policies.clairvoyant.schedule import Crossing, best_schedule
from labgym.policies.clairvoyant.smoothing import NODE_M, BandWeights, ClearanceField, smooth_path
from labgym.policies.clairvoyant.space_time import SpaceTime
from labgym.policies.clairvoyant.worth import Worth

LAYOUT = island_laboratory()
AROUND = goal_pairs(LAYOUT)[1]
FIELD = ClearanceField(LAYOUT)
LIMITS = DriveLimits()
LINE = Route.of(np.array([[1.0, 4.2], [6.0, 4.2]]), LIMITS)
"""A straight way of 5 m."""
NOBODY = np.zeros((0, 0, 2))
HURRY = Worth(5.0)
GAIT = Gait(8, 0.125)
APART = 0.65


def shortest():
    return ShortestPaths(LAYOUT).path(AROUND.start, AROUND.goal)


def crossing(time: float) -> np.ndarray:
    """A person who crosses the line at x = 4 m, 4 s after the start."""
    return np.array([[4.0, 4.2 + 0.8 * (time - 4.0)]])


def scheduled(people=NOBODY, worth=HURRY, route=LINE):
    return best_schedule(route, Crossing(people, APART), worth, GAIT)


class Crossers:
    """The person who crosses, whatever the robot does."""

    def __init__(self) -> None:
        self.tick = 0

    @property
    def places(self):
        return crossing(0.1 * self.tick)

    @property
    def following(self):
        return crossing(0.1 * (self.tick + 1))

    def step(self, x, y, vx, vy, turn):
        self.tick += 1


def test_the_clearance_is_that_of_the_barriers_and_its_gradient_points_away():
    rng = np.random.default_rng(0)
    points = rng.uniform((0.2, 0.2), (7.8, 5.8), (400, 2))
    values = [smoothing._clearance(x, y, FIELD.low, NODE_M, FIELD.values) for x, y in points]
    distances, slopes = np.array(values)[:, 0], np.array(values)[:, 1:]
    np.testing.assert_allclose(distances, FIELD.barriers.clearance(points), atol=0.5 * NODE_M)
    near = (distances > 0.1) & (distances < 0.5)
    farther = FIELD.barriers.clearance(points + 0.01 * slopes)[near] - distances[near]
    assert np.median(farther) == pytest.approx(0.01, abs=0.002)


def test_the_gradient_of_a_paths_cost_is_that_of_finite_differences():
    path = smoothing.resampled(shortest().points, 0.1) + np.random.default_rng(1).normal(0.0, 0.01, (1, 2))
    band = BandWeights(radius=0.5)

    def cost(flat):
        return smoothing._cost(flat.reshape(-1, 2), 0.1, FIELD, band)

    error = check_grad(lambda flat: cost(flat)[0], lambda flat: cost(flat)[1].ravel(), path.ravel(), epsilon=1e-7)
    assert error < 1e-3 * np.linalg.norm(cost(path.ravel())[1])


def test_a_smooth_path_is_little_longer_than_the_shortest_and_can_be_driven_at_full_speed():
    route = Route.of(smooth_path(shortest().points, FIELD, BandWeights()), LIMITS)
    assert shortest().length - 0.02 <= route.length <= 1.03 * shortest().length
    assert FIELD.barriers.clearance(route.points).min() > LEAST_CLEARANCE_M
    headed = Route.of(smooth_path(shortest().points, FIELD, BandWeights(), 0.0), LIMITS, 0.0)
    assert headed.yaw[0] == pytest.approx(0.0, abs=0.05)
    taut = Route.of(shortest().points, LIMITS)
    assert fastest_times(route, 1.4)[1][-1] < fastest_times(taut, 1.4)[1][-1] - 0.5


def test_every_processor_has_the_same_smooth_path():
    program = (
        "from test_clairvoyant import *; print(smooth_path(shortest().points, FIELD, BandWeights()).tobytes().hex())"
    )
    environment = {
        **os.environ,
        "OPENBLAS_CORETYPE": "Prescott",
        "PYTHONPATH": os.pathsep.join([str(Path(__file__).parent), *sys.path]),
    }
    command = [sys.executable, "-c", program]
    other = subprocess.run(command, capture_output=True, text=True, check=True, env=environment).stdout
    assert other.strip() == smooth_path(shortest().points, FIELD, BandWeights()).tobytes().hex()
    assert len(other) > 1000


def test_the_fastest_way_takes_no_longer_than_a_turn_in_place_and_the_taut_path():
    way = fastest_way(shortest().points, AROUND.start, WayRequest(field=FIELD, limits=LIMITS))
    taut = Route.of(shortest().points, LIMITS)
    off = math.remainder(float(taut.yaw[0]) - AROUND.start[2], 2.0 * math.pi)
    assert way.seconds < turning_time(off, LIMITS) + fastest_times(taut, LIMITS.acceleration)[1][-1]
    assert way.seconds > shortest().length


@pytest.mark.parametrize("angle", [-3.0, -0.2, 0.05, 1.0, 2.5])
def test_a_turn_ends_at_its_heading_within_the_limits(angle):
    poses, velocities = turn((1.0, 2.0, 0.3), 0.3 + angle, LIMITS, 0.1)
    assert poses[-1] == pytest.approx((1.0, 2.0, 0.3 + angle))
    rates = np.concatenate([[0.0], velocities[:, 1]])
    assert np.abs(rates).max() <= LIMITS.turn + 1e-9
    assert np.abs(np.diff(rates)).max() <= 0.1 * LIMITS.turn_acceleration + 1e-9
    assert len(poses) == math.ceil(turning_time(angle, LIMITS) / 0.1)
    np.testing.assert_allclose(np.diff(poses[:, 2]), 0.05 * (rates[2:] + rates[1:-1]), atol=0.02)


def test_a_robot_that_follows_a_way_keeps_to_it_and_rests_at_its_end_and_heading():
    way = fastest_way(shortest().points, AROUND.start, WayRequest(field=FIELD, limits=LIMITS, heading=AROUND.goal[2]))
    reference = reference_of(way, AROUND.start, LIMITS, 0.0)
    motion = rehearsed(reference, AROUND.start, (0.0, 0.0), 0.0)
    assert np.hypot(*(motion.poses - reference.poses)[:, :2].T).max() < 0.03
    assert math.dist(motion.poses[-1, :2], AROUND.goal[:2]) < 0.01
    assert abs(math.remainder(motion.poses[-1, 2] - AROUND.goal[2], 2.0 * math.pi)) < 0.02


def test_without_people_a_schedule_takes_the_time_of_even_acceleration_and_braking():
    schedule = scheduled()
    assert 0.1 * len(schedule.places) == pytest.approx(5.0 / 1.0 + 1.0 / 1.25, abs=0.11)
    assert (schedule.near, schedule.places[-1]) == (0.0, pytest.approx(5.0))
    speeds = np.concatenate([[0.0], schedule.speeds])
    assert np.abs(np.diff(speeds)).max() <= GAIT.rise + 1e-9
    places = np.concatenate([[0.0], schedule.places])
    np.testing.assert_allclose(np.diff(places), 0.05 * (speeds[1:] + speeds[:-1]), atol=0.007)


def test_a_schedule_touches_nobody_while_the_robot_moves_and_waits_no_longer_than_it_must():
    people = np.array([crossing(0.1 * k) for k in range(1, 200)])
    free, schedule = scheduled(), scheduled(people)
    spots = np.column_stack([1.0 + schedule.places, np.full(len(schedule.places), 4.2)])
    away = np.linalg.norm(spots - people[: len(spots), 0], axis=1)
    assert away[schedule.speeds > 0.0].min() >= APART - 0.02
    unaware = np.column_stack([1.0 + free.places, np.full(len(free.places), 4.2)])
    assert np.linalg.norm(unaware - people[: len(unaware), 0], axis=1).min() < APART - 0.05
    # The person leaves the line's strip after 0.65 m of the way at 0.8 m/s.
    assert len(free.places) < len(schedule.places) <= len(free.places) + 20.0 * APART / 0.8 + 3


def test_a_schedule_keeps_its_distance_if_that_is_worth_the_time():
    people = np.array([crossing(0.1 * k) for k in range(1, 200)])
    shy = scheduled(people, Worth(5.0, 0.3, 3.0))
    assert shy.near < scheduled(people).near
    assert len(shy.places) > len(scheduled(people).places)


def test_a_drive_that_gives_way_touches_nobody_and_arrives():
    drive = yielding_drive(LINE, Crossers(), HURRY, APART, GAIT, np.zeros((1, 2)))
    for step, (place, speed) in enumerate(zip(drive.places, drive.speeds, strict=True), 1):
        assert speed == 0.0 or math.dist((1.0 + place, 4.2), crossing(0.1 * step)[0]) >= 0.6
    assert drive.places[-1] == pytest.approx(5.0, abs=0.02)
    assert len(scheduled().places) < len(drive.places) <= len(scheduled().places) + 25


def test_times_on_the_grid_are_those_of_the_shortest_path_and_ways_go_around_people():
    goal = np.array(AROUND.goal[:2])
    grid, start = SpaceTime(FIELD, goal, 0.1), np.array(AROUND.start[:2])
    assert grid.seconds(start) == pytest.approx(shortest().length, rel=0.15)
    middle = shortest().points[len(shortest().points) // 2]
    standing = np.tile(middle, (40, 1, 1))
    way = grid.way(start, standing, 0.66, 1.0, 0.0)
    assert np.linalg.norm(way - middle, axis=1).min() >= 0.65
    assert np.linalg.norm(way[-1] - goal) <= 0.15


def test_a_beakers_limits_raise_it_to_shares_of_the_rim():
    beaker = Beaker(freeboard=0.005)
    limits = gentle_limits(beaker)
    # At a constant acceleration the surface of the first mode rises by rise(a / w^2).
    assert beaker.rise(limits.acceleration / beaker.frequency**2) == pytest.approx(0.56 * 0.005)
    gait = Gait.of(limits)
    assert 10.0 * gait.rise <= limits.acceleration + 1e-9
    assert gait.levels * gait.rise == pytest.approx(limits.speed)
    assert gentle_limits(Beaker(freeboard=0.1)) == DriveLimits()
