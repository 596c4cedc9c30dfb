from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from polygon_paths import PolygonPaths

from labgym.errors import OptionError
from labgym.geometry import OrientedBox
from labgym.navigation import ShortestPaths, distance_field, occupancy, shortest_path

R = 0.30


def random_boxes(rng: np.random.Generator, count: int) -> list[OrientedBox]:
    return [
        OrientedBox(*rng.uniform(1.0, 7.0, 2), *rng.uniform(0.2, 1.6, 2), float(rng.uniform(-math.pi, math.pi)))
        for _ in range(count)
    ]


def test_open_floor_is_the_straight_line(make_plan):
    path = shortest_path(make_plan(), (1.0, 2.0), (6.0, 7.5))
    assert path.length == pytest.approx(math.hypot(5.0, 5.5), abs=1e-12)
    assert path.points == pytest.approx(np.array([[1.0, 2.0], [6.0, 7.5]]))


def test_around_a_square_is_tangent_arc_edge_arc_tangent(make_plan):
    plan = make_plan(OrientedBox(4.0, 4.0, 2.0, 2.0))
    start, goal = (1.5, 4.0), (6.5, 4.0)
    to_corner = math.hypot(1.5, 1.0)
    tangent = math.sqrt(to_corner**2 - R**2)
    # The tangent leaves the line to the corner by asin(r / d); the arc turns from its direction to the edge's.
    arc = math.atan2(1.0, 1.5) + math.asin(R / to_corner)
    assert shortest_path(plan, start, goal).length == pytest.approx(2.0 * (tangent + R * arc) + 2.0, abs=1e-9)


def test_around_one_corner_is_two_tangents_and_an_arc(make_plan):
    plan = make_plan(OrientedBox(2.0, 2.0, 4.0, 4.0))
    start, goal, corner = np.array([1.0, 5.0]), np.array([6.0, 1.0]), np.array([4.0, 4.0])
    d1, d2 = np.linalg.norm(start - corner), np.linalg.norm(goal - corner)
    round_the_outside = math.atan2(1.0, -3.0) - math.atan2(-3.0, 2.0)
    arc = round_the_outside - math.acos(R / d1) - math.acos(R / d2)
    expected = math.sqrt(d1**2 - R**2) + math.sqrt(d2**2 - R**2) + R * arc
    assert shortest_path(plan, start, goal).length == pytest.approx(expected, abs=1e-9)


def test_a_slalom_crosses_over_on_the_inner_tangent(make_plan):
    plan = make_plan(OrientedBox(2.5, 5.5, 1.0, 5.0), OrientedBox(5.5, 2.5, 1.0, 5.0))
    between = math.hypot(2.0, 2.0)
    turn = math.pi / 4.0 + math.asin(2.0 * R / between)
    straight = 3.0 + 1.0 + math.sqrt(between**2 - (2.0 * R) ** 2) + 1.0 + 3.0
    path = shortest_path(plan, (2.0 - R, 6.0), (6.0 + R, 2.0))
    assert path.length == pytest.approx(straight + R * (math.pi + 2.0 * turn), abs=1e-9)


@pytest.mark.parametrize("seed", range(8))
def test_lengths_agree_with_a_visibility_graph_over_polygons(make_plan, seed):
    rng = np.random.default_rng(seed)
    boxes = random_boxes(rng, 5)
    paths, by_polygons = ShortestPaths(make_plan(*boxes)), PolygonPaths(boxes, R, (0.0, 0.0, 8.0, 8.0))
    polygons = [shapely.Polygon(b.corners()) for b in boxes]
    compared = 0
    for _ in range(40):
        start, goal = rng.uniform(0.4, 7.6, (2, 2))
        ends = shapely.points([start, goal])
        if min(shapely.distance(polygon, ends).min() for polygon in polygons) < R + 0.01:
            continue
        exact, chords = paths.path(start, goal), by_polygons.length(start, goal)
        if exact is None:
            assert math.isinf(chords)
        else:
            assert chords * (1.0 - 1e-6) <= exact.length <= chords * 1.0016 + 1e-6
        compared += 1
        if compared == 3:
            break
    assert compared > 0


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), count=st.integers(1, 25))
def test_a_path_is_one_that_the_disc_can_drive(make_plan, seed, count):
    rng = np.random.default_rng(seed)
    boxes = random_boxes(rng, count)
    paths = ShortestPaths(make_plan(*boxes))
    start, goal = rng.uniform(0.4, 7.6, (2, 2))
    path = paths.path(start, goal)
    if path is None:
        return
    line = shapely.LineString(path.points)
    nearest = min(line.distance(shapely.Polygon(box.corners())) for box in boxes)
    sagitta = R * (1.0 - math.cos(math.radians(2.5)))
    assert nearest >= R - sagitta - 1e-6
    assert shapely.box(R - 1e-6, R - 1e-6, 8.0 - R + 1e-6, 8.0 - R + 1e-6).covers(line)
    assert line.length <= path.length + 1e-9
    assert line.length == pytest.approx(path.length, rel=4e-4)
    assert path.length >= math.dist(start, goal) - 1e-9
    assert paths.path(goal, start).length == pytest.approx(path.length, abs=1e-9)


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), count=st.integers(1, 15))
def test_lengths_are_below_the_grids_and_within_its_distortion(make_plan, seed, count):
    rng = np.random.default_rng(seed)
    plan = make_plan(*random_boxes(rng, count))
    grid = occupancy(plan).dilated(R)
    free = np.argwhere(~grid.occupied)
    start, goal = (grid.centre_of(*free[k]) for k in rng.integers(len(free), size=2))
    by_grid = distance_field(grid, start)[grid.cell_of(*goal)]
    exact = shortest_path(plan, start, goal)
    if math.isfinite(by_grid):
        assert exact.length <= by_grid + 1e-9
    # Cells grow obstacles by 3 cm at most, a point is 1.5 cm from its cell's centre, a step needs its neighbours.
    loose = occupancy(plan, 0.02).dilated(R - 0.07)
    if exact is not None:
        assert exact.length >= distance_field(loose, start)[loose.cell_of(*goal)] / 1.0824 - 0.06


@pytest.mark.parametrize("gap, open_", [(0.6002, True), (0.6, True), (0.5998, False)])
def test_a_gap_is_passable_from_twice_the_radius(make_plan, gap, open_):
    edge = (8.0 - gap) / 2.0
    plan = make_plan(OrientedBox(edge / 2.0, 4.0, edge, 0.5), OrientedBox(8.0 - edge / 2.0, 4.0, edge, 0.5))
    assert (shortest_path(plan, (4.0, 2.0), (4.0, 6.0)) is not None) is open_


@pytest.mark.parametrize("gap, open_", [(0.6002, True), (0.5998, False)])
def test_a_gap_beside_the_wall_is_passable_from_twice_the_radius(make_plan, gap, open_):
    plan = make_plan(OrientedBox(gap + 4.0, 4.0, 8.0, 0.5))
    assert (shortest_path(plan, (4.0, 2.0), (4.0, 6.0)) is not None) is open_


def test_a_row_of_flush_cabinets_is_as_one_block(make_plan):
    row = [OrientedBox(2.0 + 0.6 * k, 4.0, 0.6, 0.5) for k in range(6)]
    block = OrientedBox(3.5, 4.0, 3.6, 0.5)
    start, goal = (2.2, 3.2), (4.9, 5.1)
    assert shortest_path(make_plan(*row), start, goal).length == pytest.approx(
        shortest_path(make_plan(block), start, goal).length, abs=1e-6
    )


def test_an_end_where_the_disc_does_not_fit_has_no_path(make_plan):
    plan = make_plan(OrientedBox(4.0, 4.0, 1.0, 1.0))
    assert shortest_path(plan, (4.0, 4.0), (1.0, 1.0)) is None
    assert shortest_path(plan, (1.0, 1.0), (4.0, 3.21)) is None
    assert shortest_path(plan, (1.0, 1.0), (4.0, 3.19)) is not None
    assert shortest_path(plan, (0.2, 1.0), (1.0, 1.0)) is None
    assert shortest_path(plan, (1.0, 1.0), (9.0, 1.0)) is None


def test_a_smaller_disc_never_drives_further(make_plan):
    plan = make_plan(*random_boxes(np.random.default_rng(3), 8))
    lengths = [shortest_path(plan, (0.5, 0.5), (7.5, 7.5), radius).length for radius in (0.1, 0.2, 0.3)]
    assert lengths == sorted(lengths)


@pytest.mark.parametrize("radius", [0.0, -1.0, math.nan])
def test_a_disc_without_a_size_is_refused(make_plan, radius):
    with pytest.raises(OptionError, match="radius"):
        ShortestPaths(make_plan(), radius)
