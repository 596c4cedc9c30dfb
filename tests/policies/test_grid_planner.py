from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from labgym.navigation import OccupancyGrid, astar
from labgym.policies.grid_planner import GridPlanner, PlannerOptions, clearance_field

RESOLUTION = 0.05


def grid_of(*blocks: tuple[float, float, float, float], width: float = 8.0, depth: float = 8.0) -> OccupancyGrid:
    """A grid with axis-aligned blocks (x0, y0, x1, y1)."""
    occupied = np.zeros((round(depth / RESOLUTION), round(width / RESOLUTION)), dtype=bool)
    for block in blocks:
        x0, y0, x1, y1 = (round(edge / RESOLUTION) for edge in block)
        occupied[y0:y1, x0:x1] = True
    return OccupancyGrid(occupied, RESOLUTION)


def clearance(path: np.ndarray, *blocks: tuple[float, float, float, float]) -> float:
    line = shapely.LineString(path)
    return min(line.distance(shapely.box(*block)) for block in blocks)


def length(path: np.ndarray) -> float:
    return float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())


def test_open_floor_is_crossed_in_a_straight_line():
    path = GridPlanner(grid_of()).plan((1.0, 1.0), (7.0, 5.3))
    assert length(path) == pytest.approx(math.hypot(6.0, 4.3), rel=1e-3)
    assert path[0] == pytest.approx((1.0, 1.0))
    assert path[-1] == pytest.approx((7.0, 5.3))


def test_a_block_is_passed_with_comfortable_clearance_if_there_is_room():
    block = (3.0, 2.0, 5.0, 6.0)
    path = GridPlanner(grid_of(block)).plan((1.5, 4.2), (6.5, 4.2))
    assert clearance(path, block) > 0.40
    around = 2.0 * math.hypot(1.5, 1.8) + 2.0
    assert around < length(path) < 1.15 * around


def test_a_gap_that_the_robot_just_fits_is_used():
    left, right = (0.0, 3.0, 3.65, 5.0), (4.35, 3.0, 8.0, 5.0)
    path = GridPlanner(grid_of(left, right)).plan((4.0, 1.0), (4.0, 7.0))
    assert clearance(path, left, right) >= 0.30 - 1e-9


def test_a_gap_that_is_too_narrow_is_not_used():
    left, right = (0.0, 3.0, 3.75, 5.0), (4.30, 3.0, 8.0, 5.0)
    assert GridPlanner(grid_of(left, right)).plan((4.0, 1.0), (4.0, 7.0)) is None


def test_an_end_too_near_to_an_obstacle_is_joined_to_the_nearest_free_floor():
    block = (3.0, 2.0, 5.0, 6.0)
    path = GridPlanner(grid_of(block)).plan((2.8, 4.0), (6.5, 4.2))
    assert path[0] == pytest.approx((2.8, 4.0))
    assert 0.30 <= 3.0 - path[1][0] < 0.40


def test_an_end_inside_an_obstacle_has_no_plan():
    assert GridPlanner(grid_of((3.0, 2.0, 5.0, 6.0))).plan((4.0, 4.0), (6.5, 4.2)) is None


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_a_plan_exists_where_astar_finds_one_and_keeps_the_radius(seed):
    rng = np.random.default_rng(seed)
    corners = rng.uniform(0.5, 6.5, (9, 2))
    blocks = [(x, y, x + w, y + d) for (x, y), (w, d) in zip(corners, rng.uniform(0.3, 1.5, (9, 2)), strict=True)]
    blocks = [tuple(round(edge / RESOLUTION) * RESOLUTION for edge in block) for block in blocks]
    grid = grid_of(*blocks)
    dilated = grid.dilated(0.30)
    free = np.argwhere(~dilated.occupied)
    start, goal = (dilated.centre_of(*free[k]) for k in rng.integers(len(free), size=2))
    plain, path = astar(dilated, start, goal), GridPlanner(grid).plan(start, goal)
    if plain is None:
        assert path is None
        return
    assert clearance(path, *blocks) >= 0.30 - 0.02
    assert length(path) <= 1.5 * length(plain) + 1e-6


def test_without_aversion_a_plan_is_no_longer_than_the_grids():
    block = (3.0, 2.0, 5.0, 6.0)
    grid = grid_of(block)
    plain = astar(grid.dilated(0.30), (1.5, 4.2), (6.5, 4.2))
    path = GridPlanner(grid, PlannerOptions(aversion=0.0)).plan((1.5, 4.2), (6.5, 4.2))
    assert length(path) <= length(plain) + 0.1


def test_clearance_is_the_distance_to_the_nearest_side():
    field = clearance_field(grid_of((3.0, 2.0, 5.0, 6.0)))
    assert field[80, 50] == pytest.approx(3.0 - 2.525, abs=1e-6)
    assert field[80, 2] == pytest.approx(0.125, abs=1e-6)
    assert field[80, 80] == 0.0
    corner = math.hypot(3.0 - 2.525, 2.0 - 1.525)
    assert corner - 1e-6 <= field[30, 50] <= corner + 0.0105


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 1000))
def test_a_straight_piece_costs_its_length_times_the_mean_price_along_it(seed):
    rng = np.random.default_rng(seed)
    blocks = [(x, y, x + 0.3, y + 0.4) for x, y in rng.uniform(0.5, 7.0, (6, 2))]
    planner = GridPlanner(grid_of(*blocks))
    start, ends = rng.uniform(0.2, 7.8, 2), rng.uniform(0.2, 7.8, (30, 2))
    costs = planner._straight_costs(start, ends)
    count = max(2, math.ceil(np.linalg.norm(ends - start, axis=1).max() / (RESOLUTION / 2.0)))
    for end, cost in zip(ends, costs, strict=True):
        points = start + np.linspace(0.0, 1.0, count)[:, None] * (end - start)
        free = all(planner.free.free(*point) for point in points)
        if math.isinf(cost):
            assert not free
        else:
            prices = [planner._costs[planner.free.cell_of(*point)] for point in points]
            assert cost == pytest.approx(math.dist(start, end) * np.mean(prices))
            assert free
