from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import lil_matrix
from scipy.sparse.csgraph import dijkstra

from labgym.navigation import OccupancyGrid, astar, distance_field, occupancy, search_kernel
from labgym.navigation.grid_search import grid_graph

grids = st.builds(
    lambda seed, share: OccupancyGrid(np.random.default_rng(seed).random((14, 19)) < share, 0.05, (0.3, -0.2)),
    st.integers(0, 2**32 - 1),
    st.floats(0.0, 0.45),
)
cells = st.tuples(st.integers(0, 13), st.integers(0, 18))


def lengths_by_dijkstra(grid: OccupancyGrid, source: tuple[int, int]) -> np.ndarray:
    ny, nx = grid.shape
    graph = lil_matrix((ny * nx, ny * nx))
    free = ~grid.occupied
    for row, column in np.argwhere(free):
        for dy in (-1, 0, 1):
            for dx in (-1, 0, 1):
                y, x = row + dy, column + dx
                if (dy or dx) and 0 <= y < ny and 0 <= x < nx and free[y, x] and free[row, x] and free[y, column]:
                    graph[row * nx + column, y * nx + x] = math.hypot(dx, dy) * grid.resolution
    return dijkstra(graph.tocsr(), indices=source[0] * nx + source[1]).reshape(ny, nx)


@settings(max_examples=60, deadline=None)
@given(grid=grids, start=cells, goal=cells)
def test_astar_is_as_short_as_dijkstra_on_the_same_moves(grid, start, goal):
    expected = lengths_by_dijkstra(grid, start)[goal] if not grid.occupied[start] else math.inf
    path = astar(grid, grid.centre_of(*start), grid.centre_of(*goal))
    if grid.occupied[goal] or math.isinf(expected):
        assert path is None
        return
    assert np.linalg.norm(np.diff(path, axis=0), axis=1).sum() == pytest.approx(expected, abs=1e-9)
    assert path[0] == pytest.approx(grid.centre_of(*start))
    assert path[-1] == pytest.approx(grid.centre_of(*goal))


@settings(max_examples=60, deadline=None)
@given(grid=grids, start=cells, goal=cells, seed=st.integers(0, 1000))
def test_a_path_with_costs_is_as_cheap_as_the_graphs_and_the_same_compiled_and_not(grid, start, goal, seed):
    costs = 1.0 + np.random.default_rng(seed).integers(0, 3, grid.shape) / 2.0
    ends = grid.centre_of(*start), grid.centre_of(*goal)
    path = astar(grid, *ends, costs)
    if path is None:
        return
    graph = grid_graph(grid, costs)
    cells = [row * grid.shape[1] + column for row, column in (grid.cell_of(x, y) for x, y in path)]
    lengths = [max(graph[one, other], graph[other, one]) for one, other in itertools.pairwise(cells)]
    assert sum(lengths) == pytest.approx(dijkstra(graph, directed=False, indices=cells[0])[cells[-1]])
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(search_kernel, "search", getattr(search_kernel.search, "py_func", search_kernel.search))
        assert np.array_equal(astar(grid, *ends, costs), path)


@settings(max_examples=60, deadline=None)
@given(grid=grids, start=cells, goal=cells)
def test_a_path_keeps_to_free_cells_and_cuts_no_corner(grid, start, goal):
    path = astar(grid, grid.centre_of(*start), grid.centre_of(*goal))
    if path is None:
        return
    visited = [grid.cell_of(x, y) for x, y in path]
    assert all(grid.free(x, y) for x, y in path)
    for (r0, c0), (r1, c1) in itertools.pairwise(visited):
        assert max(abs(r1 - r0), abs(c1 - c0)) == 1
        assert not grid.occupied[r0, c1]
        assert not grid.occupied[r1, c0]


@settings(max_examples=20, deadline=None)
@given(grid=grids, source=cells)
def test_the_distance_field_is_dijkstras(grid, source):
    field = distance_field(grid, grid.centre_of(*source))
    if grid.occupied[source]:
        assert np.isinf(field).all()
    else:
        np.testing.assert_allclose(field, lengths_by_dijkstra(grid, source), atol=1e-12)


@settings(max_examples=20, deadline=None)
@given(grid=grids, sources=st.lists(cells, min_size=1, max_size=3))
def test_the_distance_field_of_several_sources_is_that_of_the_nearest(grid, sources):
    points = [grid.centre_of(*source) for source in sources]
    nearest = np.min([distance_field(grid, point) for point in points], axis=0)
    np.testing.assert_array_equal(distance_field(grid, *points), nearest)


def test_a_squeeze_between_two_cells_that_touch_at_a_corner_is_closed():
    occupied = np.zeros((4, 4), dtype=bool)
    occupied[1, :2] = True
    occupied[2, 2:] = True
    occupied[1, 2:] = [False, False]
    grid = OccupancyGrid(occupied, 1.0)
    assert astar(grid, (0.5, 0.5), (0.5, 3.5)) is None


def test_open_floor_costs_the_octile_distance(make_plan):
    path = astar(occupancy(make_plan()), (1.025, 1.025), (4.025, 2.025))
    length = np.linalg.norm(np.diff(path, axis=0), axis=1).sum()
    assert length == pytest.approx(2.0 + math.sqrt(2.0))


def test_the_same_search_gives_the_same_path(make_plan):
    grid = occupancy(make_plan())
    first, second = (astar(grid, (0.5, 0.5), (7.3, 5.1)) for _ in range(2))
    assert np.array_equal(first, second)


def test_start_and_goal_in_one_cell_give_that_cell(make_plan):
    path = astar(occupancy(make_plan()), (1.01, 1.01), (1.04, 1.04))
    assert path == pytest.approx(np.array([[1.025, 1.025]]))
