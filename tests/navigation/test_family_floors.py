"""Free positions, lengths and feasibility on floors of all families, against polygons."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pytest
import shapely
from polygon_paths import PolygonPaths

from labgym.geometry import OrientedBox
from labgym.layouts.floor import Floor
from labgym.layouts.floors import FAMILIES, draw_floor
from labgym.navigation import OBSTACLE_HEIGHT, PLANNING_RADIUS, GoalPair, ShortestPaths, feasibility, occupancy


@dataclass(frozen=True)
class EmptyFloor:
    floor: Floor
    protocols = ()
    protocol = None

    def obstacles(self, below: float) -> tuple[OrientedBox, ...]:
        return ()


FLOORS = [(family, seed) for family in FAMILIES for seed in range(2)]


@pytest.fixture(scope="module", params=FLOORS, ids=lambda one: f"{one[0]}-{one[1]}")
def floor(request) -> Floor:
    return draw_floor(*request.param).floor


@pytest.fixture(scope="module")
def paths(floor) -> ShortestPaths:
    return ShortestPaths(EmptyFloor(floor))


@pytest.fixture(scope="module")
def polygons(floor) -> PolygonPaths:
    boxes = [box for box in floor.solids if box.z0 < OBSTACLE_HEIGHT]
    return PolygonPaths(boxes, PLANNING_RADIUS, floor.bounds)


@pytest.fixture(scope="module")
def points(floor) -> np.ndarray:
    """Random points in the spaces."""
    x0, y0, x1, y1 = floor.bounds
    points = np.random.default_rng(0).uniform((x0, y0), (x1, y1), (2000, 2))
    return points[floor.inside(points)]


@pytest.mark.cases(5)
def test_a_point_in_a_space_is_free_if_the_disc_there_overlaps_no_solid(paths, polygons, points):
    margin = shapely.distance(shapely.boundary(polygons.free), shapely.points(points))
    certain = margin > 1e-3
    free = shapely.contains(polygons.free, shapely.points(points))
    assert (paths.space.holds(points) == free)[certain].all()
    assert free.any()


def test_points_outside_of_the_walls_are_not_free(floor, paths):
    x0, y0, x1, y1 = floor.bounds
    points = np.random.default_rng(1).uniform((x0 - 3.0, y0 - 3.0), (x1 + 3.0, y1 + 3.0), (4000, 2))
    regions = [shapely.Polygon(box.corners()) for space in floor.spaces for box in space.boxes]
    # Regions of rectangles leave wedges along oblique walls.
    away = shapely.distance(shapely.union_all(regions), shapely.points(points)) > 0.5
    assert away.sum() > 100
    assert not paths.space.holds(points[away]).any()


def test_lengths_and_connections_are_those_of_the_polygons(paths, polygons, points):
    free = points[paths.space.holds(points)]
    for start, goal in free[:24].reshape(-1, 2, 2):
        path, chords = paths.path(start, goal), polygons.length(start, goal)
        assert paths.connected(start, goal) == (path is not None)
        if path is None:
            assert math.isinf(chords)
        else:
            assert chords * (1.0 - 1e-6) <= path.length <= chords * 1.0016 + 1e-6


def test_what_the_grid_finds_feasible_is_feasible_by_exact_clearance(floor, points):
    plan = EmptyFloor(floor)
    pairs = [GoalPair(0, (*a, 0.0), (*b, 0.0), "Hood", "Sink") for a, b in points[:60].reshape(-1, 2, 2)]
    # A point may differ from the center of its cell by half a diagonal, so the exact disc is smaller by as much.
    smaller = PLANNING_RADIUS - 0.05 * math.sqrt(0.5)
    exact = feasibility(plan, pairs, smaller, method="exact")
    grid = feasibility(plan, pairs)
    assert all(fine.feasible for fine, coarse in zip(exact, grid, strict=True) if coarse.feasible)
    assert any(verdict.feasible for verdict in grid)


def test_free_cells_are_in_the_spaces(floor):
    grid = occupancy(EmptyFloor(floor))
    x, y = grid.centres()
    rows, columns = np.nonzero(~grid.occupied)
    centers = np.column_stack([x[columns], y[rows]])
    regions = [shapely.Polygon(box.corners()) for space in floor.spaces for box in space.boxes]
    ways = [shapely.Polygon(way.floor.corners()) for way in floor.doorways if not way.exit]
    near = shapely.buffer(shapely.union_all([*regions, *ways]), 0.5)
    assert shapely.contains_xy(near, centers).all()
    area = shapely.union_all(regions).area
    assert len(centers) * 0.05**2 == pytest.approx(area, rel=0.08)
