"""Depth images of the planar kernel against Embree's rays and against closed forms."""

from __future__ import annotations

import math

import gymnasium as gym
import numpy as np
import pytest
from laboratories import island_laboratory
from scipy.spatial import Delaunay

import labgym  # noqa: F401 -- registers the ids
from labgym.envs.sensors import Camera
from labgym.envs.world import World
from labgym.layouts import load_published
from labgym.layouts.places import layout_at
from labgym.navigation import goal_pairs
from labgym.scenes import SceneMesh

pytest.importorskip("numba")

from labgym.envs.planar.depth import FACES, Chunks, chunked, chunks_of, depth, draw, lens_of

LAYOUTS = {
    "island": island_laboratory,
    "room": lambda: load_published("test", "test-sub_01"),
    "floor": lambda: layout_at("floors-test", 1, first=900),
}
CAMERAS = {
    "standard": Camera(),
    "wide and near": Camera((33, 57), hfov=1.9, reach=3.0, forward=0.0, height=1.2),
}


@pytest.fixture(scope="module", params=LAYOUTS)
def world(request: pytest.FixtureRequest) -> World:
    return World(LAYOUTS[request.param]())


def poses(world: World) -> list[tuple[float, float, float]]:
    """Poses at the ends of drives and between them, with random headings."""
    rng = np.random.default_rng(5)
    found = []
    for pair in goal_pairs(world._layout)[:3]:
        share = rng.uniform()
        x, y = (start + share * (goal - start) for start, goal in zip(pair.start[:2], pair.goal[:2], strict=True))
        found += [pair.start, pair.goal, (x, y, rng.uniform(-math.pi, math.pi))]
    return found


@pytest.mark.cases(2)
@pytest.mark.parametrize("name", CAMERAS)
def test_depth_is_that_of_rays_or_where_they_miss_an_edge_that_of_double_precision(world: World, name: str) -> None:
    camera, pixels, unequal = CAMERAS[name], 0, 0
    for pose in poses(world):
        drawn, cast = depth(world, pose, camera), camera.depth(world.visible, pose)
        assert drawn.dtype == cast.dtype
        assert drawn.shape == cast.shape
        pixels += drawn.size
        for row, column in np.argwhere(np.abs(drawn.astype(float) - cast) > 1e-5 * (1.0 + cast)):
            unequal += 1
            assert drawn[row, column] == pytest.approx(nearest(world, pose, camera, row, column), rel=1e-6)
    assert unequal <= 2e-3 * pixels


def nearest(world: World, pose: tuple[float, float, float], camera: Camera, row: int, column: int) -> float:
    """Depth along the ray of one pixel by the formula of Möller and Trumbore for all triangles, in double precision."""
    mesh, (x, y, yaw) = world.mesh("visual"), pose
    rows, columns = camera.shape
    left, up = (columns / 2.0 - 0.5 - column) / camera.focal, (rows / 2.0 - 0.5 - row) / camera.focal
    cosine, sine = math.cos(yaw), math.sin(yaw)
    eye = np.array([x + camera.forward * cosine, y + camera.forward * sine, camera.height])
    ray = np.array([cosine - sine * left, sine + cosine * left, up])
    corners = mesh.vertices.astype(np.float32).astype(float)[mesh.faces]
    a, first, second = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal = np.cross(ray, second)
    with np.errstate(divide="ignore", invalid="ignore"):
        scale = 1.0 / (first * normal).sum(axis=1)
        u = ((eye - a) * normal).sum(axis=1) * scale
        other = np.cross(eye - a, first)
        v, distance = (other @ ray) * scale, (second * other).sum(axis=1) * scale
        hit = (u >= -1e-9) & (v >= -1e-9) & (u + v <= 1.0 + 1e-9) & (distance > 0.0)
    return float(min(distance[hit].min(initial=math.inf), camera.reach))


def test_chunks_hold_every_triangle_once_and_their_boxes_hold_them(world: World) -> None:
    chunks, mesh = chunks_of(world), world.mesh("visual")
    corners = mesh.vertices.astype(np.float32)[mesh.faces].reshape(-1, 9)
    assert sorted(map(bytes, corners)) == sorted(map(bytes, chunks.corners))
    assert (np.diff(chunks.first) > 0).all()
    assert (np.diff(chunks.first) <= FACES).all()
    chunk_of = np.repeat(np.arange(len(chunks.half)), np.diff(chunks.first))
    offset = np.abs(chunks.corners.reshape(-1, 3, 3) - chunks.center[chunk_of][:, None])
    assert (offset <= chunks.half[chunk_of][:, None] + 1e-6).all()


def surface(points: np.ndarray, faces: np.ndarray) -> Chunks:
    kinds = np.zeros(len(faces), np.int64)
    return chunked(SceneMesh(points.astype(float), faces.astype(np.int64), kinds, kinds))


def image(chunks: Chunks, camera: Camera, pose: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> np.ndarray:
    flat = np.empty(camera.shape[0] * camera.shape[1], np.float32)
    draw(*pose, chunks, lens_of(camera), flat)
    return flat.reshape(camera.shape)


@pytest.mark.parametrize("aligned", [True, False])
def test_no_pixel_leaks_between_the_triangles_of_a_wall(aligned: bool) -> None:
    """A wall 2 m ahead of the camera in a thousand triangles; aligned ones have their sides at centers of pixels."""
    camera = Camera((40, 60), hfov=2.0 * math.atan(1.0), forward=0.0, height=1.0)
    if aligned:
        steps = (np.arange(-41, 42) * 2.0 * 2.0 / 60.0) + 2.0 / 60.0
        sides = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    else:
        sides = np.vstack([np.random.default_rng(1).uniform(-3.0, 3.0, (600, 2)), [[-9, -9], [9, -9], [-9, 9], [9, 9]]])
    points = np.column_stack([np.full(len(sides), 2.0), sides[:, 0], sides[:, 1] + 1.0])
    drawn = image(surface(points, Delaunay(sides).simplices), camera)
    np.testing.assert_allclose(drawn, 2.0, rtol=1e-6)


def test_a_floor_below_and_behind_the_camera_has_the_depth_of_its_slope() -> None:
    """Two triangles of 100 m, which reach behind the camera; rows above the horizon see nothing within reach."""
    camera = Camera((30, 40), hfov=1.2, reach=10.0, height=0.5)
    points = np.array([[-50.0, -50.0, 0.0], [50.0, -50.0, 0.0], [50.0, 50.0, 0.0], [-50.0, 50.0, 0.0]])
    drawn = image(surface(points, np.array([[0, 1, 2], [0, 2, 3]])), camera, (0.3, -0.2, 0.7))
    focal = 20.0 / math.tan(0.6)
    for row in range(30):
        slope = (row - 14.5) / focal
        expected = min(0.5 / slope, 10.0) if slope > 0.0 else 10.0
        np.testing.assert_allclose(drawn[row], expected, rtol=1e-6)
    assert (drawn[:15] == np.float32(10.0)).all()


def test_nothing_is_seen_without_triangles_and_through_one_from_its_side() -> None:
    camera = Camera((9, 12), reach=7.0)
    side = np.array([[1.0, 0.0, -5.0], [3.0, 0.0, -5.0], [2.0, 0.0, 9.0]])
    nothing = Chunks(np.empty((0, 9), np.float32), np.zeros(1, np.int64), np.empty((0, 3)), np.empty((0, 3)))
    behind = surface(side * [-1.0, 1.0, 1.0], np.array([[0, 1, 2]]))
    for chunks in (nothing, behind, surface(side, np.array([[0, 1, 2]]))):
        assert (image(chunks, camera) == np.float32(7.0)).all()


def test_the_environment_on_the_kernel_sees_what_it_sees_with_mujoco() -> None:
    planar, mujoco = (
        gym.make("LabFloorNavDepth-v0", layout=island_laboratory(), physics=physics) for physics in ("planar", "mujoco")
    )
    first, second = (env.reset(seed=2)[0] for env in (planar, mujoco))
    np.testing.assert_allclose(first["depth"], second["depth"], rtol=3e-6)
    assert planar.observation_space.contains(first)
