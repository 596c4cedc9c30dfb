"""Lengths of shortest paths to the success disc."""

from __future__ import annotations

import math

import numpy as np
import pytest
from laboratories import island_laboratory

from labgym.navigation import ShortestPaths
from labgym.navigation.lengths import length_to_disc

LAYOUT = island_laboratory()
PATHS = ShortestPaths(LAYOUT)
APART = 0.05


def searched(start: tuple[float, float], goal: tuple[float, float], radius: float) -> float:
    """The shortest of the paths to points on the circle, at most `APART` too long."""
    best = math.inf
    for angle in np.arange(0.0, 2.0 * math.pi, APART / radius):
        path = PATHS.path(start, (goal[0] + radius * math.cos(angle), goal[1] + radius * math.sin(angle)))
        best = min(best, math.inf if path is None else path.length)
    return best


def test_over_free_floor_it_is_the_distance_less_the_radius() -> None:
    assert length_to_disc(PATHS, (4.0, 4.8), (5.5, 4.8), 0.36) == pytest.approx(1.5 - 0.36, abs=1e-12)


def test_within_the_disc_it_is_nothing() -> None:
    assert length_to_disc(PATHS, (4.0, 4.8), (4.2, 4.8), 0.36) == 0.0


def test_without_a_path_it_is_infinite() -> None:
    assert length_to_disc(PATHS, (4.0, 4.8), (-5.0, 4.8), 0.36) == math.inf


@pytest.mark.parametrize("radius", [0.36, 1.0])
def test_it_is_the_least_over_the_disc(radius: float) -> None:
    rng = np.random.default_rng(0)
    shorter = 0
    for _ in range(8):
        ends: list[tuple[float, float]] = []
        while len(ends) < 2:
            point = (float(rng.uniform(0.4, 7.6)), float(rng.uniform(0.4, 5.6)))
            if PATHS.free(*point):
                ends.append(point)
        length, whole = length_to_disc(PATHS, *ends, radius), PATHS.path(*ends).length
        if whole <= radius:
            continue
        expected = searched(*ends, radius)
        assert expected - APART <= length <= expected + 1e-9
        assert whole - length >= radius - 1e-9
        shorter += whole - length > radius + 1e-6
    assert shorter > 0 or radius < 1.0


def test_a_goal_that_is_blocked_can_be_within_reach_of_the_disc() -> None:
    bench = LAYOUT.box("PreparationBench_1")
    goal = (bench.x + bench.depth / 2 + 0.2, bench.y)
    assert not PATHS.free(*goal)
    start = (goal[0] + 2.0, goal[1])
    assert length_to_disc(PATHS, start, goal, 0.36) == pytest.approx(searched(start, goal, 0.36), abs=APART)
