"""Frames against homogeneous matrices, which write the same transform in another way."""

from __future__ import annotations

import math

import numpy as np
import pytest
from shapely import affinity
from shapely.geometry import Point

from labgym.geometry import compose, relative, to_local, to_world

POSES = [(0.0, 0.0, 0.0), (1.0, -2.0, math.pi / 2), (-3.5, 0.25, 2.9), (10.0, 4.0, -1.1)]


def matrix(pose: tuple[float, float, float]) -> np.ndarray:
    x, y, yaw = pose
    return np.array([[math.cos(yaw), -math.sin(yaw), x], [math.sin(yaw), math.cos(yaw), y], [0.0, 0.0, 1.0]])


@pytest.mark.parametrize("pose", POSES)
def test_points_go_to_the_world_as_by_a_homogeneous_matrix(pose: tuple[float, float, float]) -> None:
    points = np.random.default_rng(0).normal(size=(7, 2))
    expected = (matrix(pose) @ np.column_stack([points, np.ones(7)]).T).T[:, :2]
    np.testing.assert_allclose(to_world(points, pose), expected, atol=1e-12)
    np.testing.assert_allclose(to_local(expected, np.array(pose)), points, atol=1e-12)


def test_points_go_to_the_world_as_by_shapely() -> None:
    point = affinity.translate(affinity.rotate(Point(3.0, 0.5), 90.0, origin=(0.0, 0.0)), 1.0, 2.0)
    np.testing.assert_allclose(to_world([[3.0, 0.5]], (1.0, 2.0, math.pi / 2)), [[point.x, point.y]], atol=1e-12)


@pytest.mark.parametrize("frame", POSES)
@pytest.mark.parametrize("pose", POSES)
def test_poses_compose_as_their_matrices_multiply(
    frame: tuple[float, float, float], pose: tuple[float, float, float]
) -> None:
    whole = compose(frame, pose)
    np.testing.assert_allclose(matrix(whole), matrix(frame) @ matrix(pose), atol=1e-12)
    np.testing.assert_allclose(matrix(relative(frame, whole)), matrix(pose), atol=1e-12)
    assert -math.pi < whole[2] <= math.pi


def test_no_points_stay_no_points() -> None:
    assert to_world(np.empty((0, 2)), (1.0, 2.0, 0.3)).shape == (0, 2)
    assert to_local(np.empty((0, 2)), (1.0, 2.0, 0.3)).shape == (0, 2)
