from __future__ import annotations

import math

import numpy as np
import pytest

from labgym.layouts import load_published
from labgym.navigation import PLANNING_RADIUS, LengthsTo, ShortestPaths, distance_field, goal_poses, occupancy
from labgym.navigation.geodesic import geodesic_fields

H = 0.05


def distances(shape: tuple[int, int], row: int, column: int) -> np.ndarray:
    rows, columns = np.mgrid[: shape[0], : shape[1]]
    return H * np.hypot(rows - row, columns - column)


def starts_around(shape: tuple[int, int], row: int, column: int, radius: float = 0.3) -> np.ndarray:
    away = distances(shape, row, column)
    return np.where(away <= radius, away, np.inf)


def test_without_obstacles_it_is_the_straight_distance_in_every_direction() -> None:
    free = np.ones((120, 90), dtype=bool)
    places = [(10, 10), (60, 45), (119, 0)]
    fields = geodesic_fields(free, np.stack([starts_around(free.shape, *place) for place in places]), H)
    for field, place in zip(fields, places, strict=True):
        exact = distances(free.shape, *place)
        assert (field >= exact - 1e-9).all()
        assert (field - exact).max() < 0.06


def test_eight_directions_would_overstate_it() -> None:
    free = np.ones((120, 90), dtype=bool)
    field = geodesic_fields(free, starts_around(free.shape, 0, 0)[None], H)[0]
    assert field[100, 41] == pytest.approx(H * math.hypot(100, 41), rel=0.015)
    assert H * (100 + 41 * (math.sqrt(2.0) - 1.0)) > 1.08 * H * math.hypot(100, 41)


def test_it_goes_around_the_end_of_a_wall() -> None:
    free = np.ones((100, 100), dtype=bool)
    free[:70, 50] = False
    field = geodesic_fields(free, starts_around(free.shape, 30, 20)[None], H)[0]
    exact = distances(free.shape, 30, 20)
    corner = distances(free.shape, 70, 50)
    hidden = np.zeros_like(free)
    hidden[:60, 60:] = True  # every straight line from there to the goal meets the wall
    around = corner + exact[70, 50]
    np.testing.assert_allclose(field[hidden], around[hidden], rtol=0.04)
    seen = np.zeros_like(free)
    seen[:, :50] = True
    assert np.abs(field - exact)[seen].max() < 0.06
    assert np.isinf(field[:70, 50]).all()


def test_nothing_passes_a_closed_wall_or_between_cells_that_touch_at_a_corner() -> None:
    free = np.ones((40, 40), dtype=bool)
    for k in range(40):
        free[k, 39 - k] = False
    field = geodesic_fields(free, starts_around(free.shape, 2, 2, 0.1)[None], H)[0]
    rows, columns = np.mgrid[:40, :40]
    assert np.isfinite(field[rows + columns < 39]).all()
    assert np.isinf(field[rows + columns >= 39]).all()


def test_starts_in_occupied_cells_do_not_count() -> None:
    free = np.ones((10, 10), dtype=bool)
    free[5, 5] = False
    starts = np.full((1, 10, 10), np.inf)
    starts[0, 5, 5] = 0.0
    assert np.isinf(geodesic_fields(free, starts, H)).all()


def test_in_a_laboratory_it_is_near_the_exact_shortest_paths_and_nearer_than_eight_directions() -> None:
    layout = load_published("val", "val-alk_01")
    paths, grid = ShortestPaths(layout, PLANNING_RADIUS), occupancy(layout).dilated(PLANNING_RADIUS)
    goal = next(pose for pose in goal_poses(layout).values() if paths.free(*pose[:2]) and grid.free(*pose[:2]))
    row, column = grid.cell_of(*goal[:2])
    goal = grid.centre_of(row, column)
    field = geodesic_fields(~grid.occupied, starts_around(grid.shape, row, column, 0.08)[None], grid.resolution)[0]
    octile, lengths = distance_field(grid, goal), LengthsTo(paths, goal)
    cells = np.argwhere(np.isfinite(octile))[::97]
    exact = np.array([lengths.at(*grid.centre_of(*cell)) for cell in cells.tolist()])
    mine, theirs = field[tuple(cells.T)], octile[tuple(cells.T)]
    assert len(cells) > 40
    assert (mine - exact).min() > -1e-6
    assert (mine - theirs).max() < 0.1
    assert (mine - exact).mean() < 0.6 * (theirs - exact).mean()
