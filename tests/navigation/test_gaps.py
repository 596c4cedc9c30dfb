from __future__ import annotations

import math

import numpy as np
import pytest

from labgym.geometry import OrientedBox
from labgym.navigation import Gaps, GoalPair, ShortestPaths, route_measures


def partition(*gaps: tuple[float, float], y: float = 4.0) -> list[OrientedBox]:
    """A wall across an 8 m room with gaps (left, right)."""
    edges = [0.0, *(x for gap in gaps for x in gap), 8.0]
    pieces = zip(edges[::2], edges[1::2], strict=True)
    return [OrientedBox((x0 + x1) / 2.0, y, x1 - x0, 0.2) for x0, x1 in pieces]


def route(plan, start, goal) -> np.ndarray:
    return ShortestPaths(plan).path(start, goal).points


def test_an_open_room_has_no_gap(make_plan):
    plan = make_plan()
    gaps = Gaps(plan)
    assert gaps.narrowest(route(plan, (3.5, 4.0), (4.5, 4.0))) == 3.0
    assert gaps.widest(route(plan, (1.0, 1.0), (7.0, 7.0))) == 3.0


def test_a_door_is_as_wide_as_its_opening(make_plan):
    plan = make_plan(*partition((3.0, 3.9)))
    way = route(plan, (4.0, 1.0), (4.0, 7.0))
    assert Gaps(plan).narrowest(way) == pytest.approx(0.9)
    assert Gaps(plan).widest(way) == pytest.approx(0.9)
    assert Gaps(plan).widest(way[::-1]) == pytest.approx(0.9)


def test_the_widest_way_takes_the_wider_of_two_doors_and_the_shortest_the_nearer(make_plan):
    plan = make_plan(*partition((0.8, 1.5), (5.0, 6.3)))
    way = route(plan, (1.0, 1.0), (1.0, 7.0))
    assert Gaps(plan).narrowest(way) == pytest.approx(0.7)
    assert Gaps(plan).widest(way) == pytest.approx(1.3)


def test_the_narrower_of_two_doors_in_a_row_counts(make_plan):
    plan = make_plan(*partition((1.0, 2.1), y=3.0), *partition((5.0, 5.8), y=5.0))
    way = route(plan, (1.5, 1.0), (5.4, 7.0))
    assert Gaps(plan).narrowest(way) == pytest.approx(0.8)
    assert Gaps(plan).widest(way) == pytest.approx(0.8)


@pytest.mark.parametrize("yaw", [0.0, 0.3])
def test_a_drive_within_an_aisle_is_as_narrow_as_the_aisle(make_plan, yaw):
    u, n = np.array([math.cos(yaw), math.sin(yaw)]), np.array([-math.sin(yaw), math.cos(yaw)])
    benches = [OrientedBox(*(np.array([4.0, 4.0]) + side * 0.85 * n), 5.0, 0.75, yaw) for side in (-1.0, 1.0)]
    plan = make_plan(*benches)
    way = route(plan, np.array([4.0, 4.0]) - u, np.array([4.0, 4.0]) + u)
    assert Gaps(plan).narrowest(way) == pytest.approx(0.95)


def test_the_gap_between_an_island_and_a_corner_is_diagonal(make_plan):
    plan = make_plan(OrientedBox(2.0, 2.0, 4.0, 4.0), OrientedBox(6.3, 6.4, 3.4, 3.2))
    way = route(plan, (1.0, 6.0), (7.0, 2.0))
    assert Gaps(plan).narrowest(way) == pytest.approx(math.hypot(0.6, 0.8))


@pytest.mark.parametrize("seed", range(8))
def test_the_widest_way_is_that_of_the_largest_disc_that_gets_through(make_plan, seed):
    rng = np.random.default_rng(seed)
    plan = make_plan(
        *(
            OrientedBox(*rng.uniform(1.5, 6.5, 2), *rng.uniform(0.2, 1.6, 2), float(rng.uniform(-3.0, 3.0)))
            for _ in range(8)
        )
    )
    gaps, small = Gaps(plan), ShortestPaths(plan, 0.05)
    points = rng.uniform(0.5, 7.5, (200, 2))
    clearance = np.minimum(small.space.obstacles.nearest(points), np.minimum(points, 8.0 - points).min(axis=1))
    compared = 0
    for start, goal in points[clearance > 0.3][:24].reshape(-1, 2, 2):
        path = small.path(start, goal)
        ends = 2.0 * np.minimum(*clearance[[np.flatnonzero((points == end).all(axis=1))[0] for end in (start, goal)]])
        width = 0.0 if path is None else gaps.widest(path.points)
        if 0.1 < width < min(ends, 3.0) - 1e-6:
            assert ShortestPaths(plan, width / 2.0 - 1e-6).connected(start, goal)
            assert not ShortestPaths(plan, width / 2.0 + 1e-6).connected(start, goal)
            assert gaps.narrowest(path.points) <= width + 1e-9
            compared += 1
        elif path is not None and width >= ends:
            assert ShortestPaths(plan, ends / 2.0 - 1e-6).connected(start, goal)
    assert compared > 0 or seed > 0


def test_measures_of_a_drive_are_those_of_its_closed_form(make_plan):
    plan = make_plan(*partition((0.8, 1.5), (5.0, 6.3)))
    pairs = [
        GoalPair(0, (1.15, 1.0, 0.0), (1.15, 7.0, 0.0), "Hood", "Sink"),
        GoalPair(1, (2.0, 2.0, 0.0), (5.0, 2.0, 0.0), "Hood", "Sink"),
        GoalPair(2, (2.0, 2.0, 0.0), (5.0, 4.0, 0.0), "Hood", "Sink"),
        GoalPair(3, (4.0, 2.0, 0.0), (4.0, 6.0, 0.0), "Hood", "Sink"),
    ]
    near, free, blocked, around = route_measures(plan, pairs)
    assert (near.length, near.detour, near.neck, near.widest_neck) == pytest.approx((6.0, 1.0, 0.7, 1.3))
    assert (free.length, free.detour, free.neck, free.widest_neck) == pytest.approx((3.0, 1.0, 3.0, 3.0))
    assert blocked is None
    # Around the edge of the wider door at x = 5, y = 3.9 and 4.1: two tangents, two arcs and 0.2 m straight.
    reach = math.hypot(1.0, 1.9)
    arc = math.atan2(1.0, 1.9) + math.asin(0.3 / reach)
    length = 2.0 * (math.sqrt(reach**2 - 0.3**2) + 0.3 * arc) + 0.2
    assert (around.length, around.detour) == pytest.approx((length, length / 4.0))
    assert (around.neck, around.widest_neck) == pytest.approx((1.3, 1.3))
