"""Paired penetration, inset and overlap volume against shapely."""

from __future__ import annotations

import math

import numpy as np
import pytest
from shapely.geometry import MultiPoint, Point, Polygon

from labgym.geometry import BoxArray, OrientedBox, interpenetrating, overlapping_bounds, pairwise_penetration
from labgym.geometry.overlap import overlap_volume, paired_inset, paired_penetration


def boxes(seed: int, count: int, spread: float = 1.0) -> list[OrientedBox]:
    rng = np.random.default_rng(seed)
    found = []
    for _ in range(count):
        x, y = rng.uniform(-spread, spread, 2)
        width, depth = rng.uniform(0.1, 1.5, 2)
        yaw = rng.choice([0.0, math.pi / 2, rng.uniform(-math.pi, math.pi)])
        z0 = rng.uniform(0.0, 1.0)
        found.append(OrientedBox(x, y, width, depth, float(yaw), z0, z0 + rng.uniform(0.1, 1.0)))
    return found


def minkowski_depth(a: OrientedBox, b: OrientedBox) -> float:
    """Least translation that parts two footprints: from the origin to the boundary of the Minkowski difference."""
    hull = MultiPoint([p - q for p in a.corners() for q in b.corners()]).convex_hull
    gap = hull.exterior.distance(Point(0.0, 0.0))
    return gap if hull.contains(Point(0.0, 0.0)) else -gap


def test_paired_penetration_is_the_least_translation_that_parts_two_boxes() -> None:
    first, second = boxes(0, 300), boxes(1, 300)
    depths = paired_penetration(BoxArray.of(first), BoxArray.of(second))
    compared = 0
    for a, b, depth in zip(first, second, depths, strict=True):
        vertical = min(a.z1, b.z1) - max(a.z0, b.z0)
        planar = minkowski_depth(a, b)
        assert (depth > 0.0) == (planar > 0.0 and vertical > 0.0)
        if planar > 0.0 and vertical > 0.0:
            assert depth == pytest.approx(min(planar, vertical), abs=1e-9)
            compared += 1
    assert compared > 50


def test_paired_penetration_is_the_diagonal_of_the_pairwise_one() -> None:
    first, second = BoxArray.of(boxes(2, 60)), BoxArray.of(boxes(3, 60))
    np.testing.assert_allclose(
        paired_penetration(first, second), np.diag(pairwise_penetration(first, second)), atol=1e-12
    )


def test_overlap_volume_is_the_polygon_intersection_times_the_common_height() -> None:
    overlapping = 0
    for a, b in zip(boxes(4, 300), boxes(5, 300), strict=True):
        height = max(0.0, min(a.z1, b.z1) - max(a.z0, b.z0))
        expected = Polygon(a.corners()).intersection(Polygon(b.corners())).area * height
        assert overlap_volume(a, b) == pytest.approx(expected, abs=1e-12)
        assert overlap_volume(b, a) == pytest.approx(expected, abs=1e-12)
        overlapping += expected > 0.0
    assert overlapping > 50


def test_inset_is_the_distance_from_the_footprint_to_the_nearest_side_and_negative_outside() -> None:
    inner = [OrientedBox(b.x / 2, b.y / 2, b.width / 4, b.depth / 4, b.yaw) for b in boxes(6, 200)]
    outer = [OrientedBox(0.0, 0.0, b.width + 0.5, b.depth + 0.5, b.yaw) for b in boxes(7, 200)]
    insets = paired_inset(BoxArray.of(inner), BoxArray.of(outer))
    inside = 0
    for a, b, inset in zip(inner, outer, insets, strict=True):
        small, large = Polygon(a.corners()), Polygon(b.corners())
        assert (inset >= -1e-12) == large.buffer(1e-9).contains(small)
        if large.contains(small):
            assert inset == pytest.approx(large.exterior.distance(small), abs=1e-9)
            inside += 1
    assert 20 < inside < 180


@pytest.mark.parametrize("depth", [-0.1, 0.0, 0.05, 0.3])
def test_a_sweep_finds_the_pairs_of_all_bounds_in_the_order_of_their_rows(depth: float) -> None:
    for seed in range(10):
        (low_a, high_a), (low_b, high_b) = (
            BoxArray.of(boxes(seed + k, count, 4.0)).bounds() for k, count in ((0, 80), (20, 50))
        )
        overlap = np.minimum(high_a[:, None], high_b[None]) - np.maximum(low_a[:, None], low_b[None])
        expected = np.argwhere((overlap > depth).all(axis=2))
        found = overlapping_bounds((low_a, high_a), (low_b, high_b), depth)
        assert np.column_stack(found).tolist() == expected.tolist()
        assert len(expected) > 10


@pytest.mark.parametrize("depth", [0.0, 0.05])
def test_interpenetrating_boxes_are_those_of_all_pairs_to_the_bit(depth: float) -> None:
    thin = [OrientedBox(b.x, b.y, b.width, 0.02, b.yaw, b.z0, b.z1) for b in boxes(40, 60, 3.0)]
    for seed in range(10):
        first, second = BoxArray.of(boxes(seed, 80, 3.0)), BoxArray.of([*boxes(seed + 20, 50, 3.0), *thin])
        depths = pairwise_penetration(first, second)
        expected = np.argwhere(depths > depth)
        rows, others, found = interpenetrating(first, second, depth)
        assert np.column_stack([rows, others]).tolist() == expected.tolist()
        assert found.tolist() == depths[rows, others].tolist()
        assert len(expected) > 50
    nothing = BoxArray.of([])
    assert [len(part) for part in interpenetrating(nothing, first)] == [0, 0, 0]
    assert [len(part) for part in interpenetrating(first, nothing)] == [0, 0, 0]


def test_bounds_are_those_of_each_box() -> None:
    some = boxes(8, 50)
    low, high = BoxArray.of(some).bounds()
    expected = [(*box.bounds(), box.z0, box.z1) for box in some]
    np.testing.assert_allclose(np.column_stack([low[:, :2], high[:, :2], low[:, 2], high[:, 2]]), expected, atol=1e-12)
