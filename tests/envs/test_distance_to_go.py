"""The field that tells progress, against exact shortest paths."""

from __future__ import annotations

import math

import numpy as np
import pytest

from labgym.envs import LabPointNavEnv
from labgym.envs.distance_to_go import ExactDistanceToGo, GridDistanceToGo
from labgym.envs.parts.rewards import RewardWeights
from labgym.errors import UnknownNameError
from labgym.layouts import Layout
from labgym.navigation import PLANNING_RADIUS, OccupancyGrid, ShortestPaths, occupancy, shortest_path

GOAL = (6.5, 2.5)


@pytest.fixture(scope="module")
def field(layout: Layout) -> GridDistanceToGo:
    return GridDistanceToGo(occupancy(layout).dilated(PLANNING_RADIUS), GOAL)


def test_it_lies_between_the_shortest_path_and_8_percent_more(layout: Layout, field: GridDistanceToGo) -> None:
    for x, y in [(1.5, 2.5), (2.0, 4.5), (5.5, 4.6), (1.2, 0.8), (4.0, 0.9)]:
        exact = shortest_path(layout, (x, y), GOAL).length
        assert exact - 0.05 <= field.at(x, y) <= 1.083 * exact + 0.10


def test_it_is_the_straight_distance_in_an_empty_room_along_the_grid(empty_room: Layout) -> None:
    field = GridDistanceToGo(occupancy(empty_room).dilated(PLANNING_RADIUS), (6.025, 3.025))
    for x in np.linspace(1.0, 5.0, 17):
        assert field.at(x, 3.025) == pytest.approx(6.025 - x, abs=1e-9)


def test_it_changes_smoothly_as_the_robot_moves(field: GridDistanceToGo) -> None:
    xs = np.linspace(1.2, 2.6, 500)
    steps = np.abs(np.diff([field.at(x, 1.0) for x in xs]))
    assert steps.max() <= 1.5 * (xs[1] - xs[0])


def test_it_is_finite_everywhere_also_inside_obstacles_and_outside_the_room(field: GridDistanceToGo) -> None:
    points = np.random.default_rng(0).uniform(-1.0, 9.0, (500, 2))
    assert all(math.isfinite(field.at(x, y)) for x, y in points)


def test_without_any_path_it_is_the_straight_distance() -> None:
    field = GridDistanceToGo(OccupancyGrid(np.ones((40, 40), dtype=bool)), (1.0, 1.0))
    assert not field.reachable
    assert field.at(0.4, 0.2) == pytest.approx(1.0)


def test_the_exact_one_is_the_length_of_the_shortest_path(layout: Layout) -> None:
    field = ExactDistanceToGo(ShortestPaths(layout), GOAL)
    for x, y in [(1.5, 2.5), (2.0, 4.5), (5.5, 4.6), (1.2, 0.8), (4.0, 0.9)]:
        assert field.at(x, y) == pytest.approx(shortest_path(layout, (x, y), GOAL).length, abs=1e-9)


def test_the_exact_one_is_finite_everywhere_and_never_changes_faster_than_the_robot_moves_in_free_space(
    layout: Layout,
) -> None:
    paths = ShortestPaths(layout)
    field = ExactDistanceToGo(paths, GOAL)
    points = np.random.default_rng(0).uniform(-1.0, 9.0, (300, 2))
    assert all(math.isfinite(field.at(x, y)) for x, y in points)
    steps = points + np.random.default_rng(1).normal(0.0, 0.02, points.shape)
    for here, there in zip(points, steps, strict=True):
        if paths.space.joins(here[None], there[None])[0]:
            assert abs(field.at(*here) - field.at(*there)) <= math.dist(here, there) + 1e-9


def test_the_exact_one_is_the_straight_distance_if_the_goal_is_not_free(empty_room: Layout) -> None:
    field = ExactDistanceToGo(ShortestPaths(empty_room), (0.1, 1.0))
    assert not field.reachable
    assert field.at(1.1, 1.0) == pytest.approx(1.0)


def test_an_environment_measures_progress_exactly_on_request(layout: Layout) -> None:
    env = LabPointNavEnv(layout=layout, distance_to_go="exact", weights=RewardWeights(1.0, 0.0, 0.0, 0.0))
    _, info = env.reset(seed=0)
    before = shortest_path(layout, info["pose"], info["goal"]).length
    gained = 0.0
    for _ in range(5):
        _, reward, _, _, info = env.step(np.array([0.5, 0.3], np.float32))
        gained += reward
    assert gained == pytest.approx(before - shortest_path(layout, info["pose"], info["goal"]).length, abs=1e-9)
    with pytest.raises(UnknownNameError, match="exact"):
        LabPointNavEnv(distance_to_go="fine")
