"""The field that tells progress, against exact shortest paths."""

from __future__ import annotations

import math

import numpy as np
import pytest

from labgym.envs.distance_to_go import DistanceToGo
from labgym.layouts import Layout
from labgym.navigation import PLANNING_RADIUS, OccupancyGrid, occupancy, shortest_path

GOAL = (6.5, 2.5)


@pytest.fixture(scope="module")
def field(layout: Layout) -> DistanceToGo:
    return DistanceToGo(occupancy(layout).dilated(PLANNING_RADIUS), GOAL)


def test_it_lies_between_the_shortest_path_and_8_percent_more(layout: Layout, field: DistanceToGo) -> None:
    for x, y in [(1.5, 2.5), (2.0, 4.5), (5.5, 4.6), (1.2, 0.8), (4.0, 0.9)]:
        exact = shortest_path(layout, (x, y), GOAL).length
        assert exact - 0.05 <= field.at(x, y) <= 1.083 * exact + 0.10


def test_it_is_the_straight_distance_in_an_empty_room_along_the_grid(empty_room: Layout) -> None:
    field = DistanceToGo(occupancy(empty_room).dilated(PLANNING_RADIUS), (6.025, 3.025))
    for x in np.linspace(1.0, 5.0, 17):
        assert field.at(x, 3.025) == pytest.approx(6.025 - x, abs=1e-9)


def test_it_changes_smoothly_as_the_robot_moves(field: DistanceToGo) -> None:
    xs = np.linspace(1.2, 2.6, 500)
    steps = np.abs(np.diff([field.at(x, 1.0) for x in xs]))
    assert steps.max() <= 1.5 * (xs[1] - xs[0])


def test_it_is_finite_everywhere_also_inside_obstacles_and_outside_the_room(field: DistanceToGo) -> None:
    points = np.random.default_rng(0).uniform(-1.0, 9.0, (500, 2))
    assert all(math.isfinite(field.at(x, y)) for x, y in points)


def test_without_any_path_it_is_the_straight_distance() -> None:
    field = DistanceToGo(OccupancyGrid(np.ones((40, 40), dtype=bool)), (1.0, 1.0))
    assert not field.reachable
    assert field.at(0.4, 0.2) == pytest.approx(1.0)
