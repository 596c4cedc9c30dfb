from __future__ import annotations

import math

import numpy as np
import pytest
import shapely

from labgym.geometry import OrientedBox
from labgym.navigation import LengthsTo, ShortestPaths

R = 0.30


def random_boxes(rng: np.random.Generator, count: int) -> list[OrientedBox]:
    return [
        OrientedBox(*rng.uniform(1.0, 7.0, 2), *rng.uniform(0.2, 1.6, 2), float(rng.uniform(-math.pi, math.pi)))
        for _ in range(count)
    ]


@pytest.mark.parametrize("seed", range(4))
def test_lengths_are_those_of_the_shortest_paths(make_plan, seed):
    rng = np.random.default_rng(seed)
    paths = ShortestPaths(make_plan(*random_boxes(rng, 9)))
    points = rng.uniform(0.4, 7.6, (200, 2))
    goal, *starts = points[paths.space.holds(points)][:40]
    field = LengthsTo(paths, goal)
    compared = 0
    for start in starts:
        path = paths.path(start, goal)
        if path is not None:
            assert field.at(*start) == pytest.approx(path.length, abs=1e-9)
            compared += 1
    assert compared > 10


@pytest.mark.parametrize("seed", range(4))
def test_the_nearest_free_point_is_that_of_the_polygons(make_plan, seed):
    rng = np.random.default_rng(seed)
    boxes = random_boxes(rng, 9)
    paths = ShortestPaths(make_plan(*boxes))
    grown = shapely.union_all([shapely.buffer(shapely.Polygon(box.corners()), R, quad_segs=64) for box in boxes])
    free = shapely.difference(shapely.box(R, R, 8.0 - R, 8.0 - R), grown)
    for point in rng.uniform(0.0, 8.0, (100, 2)):
        if not paths.space.holds(point[None])[0]:
            nearest = paths.graph.boundary.nearest(point)
            assert paths.space.holds(nearest[None])[0]
            # Chords of 90 / 64 degrees are inside the circles by 2e-5 m.
            assert math.dist(point, nearest) == pytest.approx(shapely.distance(free, shapely.Point(point)), abs=1e-4)


def test_from_a_place_that_is_not_free_the_way_leads_through_the_nearest_free_point(make_plan):
    field = LengthsTo(ShortestPaths(make_plan()), (4.0, 4.0))
    assert field.at(0.1, 4.0) == pytest.approx(3.9)
    assert field.at(-1.0, 4.0) == pytest.approx(5.0)
    pillar = LengthsTo(ShortestPaths(make_plan(OrientedBox(2.0, 4.0, 0.2, 0.2))), (4.0, 4.0))
    # 0.25 m before the pillar's face, out by 5 cm, then around.
    straight = LengthsTo(ShortestPaths(make_plan(OrientedBox(2.0, 4.0, 0.2, 0.2))), (4.0, 4.0)).at(1.6, 4.0)
    assert pillar.at(1.65, 4.0) == pytest.approx(straight + 0.05)


def test_a_goal_that_is_not_free_has_no_lengths_and_a_cut_off_place_has_a_finite_one(make_plan):
    wall = OrientedBox(4.0, 4.0, 0.2, 8.0)
    paths = ShortestPaths(make_plan(wall, OrientedBox(6.0, 4.0, 1.0, 1.0)))
    assert math.isinf(LengthsTo(paths, (4.0, 4.0)).at(1.0, 1.0))
    assert not LengthsTo(paths, (4.0, 4.0)).reachable
    assert 4.0 <= LengthsTo(paths, (5.0, 4.0)).at(1.0, 4.0) < 8.0
