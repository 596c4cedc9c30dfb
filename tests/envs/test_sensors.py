"""Lidar and camera against distances that a ruler gives."""

from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest

from labgym.envs.robot import ROBOT
from labgym.envs.sensors import IMAGE_SHAPE, LIDAR_RAYS, RANGE, Camera, Lidar
from labgym.envs.world import World
from labgym.layouts import Layout
from labgym.layouts.floor import Room
from labgym.scenes import RayScene


def to_walls(room: Room, x: float, y: float, angles: np.ndarray) -> np.ndarray:
    """Distance from a point to the walls of an empty room along each angle."""
    along_x = np.where(np.cos(angles) > 0, room.width - x, x) / np.maximum(np.abs(np.cos(angles)), 1e-12)
    along_y = np.where(np.sin(angles) > 0, room.depth - y, y) / np.maximum(np.abs(np.sin(angles)), 1e-12)
    return np.minimum(along_x, along_y)


@pytest.fixture(scope="module")
def empty(empty_room: Layout) -> RayScene:
    return RayScene(empty_room)


@pytest.mark.parametrize("pose", [(4.0, 3.0, 0.0), (1.0, 5.0, 2.2), (7.2, 0.9, -3.0)])
def test_lidar_measures_the_distance_to_the_walls(empty: RayScene, empty_room: Layout, pose: tuple) -> None:
    scan = Lidar().scan(empty, pose)
    angles = np.radians(np.arange(LIDAR_RAYS) * 2.0 - 180.0) + pose[2]
    assert scan.dtype == np.float32
    assert scan == pytest.approx(to_walls(empty_room.room, pose[0], pose[1], angles), abs=1e-4)


def test_lidar_ray_0_looks_back_45_right_90_ahead_and_135_left(empty: RayScene) -> None:
    scan = Lidar().scan(empty, (6.0, 2.0, 0.0))
    assert scan[[0, 45, 90, 135]] == pytest.approx([6.0, 2.0, 2.0, 4.0], abs=1e-4)


def test_lidar_says_its_range_where_nothing_is_nearer() -> None:
    hall = RayScene(Layout(id="hall", floor=Room(width=40.0, depth=40.0, doors=()).floor, placements=()))
    assert (Lidar().scan(hall, (20.0, 20.0, 0.3)) == np.float32(RANGE)).all()


def test_lidar_sees_a_bench_that_stands_in_the_way(layout: Layout) -> None:
    bench = layout.box("PreparationBench_1")
    front = bench.x + bench.depth / 2
    scan = Lidar().scan(RayScene(layout), (front + 1.0, bench.y, math.pi))
    assert 0.9 < scan[90] < 1.0 + bench.depth


@pytest.mark.parametrize("pose", [(1.5, 2.0, 0.4), (4.0, 4.5, -2.0), (6.3, 1.0, 1.3)])
def test_lidar_agrees_with_mujocos_own_rays_against_what_collides(layout: Layout, pose: tuple) -> None:
    world = World(layout)
    data = mujoco.MjData(world.model)
    mujoco.mj_forward(world.model, data)
    robot, hit = world.model.body("robot/base").id, np.zeros(1, np.int32)
    origin = np.array([pose[0], pose[1], ROBOT.lidar_height])
    expected = []
    for angle in np.radians(np.arange(LIDAR_RAYS) * 2.0 - 180.0) + pose[2]:
        along = np.array([math.cos(angle), math.sin(angle), 0.0])
        expected.append(mujoco.mj_ray(world.model, data, origin, along, None, 1, robot, hit))
    assert Lidar().scan(world.solid, pose) == pytest.approx(np.array(expected), abs=1e-4)


def test_depth_is_planar_so_that_a_wall_ahead_is_equally_deep_everywhere(empty: RayScene, empty_room: Layout) -> None:
    depth = Camera().depth(empty, (6.0, 3.0, 0.0))
    lens_to_wall = empty_room.room.width - 6.0 - ROBOT.camera_forward
    rows = np.arange(IMAGE_SHAPE[0])
    assert depth.shape == IMAGE_SHAPE
    assert depth.dtype == np.float32
    upper = depth[rows < IMAGE_SHAPE[0] // 2]
    assert upper == pytest.approx(np.full(upper.shape, lens_to_wall), abs=1e-3)


def test_depth_of_the_floor_follows_from_the_cameras_height(empty: RayScene) -> None:
    depth = Camera().depth(empty, (3.0, 3.0, 0.0))
    rows, columns = IMAGE_SHAPE
    focal = columns / 2 / math.tan(math.radians(68.0) / 2)
    below = (np.arange(rows) - (rows - 1) / 2) / focal
    wall = 8.0 - 3.0 - ROBOT.camera_forward
    with np.errstate(divide="ignore"):
        floor = np.where(below > 0, ROBOT.camera_height / below, np.inf)
    expected = np.minimum(wall, floor)
    # A skirting board may stand out of the wall by a few centimetres.
    assert depth[:, columns // 2] == pytest.approx(expected, abs=0.05)


def test_the_camera_sees_left_on_the_left_and_the_floor_below(empty: RayScene) -> None:
    # Close to the left wall, heading along it: the picture's left columns are nearer than its right ones.
    depth = Camera().depth(empty, (1.0, 5.4, 0.0))
    rows, columns = IMAGE_SHAPE
    assert depth[rows // 2 - 1, 0] < depth[rows // 2 - 1, columns - 1]
    assert depth[-1, columns // 2] < depth[0, columns // 2]


def test_depth_never_exceeds_its_range() -> None:
    hall = RayScene(Layout(id="hall", floor=Room(width=40.0, depth=40.0, doors=()).floor, placements=()))
    depth = Camera().depth(hall, (5.0, 20.0, 0.0))
    assert depth.max() == np.float32(RANGE)


def test_the_picture_has_colours_and_matches_the_depth(layout: Layout) -> None:
    rays, camera = RayScene(layout), Camera()
    picture, depth = camera.colour_and_depth(rays, (2.0, 2.5, 0.0))
    assert picture.shape == (*IMAGE_SHAPE, 3)
    assert picture.dtype == np.uint8
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 3
    assert np.array_equal(depth, camera.depth(rays, (2.0, 2.5, 0.0)))
