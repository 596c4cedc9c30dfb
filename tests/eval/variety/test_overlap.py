"""The overlap of the furniture of two floors, against shapely."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from room_sketches import sketch
from shapely import affinity

from labgym.eval.variety.describe import best_overlap, occupied, overlaps


def random_boxes(rng: np.random.Generator, width: float, depth: float, count: int = 12) -> np.ndarray:
    return np.column_stack(
        [
            rng.uniform(1.0, width - 1.0, count),
            rng.uniform(1.0, depth - 1.0, count),
            rng.uniform(0.6, 1.8, count),
            rng.uniform(0.6, 0.9, count),
            rng.choice([0.0, math.pi / 2.0, 0.3], count),
        ]
    )


def polygon(boxes: np.ndarray, width: float, depth: float) -> shapely.Geometry:
    """The union of boxes on a floor stretched onto the unit square."""
    parts = [
        affinity.rotate(shapely.box(x - w / 2, y - d / 2, x + w / 2, y + d / 2), yaw, use_radians=True)
        for x, y, w, d, yaw in boxes
    ]
    return affinity.scale(shapely.union_all(parts), 1.0 / width, 1.0 / depth, origin=(0, 0))


def exact_overlap(first: shapely.Geometry, second: shapely.Geometry) -> float:
    best = 0.0
    for mirror in (1.0, -1.0):
        for quarter in range(4):
            image = affinity.rotate(affinity.scale(second, mirror, 1.0, origin=(0.5, 0.5)), 90 * quarter, (0.5, 0.5))
            best = max(best, first.intersection(image).area / first.union(image).area)
    return best


@pytest.mark.parametrize("seed", range(4))
def test_the_overlap_is_that_of_shapely(seed):
    rng = np.random.default_rng(seed)
    sizes = [(9.0, 7.0), (8.0, 6.5)]
    boxes = [random_boxes(rng, *size) for size in sizes]
    floors = [sketch(*size, each) for size, each in zip(sizes, boxes, strict=True)]
    expected = exact_overlap(*(polygon(each, *size) for each, size in zip(boxes, sizes, strict=True)))
    assert best_overlap(*map(occupied, floors)) == pytest.approx(expected, abs=0.01)


def test_a_turned_and_mirrored_copy_overlaps_wholly():
    boxes = random_boxes(np.random.default_rng(9), 10.0, 6.0)
    turned = boxes[:, [1, 0, 2, 3, 4]] * (1.0, 1.0, 1.0, 1.0, -1.0) + (0.0, 0.0, 0.0, 0.0, math.pi / 2.0)
    assert best_overlap(occupied(sketch(10.0, 6.0, boxes)), occupied(sketch(6.0, 10.0, turned))) > 0.97


def test_only_floors_of_about_one_size_are_compared():
    boxes = random_boxes(np.random.default_rng(0), 8.0, 6.0)
    floors = [sketch(8.0, 6.0, boxes), sketch(6.0, 8.0, boxes), sketch(12.0, 6.0, boxes)]
    assert len(overlaps(floors, [48.0, 48.0, 72.0])) == 1
    assert overlaps(floors[::2], [48.0, 72.0]) == []


def test_floors_without_furniture_do_not_overlap():
    empty = sketch(8.0, 6.0, np.empty((0, 5)))
    assert overlaps([empty, empty], [48.0, 48.0]) == [0.0]
