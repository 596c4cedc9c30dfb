from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from labgym.geometry import OrientedBox
from labgym.navigation.barriers import Barriers
from labgym.navigation.clearance import Obstacles
from labgym.navigation.free_space import CertainCells, FreeSpace, free_arcs
from labgym.navigation.tangents import Corners

R = 0.30


def random_boxes(rng: np.random.Generator, count: int) -> list[OrientedBox]:
    return [
        OrientedBox(*rng.uniform(0.5, 7.5, 2), *rng.uniform(0.1, 2.0, 2), float(rng.uniform(-math.pi, math.pi)))
        for _ in range(count)
    ]


def segments(rng: np.random.Generator, count: int) -> tuple[np.ndarray, np.ndarray]:
    starts = rng.uniform(0.0, 8.0, (count, 2))
    return starts, starts + rng.normal(0.0, rng.choice([0.2, 1.0, 5.0]), (count, 2))


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), count=st.integers(0, 30))
def test_clear_segments_are_those_whose_distance_to_every_polygon_is_at_least_the_radius(seed, count):
    rng = np.random.default_rng(seed)
    boxes = random_boxes(rng, count)
    starts, ends = segments(rng, 40)
    lines = shapely.linestrings(np.stack([starts, ends], axis=1))
    distances = [shapely.distance(shapely.Polygon(box.corners()), lines) for box in boxes]
    nearest = np.min(distances, axis=0, initial=math.inf)
    certain = np.abs(nearest - R) > 1e-9
    clear = Obstacles(boxes).segments_clear(starts, ends, R)
    assert (clear == (nearest >= R))[certain].all()


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), radius=st.sampled_from([0.05, 0.3, 1.0]))
def test_blocked_cells_never_reject_a_clear_segment(seed, radius):
    rng = np.random.default_rng(seed)
    obstacles = Obstacles(random_boxes(rng, 12))
    starts, ends = segments(rng, 300)
    cells = CertainCells(obstacles, radius, np.array([0.0, 0.0]), np.array([8.0, 8.0]))
    blocked = cells.block(starts, ends)
    nearest = obstacles.segment_distances(starts, ends).min(axis=1)
    assert not (blocked & (nearest >= radius)).any()


@pytest.mark.parametrize("seed", range(8))
def test_points_with_a_common_region_lie_in_one_piece_of_the_buffered_polygons_complement(make_plan, seed):
    rng = np.random.default_rng(seed)
    boxes = random_boxes(rng, 14)
    space = FreeSpace(Barriers.of(make_plan(*boxes)), R)
    blocked = shapely.unary_union([shapely.Polygon(box.corners()).buffer(R - 1e-6, quad_segs=64) for box in boxes])
    free = shapely.difference(shapely.box(R, R, 8.0 - R, 8.0 - R), blocked)
    points = rng.uniform(0.0, 8.0, (60, 2))
    points = points[space.holds(points)]
    pieces = shapely.contains(np.array(shapely.get_parts(free))[:, None], shapely.points(points)).argmax(axis=0)
    regions = [space.regions(point) for point in points]
    assert any(len(own) for own in regions)
    for first, second in itertools.combinations(range(len(points)), 2):
        if np.isin(regions[first], regions[second]).any():
            assert pieces[first] == pieces[second]


@pytest.mark.parametrize("seed", range(6))
def test_free_arcs_are_the_parts_of_the_quarters_outside_the_buffered_polygons(make_plan, seed):
    rng = np.random.default_rng(seed)
    boxes = random_boxes(rng, 14)
    barriers = Barriers.of(make_plan(*boxes))
    corners = Corners.of(barriers.obstacles, R)
    arcs = free_arcs(corners, FreeSpace(barriers, R))
    turns = np.linspace(0.0, math.pi / 2.0, 181)
    corner = np.repeat(np.arange(len(corners.begin)), len(turns))
    turn = np.tile(turns, len(corners.begin))
    points = corners.at_turn(corner, turn)
    nearest = np.min([shapely.distance(shapely.Polygon(b.corners()), shapely.points(points)) for b in boxes], axis=0)
    margin = np.minimum(nearest - R, np.minimum(points, 8.0 - points).min(axis=1) - R)
    on_arc = np.zeros(len(corner), dtype=bool)
    for k, (begin, end) in zip(arcs.corner, arcs.span, strict=True):
        on_arc |= (corner == k) & (turn >= begin - 1e-6) & (turn <= end + 1e-6)
    # A sample on its own quarter has margin 0 up to rounding if it is free.
    assert on_arc[margin > -1e-9].all()
    assert not on_arc[margin < -1e-6].any()
    assert on_arc.any()
