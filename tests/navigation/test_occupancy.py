from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import ndimage

from labgym.errors import OptionError
from labgym.geometry import OrientedBox
from labgym.navigation import OccupancyGrid, occupancy


def test_a_footprint_on_cell_borders_fills_its_own_cells_and_no_more(make_plan):
    grid = occupancy(make_plan(OrientedBox(1.0, 2.0, 0.4, 0.2), width=4.0, depth=3.0))
    room = grid.occupied[4:-4, 4:-4]
    assert room.shape == (60, 80)
    rows, columns = np.nonzero(room)
    assert (rows.min(), rows.max(), columns.min(), columns.max()) == (38, 41, 16, 23)
    assert room.sum() == 4 * 8
    assert grid.occupied.sum() == 4 * 8 + 68 * 88 - 60 * 80  # the walls of 0.2 m


def test_a_quarter_turn_swaps_the_sides(make_plan):
    upright = occupancy(make_plan(OrientedBox(1.0, 2.0, 0.2, 0.6)))
    turned = occupancy(make_plan(OrientedBox(1.0, 2.0, 0.6, 0.2, math.pi / 2)))
    assert np.array_equal(upright.occupied, turned.occupied)


@settings(max_examples=40, deadline=None)
@given(
    x=st.floats(0.0, 3.0),
    y=st.floats(0.0, 2.0),
    width=st.floats(0.05, 1.5),
    depth=st.floats(0.05, 1.5),
    yaw=st.floats(-math.pi, math.pi),
)
def test_cells_are_occupied_exactly_where_the_footprint_overlaps_them(make_plan, x, y, width, depth, yaw):
    box = OrientedBox(x, y, width, depth, yaw)
    grid = occupancy(make_plan(box, width=3.0, depth=2.0), resolution=0.1)
    room = grid.occupied[2:-2, 2:-2]
    rows, columns = np.mgrid[0:20, 0:30]
    cells = shapely.box(columns * 0.1, rows * 0.1, columns * 0.1 + 0.1, rows * 0.1 + 0.1)
    shared = shapely.area(shapely.intersection(cells, shapely.Polygon(box.corners())))
    assert room[shared > 1e-7].all()
    assert not room[shapely.distance(cells, shapely.Polygon(box.corners())) > 1e-7].any()


def test_what_hangs_above_the_robot_is_not_in_its_way(make_plan):
    shelf = OrientedBox(2.0, 2.0, 1.0, 0.4, 0.0, 1.45, 1.9)
    assert occupancy(make_plan(shelf)).free(2.0, 2.0)
    assert not occupancy(make_plan(shelf), below=1.5).free(2.0, 2.0)


def test_cells_that_reach_outside_the_room_are_occupied(make_plan):
    grid = occupancy(make_plan(width=3.02, depth=2.0))
    assert grid.origin == pytest.approx((-0.2, -0.2))
    assert grid.shape == (48, 69)
    assert not grid.occupied[4:-4, 4:64].any()
    assert (~grid.occupied).sum() == 40 * 60
    assert not grid.free(3.01, 1.0)
    assert not grid.free(-0.01, 1.0)
    assert not grid.free(1.0, 2.01)


def test_cells_and_points_agree(make_plan):
    grid = occupancy(make_plan(width=6.6, depth=7.2))
    xs, ys = grid.centres()
    assert grid.shape == (152, 140)
    for row, column in ((0, 0), (17, 3), (151, 139)):
        assert grid.cell_of(*grid.centre_of(row, column)) == (row, column)
        assert grid.centre_of(row, column) == pytest.approx((xs[column], ys[row]))


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), radius=st.floats(0.0, 0.6))
def test_a_dilated_cell_is_free_exactly_where_a_true_disc_fits(seed, radius):
    occupied = np.random.default_rng(seed).random((18, 25)) < 0.03
    grid = OccupancyGrid(occupied, 0.05, (1.0, -2.0))
    inside = np.pad(occupied, 20, constant_values=True)
    rows, columns = np.nonzero(inside)
    r, c = np.mgrid[20:38, 20:45]
    gap_y = np.maximum(np.abs(r[..., None] - rows) - 0.5, 0.0)
    gap_x = np.maximum(np.abs(c[..., None] - columns) - 0.5, 0.0)
    nearest = (np.hypot(gap_x, gap_y) * 0.05).min(axis=-1)
    clear = np.abs(nearest - radius) > 1e-9
    expected = (nearest < radius) | occupied
    dilated = grid.dilated(radius)
    assert np.array_equal(dilated.occupied[clear], expected[clear])
    assert dilated.origin == grid.origin


def test_dilation_lies_between_the_distance_transforms_bounds(make_plan):
    grid = occupancy(make_plan(OrientedBox(3.0, 3.0, 1.3, 0.7, 0.4), OrientedBox(5.5, 4.0, 0.6, 2.0)))
    centre_to_centre = (
        ndimage.distance_transform_edt(~np.pad(grid.occupied, 1, constant_values=True))[1:-1, 1:-1] * 0.05
    )
    dilated = grid.dilated(0.30).occupied
    assert dilated[centre_to_centre < 0.30].all()
    assert not dilated[centre_to_centre > 0.30 + 0.05 * math.sqrt(0.5)].any()


def test_regions_are_those_that_sides_join(make_plan):
    occupied = np.random.default_rng(5).random((40, 50)) < 0.4
    labels = OccupancyGrid(occupied).components
    reference, count = ndimage.label(~occupied)
    assert labels.max() == count
    assert len(np.unique(np.stack([labels, reference], -1).reshape(-1, 2), axis=0)) == count + 1


def test_a_wall_across_the_room_separates_it(make_plan):
    wall = OrientedBox(4.0, 4.0, 8.0, 0.1)
    grid = occupancy(make_plan(wall)).dilated(0.3)
    assert not grid.connected((1.0, 1.0), (1.0, 7.0))
    assert grid.connected((1.0, 1.0), (7.0, 3.0))
    assert not grid.connected((1.0, 1.0), (9.0, 1.0))


@pytest.mark.parametrize("resolution", [0.0, -1.0, math.nan, 1e-6])
def test_a_resolution_that_gives_no_grid_is_refused(make_plan, resolution):
    with pytest.raises(OptionError, match="resolution"):
        occupancy(make_plan(), resolution)


@pytest.mark.parametrize("radius", [-0.1, math.nan, math.inf])
def test_a_radius_that_is_no_length_is_refused(make_plan, radius):
    with pytest.raises(OptionError, match="radius"):
        occupancy(make_plan()).dilated(radius)
