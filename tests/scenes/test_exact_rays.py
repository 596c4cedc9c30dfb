"""Exact readings: what approximate reciprocals and ties change in Embree's answers does not reach them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from labgym.envs.sensors import Camera, Lidar
from labgym.layouts import Layout, load_published
from labgym.scenes import ExactRayScene, RayScene

Pose = tuple[float, float, float]


class AnotherProcessor(ExactRayScene):
    """Changes the last bit of Embree's ranges, as another processor does."""

    def _hits(self, *arguments: Any) -> dict[str, Any]:
        hits = super()._hits(*arguments)
        generator = np.random.default_rng(len(arguments[0]))
        hits["tfar"] = np.nextafter(hits["tfar"], generator.choice([0.0, 100.0], len(hits["tfar"]))).astype(np.float32)
        return hits


def contains(triangle: np.ndarray, point: np.ndarray) -> bool:
    """Return whether a point of a triangle's plane is well inside it, by the sum of areas."""
    area = np.linalg.norm(np.cross(triangle[1] - triangle[0], triangle[2] - triangle[0]))
    parts = [np.linalg.norm(np.cross(triangle[k] - point, triangle[k - 1] - point)) for k in range(3)]
    return bool(sum(parts) < area * (1.0 + 1e-6) + 1e-9 and min(parts) > 1e-3 * area)


@pytest.fixture(scope="module")
def published() -> Layout:
    return load_published("test", "test-alk_02")


@pytest.fixture(scope="module")
def poses(published: Layout) -> list[Pose]:
    """Poses on the floor of the room, in all directions."""
    generator = np.random.default_rng(4)
    room = published.room
    return [
        (float(generator.uniform(1.0, room.width - 1.0)), float(generator.uniform(1.0, room.depth - 1.0)), float(yaw))
        for yaw in np.linspace(-3.0, 3.0, 8)
    ]


def test_readings_do_not_depend_on_the_last_bit_of_embrees_ranges(published: Layout, poses: list[Pose]) -> None:
    exact, other = ExactRayScene(published), AnotherProcessor(published)
    for pose in poses:
        mine, theirs = (Camera().colour_and_depth(scene, pose) for scene in (exact, other))
        np.testing.assert_array_equal(mine[0], theirs[0])
        np.testing.assert_array_equal(mine[1], theirs[1])


def test_of_two_materials_in_one_plane_a_ray_hits_the_lower_face_whichever_embree_chose(published: Layout) -> None:
    scene = ExactRayScene(published)
    first, second = scene._coplanar.of(np.arange(len(scene.mesh.faces)))
    corners = scene.mesh.vertices[scene.mesh.faces].astype(np.float32).astype(np.float64)
    smaller = np.linalg.norm(scene._normal[first], axis=1) < np.linalg.norm(scene._normal[second], axis=1)
    pairs = [
        (int(small), int(large))
        for small, large in zip(first[smaller], second[smaller], strict=True)
        if contains(corners[large], corners[small].mean(axis=0))
    ]
    assert len(pairs) > 100
    for pair in pairs[:: len(pairs) // 50]:
        front = scene._normal[pair[0]] / np.linalg.norm(scene._normal[pair[0]])
        start, along = corners[pair[0]].mean(axis=0) + front, -front
        settled = [
            scene._settled(scene._coplanar, np.array([face], dtype=np.int32), start[None], along[None])[0]
            for face in pair
        ]
        assert settled[0] == settled[1] <= min(pair)


def test_exact_readings_are_those_of_embree_to_a_hundredth_of_a_millimeter(
    published: Layout, poses: list[Pose]
) -> None:
    for geometry in ("solid", "visual"):
        plain, exact = (kind(published, geometry) for kind in (RayScene, ExactRayScene))  # type: ignore[arg-type]
        for pose in poses:
            np.testing.assert_allclose(Lidar().scan(exact, pose), Lidar().scan(plain, pose), atol=1e-5, rtol=0.0)
            np.testing.assert_allclose(Camera().depth(exact, pose), Camera().depth(plain, pose), atol=2e-5, rtol=0.0)


def test_a_ray_through_the_edge_of_two_faces_hits_the_lower_one(laboratory: Layout) -> None:
    scene = ExactRayScene(laboratory, "solid")
    corners = scene.mesh.vertices[scene.mesh.faces]
    lower, higher = 0, 1
    shared = [corner for corner in corners[lower] if (corner == corners[higher]).all(axis=1).any()]
    assert len(shared) == 2
    middle = (shared[0] + shared[1]) / 2.0
    start, along = middle[None] + np.array([0.0, 0.0, 1.0]), np.array([[0.0, 0.0, -1.0]])
    settled = scene._settled(scene._around, np.array([higher], dtype=np.int32), start, along)
    assert settled.tolist() == [lower]
