from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.ndimage import binary_dilation

from labgym.envs.parts.noise import RedwoodDepth
from labgym.envs.robot import ROBOT
from labgym.envs.sensors import Camera
from labgym.errors import OptionError
from labgym.layouts import load_published
from labgym.navigation import goal_pairs, occupancy
from labgym.policies.depth_map import DepthMap, KnownFloor
from labgym.scenes import RayScene

ROWS, COLUMNS = 72, 128
FOCAL = COLUMNS / 2.0 / math.tan(math.radians(34.0))
LENS = ROBOT.camera_forward


def picture(wall: float = 10.0, bottom: float = 0.0, top: float = 3.0) -> np.ndarray:
    """Planar depth of a floor and a wide wall across the view, from one height to another, beyond which is nothing."""
    depth = np.full((ROWS, COLUMNS), 10.0)
    for row in range(ROWS):
        up = (ROWS / 2.0 - 0.5 - row) / FOCAL
        floor = ROBOT.camera_height / -up if up < 0.0 else math.inf
        meets = bottom <= ROBOT.camera_height + wall * up <= top and wall < floor
        depth[row] = min(10.0, floor, wall if meets else math.inf)
    return depth


def occupied_centres(floor: KnownFloor) -> np.ndarray:
    xs, ys = floor.grid.centres()
    rows, columns = np.nonzero(floor.grid.occupied)
    return np.column_stack([xs[columns], ys[rows]])


def free(floor: KnownFloor, x: float, y: float) -> bool:
    row, column = floor.grid.cell_of(x, y)
    return not floor.unknown[row, column] and not floor.grid.occupied[row, column]


@pytest.mark.parametrize("distance", [0.83, 1.5, 2.93, 3.0])
def test_a_wall_ahead_is_mapped_at_its_place_and_as_wide_as_it_is_seen(distance):
    depth_map = DepthMap(12.0)
    depth_map.add(picture(distance), (0.0, 0.0, 0.0))
    centres = occupied_centres(depth_map.known([], 0.5))
    assert np.abs(centres[:, 0] - (LENS + distance)).max() < 0.05
    assert len(set(centres[:, 0].round(6))) == 1
    half = distance * math.tan(math.radians(34.0))
    ys = np.sort(centres[:, 1])
    assert ys[0] == pytest.approx(-half, abs=0.06)
    assert ys[-1] == pytest.approx(half, abs=0.06)
    assert np.diff(ys).max() == pytest.approx(0.05)


def test_a_depth_of_0_is_a_lost_reading():
    depth_map, lost = DepthMap(12.0), picture(2.0)
    lost[:, : COLUMNS // 2] = 0.0
    depth_map.add(lost, (0.0, 0.0, 0.0))
    centres = occupied_centres(depth_map.known([], 0.5))
    assert np.abs(centres[:, 0] - (LENS + 2.0)).max() < 0.05
    assert centres[:, 1].max() < 0.05


def test_an_image_with_the_errors_of_redwood_leaves_an_empty_floor_free():
    """A quarter of a pixel of jitter and every second row: pixels of the floor show the depth of other rows."""
    noisy, exact = DepthMap(12.0, noisy=True), DepthMap(12.0)
    for seed in range(5):
        image = RedwoodDepth().apply(picture(), None, np.random.default_rng(seed))
        assert len(noisy.add(image, (0.0, 0.0, 0.0))) == 0
        exact.add(image, (0.0, 0.0, 0.0))
    assert occupied_centres(exact.known([], 0.5)).size
    assert free(noisy.known([], 0.5), 2.0, 0.0)
    wall = RedwoodDepth().apply(picture(2.0), None, np.random.default_rng(0))
    assert np.abs(noisy.add(wall, (0.0, 0.0, 0.0))[:, 0] - (LENS + 2.0)).max() < 0.1


def test_the_floor_is_free_up_to_the_wall_and_unseen_behind_and_next_to_it():
    depth_map = DepthMap(12.0)
    depth_map.add(picture(3.0), (0.0, 0.0, 0.0))
    floor = depth_map.known([(0.0, 0.0)], 1.0)
    assert all(free(floor, x, y) for x in np.arange(LENS + 0.1, LENS + 2.9, 0.1) for y in (0.0, 0.6 * (x - LENS)))
    assert all(floor.unknown[floor.grid.cell_of(LENS + 3.2, y)] for y in (-1.0, 0.0, 1.0))
    assert all(floor.unknown[floor.grid.cell_of(x, 0.8 * (x - LENS) + 0.1)] for x in np.arange(0.5, 3.0, 0.1))


def test_an_empty_view_is_free_as_far_as_the_camera_sees_and_nothing_is_occupied():
    depth_map = DepthMap(12.0)
    assert len(depth_map.add(picture(), (0.0, 0.0, 0.0))) == 0
    floor = depth_map.known([], 0.5)
    assert not floor.grid.occupied.any()
    assert all(free(floor, x, 0.0) for x in np.arange(0.3, LENS + 9.9, 0.2))


@pytest.mark.parametrize(
    "bottom, top, in_the_way",
    [(0.0, 3.0, True), (1.45, 3.0, False), (1.30, 3.0, True), (0.0, 0.04, False), (0.0, 0.30, True)],
)
def test_only_surfaces_at_the_robots_height_are_obstacles(bottom, top, in_the_way):
    depth_map = DepthMap(12.0)
    depth_map.add(picture(4.0, bottom, top), (0.0, 0.0, 0.0))
    assert bool(depth_map.known([], 0.5).grid.occupied.any()) is in_the_way


def test_an_obstacle_stays_when_the_camera_looks_over_it_from_nearby():
    depth_map = DepthMap(12.0)
    fresh = depth_map.add(picture(2.0, 0.0, 0.3), (0.0, 0.0, 0.0))
    assert len(fresh) > 0
    depth_map.add(picture(0.4, 0.0, 0.3), (1.6, 0.0, 0.0))
    assert not free(depth_map.known([], 0.5), LENS + 2.01, 0.0)


def test_only_newly_occupied_cells_are_returned():
    depth_map = DepthMap(12.0)
    first = depth_map.add(picture(2.0), (0.0, 0.0, 0.0))
    assert len(first) == len(np.unique(first, axis=0)) == occupied_centres(depth_map.known([], 0.5)).shape[0]
    assert len(depth_map.add(picture(2.0), (0.0, 0.0, 0.0))) == 0


@settings(max_examples=20, deadline=None)
@given(x=st.floats(-3, 3), y=st.floats(-3, 3), yaw=st.floats(-math.pi, math.pi))
def test_a_view_from_elsewhere_is_the_same_view_moved(x, y, yaw):
    here, there = DepthMap(16.0), DepthMap(16.0)
    stand = occupied_centres((here.add(picture(2.5), (0.0, 0.0, 0.0)), here.known([], 0.5))[1])
    moved = occupied_centres((there.add(picture(2.5), (x, y, yaw)), there.known([], 0.5))[1])
    cosine, sine = math.cos(yaw), math.sin(yaw)
    expected = stand @ np.array([[cosine, sine], [-sine, cosine]]) + (x, y)
    gaps = np.linalg.norm(moved[:, None] - expected, axis=2)
    assert gaps.min(axis=0).max() < 0.08
    assert gaps.min(axis=1).max() < 0.08


def test_a_turn_in_a_laboratory_maps_obstacles_within_a_cell_of_true_ones():
    layout = load_published("val", "val-alk_03")
    grid = occupancy(layout)
    truth = binary_dilation(grid.occupied, np.ones((3, 3)), border_value=1)
    rays, camera, depth_map = RayScene(layout), Camera(), DepthMap(20.0)
    x, y, _ = goal_pairs(layout)[0].start
    for yaw in np.arange(0.0, 2.0 * math.pi, 0.3):
        depth_map.add(camera.depth(rays, (x, y, float(yaw))), (x, y, float(yaw)))
    centres = occupied_centres(depth_map.known([], 0.5))
    cells = np.floor((centres - grid.origin) / 0.05).astype(int)
    ny, nx = truth.shape
    inside = (cells >= 0).all(axis=1) & (cells < (nx, ny)).all(axis=1)
    assert inside.sum() > 200
    assert truth[cells[inside, 1], cells[inside, 0]].all()
    recess = 2  # cells: door leaves stand back a little from the walls' faces
    assert ((cells >= -recess) & (cells < (nx + recess, ny + recess))).all()


def test_the_known_part_contains_seen_cells_and_requested_points_with_a_margin():
    depth_map = DepthMap(12.0)
    depth_map.add(picture(2.0), (0.0, 0.0, 0.0))
    grid = depth_map.known([(-3.0, 4.0)], 1.0).grid
    assert grid.origin[0] == pytest.approx(-4.0, abs=0.051)
    assert grid.origin[1] + 0.05 * grid.shape[0] == pytest.approx(5.0, abs=0.051)
    assert grid.origin[0] + 0.05 * grid.shape[1] == pytest.approx(LENS + 3.0, abs=0.101)


def test_returns_beyond_the_map_are_ignored():
    depth_map = DepthMap(2.0)
    depth_map.add(picture(3.0), (0.0, 0.0, 0.0))
    depth_map.occupy(np.array([[5.0, 0.0], [0.0, -2.001]]))
    floor = depth_map.known([(30.0, 30.0)], 1.0)
    assert max(floor.grid.shape) == 80
    assert not floor.grid.occupied.any()


@pytest.mark.parametrize("size", [(72, 127), (1,), (72, 128, 3)])
def test_a_depth_image_of_another_size_is_refused(size):
    with pytest.raises(OptionError, match="depth image"):
        DepthMap(5.0).add(np.ones(size), (0.0, 0.0, 0.0))


@pytest.mark.parametrize("reach, resolution", [(0.0, 0.05), (5.0, 0.0), (0.02, 0.05), (math.inf, 0.05)])
def test_a_map_without_a_valid_size_is_refused(reach, resolution):
    with pytest.raises(OptionError, match="map"):
        DepthMap(reach, resolution=resolution)
