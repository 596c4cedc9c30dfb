"""The kernels of the clairvoyant: against slower ways to the same results, and compiled against not compiled."""

from __future__ import annotations

from itertools import pairwise, product

import numpy as np
import pytest
from laboratories import island_laboratory
from scipy.ndimage import map_coordinates

from labgym.policies.clairvoyant import schedule, smoothing
from labgym.policies.clairvoyant.reaction import YieldTerms, line_of, next_level, pose_at, yielding_drive
from labgym.policies.clairvoyant.reference import ReferenceMotion, rehearsed
from labgym.policies.clairvoyant.route import DriveLimits, Gait, Route
from labgym.policies.clairvoyant.schedule import StepLimits, advance
from labgym.policies.clairvoyant.smoothing import ClearanceField, cost_terms
from labgym.policies.clairvoyant.space_time import CELL_M, MOVES, SpaceTime, earlier_values
from labgym.policies.clairvoyant.worth import Worth
from labgym.policies.reckoning import DeadReckoning
from labgym.policies.tracking import velocities_to_action

FIELD = ClearanceField(island_laboratory())


def _interpolated(points):
    """Return the distances at points by SciPy."""
    nodes = (points - FIELD.low)[:, ::-1].T / smoothing.NODE_M
    high = np.array(FIELD.values.shape)[:, None] - 1.001
    return map_coordinates(FIELD.values, np.clip(nodes, 0.0, high), order=1)


def uncompiled(function):
    """Return the Python function of a kernel."""
    return getattr(function, "py_func", function)


@pytest.mark.parametrize("seed", range(5))
def test_a_rehearsal_is_the_motion_of_a_robot_that_is_told_what_the_reference_wants(seed):
    rng = np.random.default_rng(seed)
    count = int(rng.integers(1, 120)) if seed else 1
    poses, velocities = np.cumsum(rng.normal(0.0, 0.06, (count, 3)), axis=0), rng.normal(0.3, 0.5, (count, 2))
    reference = ReferenceMotion(0.3, 0.1, poses, velocities)
    pose, velocity = tuple((poses[0] + rng.normal(0.0, 0.02, 3)).tolist()), tuple(rng.normal(0.0, 0.3, 2).tolist())
    robot = DeadReckoning()
    robot.pose, robot.velocity = pose, velocity
    driven = [(*pose, *velocity)]
    for step in range(count):
        robot.drive(velocities_to_action(*reference.wanted(0.2 + step * 0.1, robot.pose)))
        driven.append((*robot.pose, *robot.velocity))
    motion = rehearsed(reference, pose, velocity, 0.2)
    assert motion.poses.tobytes() == np.array(driven)[:, :3].tobytes()
    assert motion.velocities.tobytes() == np.array(driven)[:, 3:].tobytes()


@pytest.mark.parametrize("seed", range(5))
def test_the_terms_of_a_paths_cost_are_those_of_its_differences(seed):
    rng = np.random.default_rng(seed)
    path = rng.uniform((0.5, 0.5), (7.5, 5.5)) + np.cumsum(rng.normal(0.02, 0.1, (int(rng.integers(6, 99)), 2)), axis=0)
    band = tuple(rng.uniform(0.01, 2.0, 6).tolist())
    arguments = path, 0.097, 0.097**2, band, FIELD.low, smoothing.NODE_M, FIELD.values
    gradient, edges, sizes, overs, thirds, misses = cost_terms(*arguments)
    curvature = np.linalg.norm(np.diff(path, 2, axis=0), axis=1) / 0.097**2
    np.testing.assert_allclose(edges, np.diff(path, axis=0) ** 2)
    np.testing.assert_allclose(sizes, curvature**2)
    np.testing.assert_allclose(overs, np.maximum(curvature - band[1], 0.0) ** 2)
    np.testing.assert_allclose(thirds, (np.diff(path, 3, axis=0) / 0.097**3) ** 2, rtol=1e-6)
    np.testing.assert_allclose(misses, np.maximum(band[0] - _interpolated(path), 0.0) ** 2)
    for one, other in zip(
        uncompiled(cost_terms)(*arguments), (gradient, edges, sizes, overs, thirds, misses), strict=True
    ):
        assert one.tobytes() == other.tobytes()


def test_values_one_move_earlier_are_the_least_of_a_wait_and_of_every_move():
    rng = np.random.default_rng(0)
    waited, entered = rng.uniform(0.0, 9.0, (2, 13, 17)).astype(np.float32)
    inside, free = rng.random((13, 17)) < 0.05, rng.random((13, 17)) < 0.8
    values = earlier_values(waited, entered, np.array(MOVES), inside, free)
    for row, column in np.ndindex(13, 17):
        ends = [(row + dy, column + dx) for dy, dx in MOVES if 0 <= row + dy < 13 and 0 <= column + dx < 17]
        least = 0.0 if inside[row, column] else min(waited[row, column], *(entered[end] for end in ends))
        assert values[row, column] == (least if free[row, column] else np.inf)


@pytest.mark.parametrize("seed", range(3))
def test_a_way_around_people_keeps_its_distance_where_it_moves(seed):
    rng = np.random.default_rng(seed)
    people = rng.uniform((0.5, 0.5), (7.5, 5.5), (1, 3, 2)) + np.cumsum(rng.normal(0.0, 0.1, (20, 3, 2)), axis=0)
    way = SpaceTime(FIELD, np.array([7.0, 1.0]), 0.2).way(np.array([1.0, 5.0]), people, 0.66, 1.0, 0.5)
    assert len(way) > 10
    assert np.linalg.norm(way[-1] - (7.0, 1.0)) <= 0.2 + CELL_M
    for now, (before, after) in zip(people[1:], pairwise(way), strict=False):
        if (before != after).any():
            assert np.linalg.norm(now - after, axis=1).min() >= 0.66 - 1e-9


class Passers:
    """People who walk straight on."""

    def __init__(self, places, strides) -> None:
        self._places, self._strides, self._tick = places, strides, 0

    @property
    def places(self):
        return self._places + self._strides * self._tick

    @property
    def following(self):
        return self._places + self._strides * (self._tick + 1)

    def step(self, x, y, vx, vy, turn):
        self._tick += 1


def rests_in_time(route, place, level, following, unit, now, then, apart, delay):
    """Whether a robot that takes a speed, and then brakes, touches nobody who walks straight on."""
    levels = [level, following, *((2, 2) if following > level == 0 else ())]
    levels += range(levels[-1] - 1, -1, -1)
    moves = unit * np.cumsum([0, *(before + after for before, after in pairwise(levels))])
    points = route.at(np.minimum(place + moves, route.length))[0]
    people = now[None] + (then - now)[None] * (np.arange(len(points)) + delay)[:, None, None]
    away = np.linalg.norm(points[:, None] - people, axis=2).min(axis=1, initial=np.inf)
    limit = apart if away[0] >= apart else max(float(away[0]), 0.6)
    return bool((away[1:] >= limit - 1e-9).all())


@pytest.mark.parametrize("seed", range(8))
def test_a_drive_that_gives_way_takes_the_greatest_speed_from_which_it_rests_in_time(seed):
    rng = np.random.default_rng(seed)
    route = Route.of(np.cumsum(rng.normal(0.25, 0.2, (12, 2)), axis=0), DriveLimits())
    gait = Gait(6 + seed % 4, 0.125, (1.0,) if seed % 2 else (0.5, 0.3, 0.2))
    line, unit, seen = line_of(route, 1.25), 0.5 * gait.rise * 0.1, set()
    for _ in range(300):
        place, level = float(rng.uniform(0.0, route.length)), int(rng.integers(0, gait.levels + 1))
        now = route.points[rng.integers(0, len(route.points), seed)] + rng.normal(0.0, 0.8, (seed, 2))
        then = now + rng.normal(0.0, 0.05, (seed, 2))
        expected = max(level - 1, 0)
        for following in (level, level + 1):
            reach = place + (level + following) * unit
            allowed = max(float(np.interp(reach, line.along, line.braked)), gait.rise if following > level else 0.0)
            if following <= gait.levels and following * gait.rise <= allowed + 1e-9 and (
                reach + following**2 * unit <= route.length + unit
                and rests_in_time(route, place, level, following, unit, now, then, 0.63, gait.delay)
            ):  # fmt: skip
                expected = following
        terms = YieldTerms(gait.levels, gait.rise, unit, route.length, 0.63, gait.delay, 0.6)
        assert next_level(place, level, line, now, then, terms) == expected
        seen.add(expected - level)
        assert pose_at(place, line) == pytest.approx(
            [*route.at(np.array([place]))[0][0], *(one[0] for one in route.at(np.array([place]))[1:])]
        )
    assert seen >= {0, 1}


@pytest.mark.parametrize("seed", range(4))
def test_a_drive_that_gives_way_is_found_if_it_is_worth_more_than_asked(seed):
    rng = np.random.default_rng(seed)
    route = Route.of(np.cumsum(rng.normal(0.25, 0.2, (12, 2)), axis=0), DriveLimits())
    places = route.points[rng.integers(0, len(route.points), seed)] + rng.normal(0.0, 1.5, (seed, 2))
    gait = Gait(8, 0.125)

    def drive(least=-np.inf):
        people = Passers(places, np.full((seed, 2), 0.03))
        return yielding_drive(route, people, Worth(route.length), 0.63, gait, np.zeros((1, 2)), least=least)

    found = drive()
    if found is not None:
        assert drive(found.points) is None
        assert drive(found.points - 1e-9).places.tobytes() == found.places.tobytes()


@pytest.mark.parametrize("length", [0.05, 0.11, 0.17])
def test_a_schedule_is_as_early_as_the_earliest_of_all_sequences_of_speeds(length):
    route, gait = Route.of(np.array([[0.0, 0.0], [length, 0.0]]), DriveLimits()), Gait(3, 0.125)
    unit = 0.5 * gait.rise * 0.1
    spots = int(np.ceil(route.length / unit - 1e-6))
    found = schedule.best_schedule(route, schedule.Crossing(np.zeros((0, 0, 2)), 0.63), Worth(route.length), gait)
    for count in range(1, len(found.places) + 1):
        ends = []
        for changes in product((-1, 0, 1), repeat=count):
            levels = np.cumsum([0, *changes])
            if levels.min() >= 0 and levels.max() <= gait.levels and levels[-1] == 0:
                ends.append(int((levels[1:] + levels[:-1]).sum()))
        assert (spots in ends) == (count == len(found.places))


@pytest.mark.parametrize("seed", range(4))
def test_a_step_of_the_schedule_is_the_same_compiled_and_not(seed):
    rng = np.random.default_rng(seed)
    before = np.where(rng.random((5, 48)) < 0.5, rng.uniform(0.0, 3.0, (5, 48)), np.inf).astype(np.float32)
    slow, people = rng.random((5, 48)) < 0.9, rng.uniform(0.0, 4.0, (seed, 2))
    points = np.column_stack([np.linspace(0.0, 4.0, 12), np.full(12, 2.0)])
    results = []
    for step in (advance, uncompiled(advance)):
        after, came = np.full_like(before, np.inf), np.empty((5, 48), dtype=np.int8)
        step(before, after, came, slow, people, points, StepLimits(0.4, 1.0, 1.0, 4, np.float32(0.1)))
        results.append((after.tobytes(), came.tobytes()))
    assert results[0] == results[1]
