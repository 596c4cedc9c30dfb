from __future__ import annotations

import math

import numpy as np
import pytest

from labgym.errors import UnknownNameError
from labgym.geometry import OrientedBox
from labgym.navigation import METHODS, GoalPair, ShortestPaths, astar, feasibility, occupancy, transitions

HOOD = OrientedBox(2.0, 7.6, 1.5, 0.8, math.pi)
BENCH = OrientedBox(6.0, 0.4, 1.5, 0.8)


def only(make_protocol, plan) -> tuple[str | None, tuple[str, ...]]:
    (verdict,) = transitions(plan, make_protocol("Hood", "Bench"))
    return verdict.failure, verdict.ends


def test_an_open_drive_is_feasible(make_plan, make_protocol):
    assert only(make_protocol, make_plan(named={"Hood": HOOD, "Bench": BENCH})) == (None, ())


def test_a_location_that_is_not_placed_is_missing(make_plan, make_protocol):
    assert only(make_protocol, make_plan(named={"Hood": HOOD})) == ("missing", ("goal",))


def test_an_end_with_something_in_front_is_invalid(make_plan, make_protocol):
    crate = OrientedBox(2.0, 6.6, 0.3, 0.3)
    assert only(make_protocol, make_plan(crate, named={"Hood": HOOD, "Bench": BENCH})) == (
        "endpoint_invalid",
        ("start",),
    )


def test_a_device_that_faces_its_wall_has_its_pose_outside_the_room(make_plan, make_protocol):
    turned = OrientedBox(6.0, 0.4, 1.5, 0.8, math.pi)
    assert only(make_protocol, make_plan(named={"Hood": HOOD, "Bench": turned})) == ("outside_room", ("goal",))


def test_a_wall_between_makes_it_unreachable(make_plan, make_protocol):
    wall = OrientedBox(4.0, 4.0, 8.0, 0.2)
    assert only(make_protocol, make_plan(wall, named={"Hood": HOOD, "Bench": BENCH})) == ("unreachable", ())


@pytest.mark.parametrize("seed", range(6))
def test_feasible_is_what_astar_finds_a_path_for(make_plan, seed):
    rng = np.random.default_rng(seed)
    boxes = [OrientedBox(*rng.uniform(0.5, 7.5, 2), *rng.uniform(0.3, 2.2, 2)) for _ in range(14)]
    plan = make_plan(*boxes)
    ends = rng.uniform(0.31, 7.69, (30, 2, 2))
    pairs = [GoalPair(k, (*a, 0.0), (*b, 0.0), "Hood", "Sink") for k, (a, b) in enumerate(ends)]
    grid = occupancy(plan).dilated(0.3)
    reachable = [astar(grid, a, b) is not None for a, b in ends]
    assert [verdict.feasible for verdict in feasibility(plan, pairs)] == reachable
    assert [verdict.feasible for verdict in feasibility(plan, pairs, grid=grid)] == reachable


def aisle(gap: float, yaw: float, offset: float) -> list[OrientedBox]:
    """Two benches of 1.2 x 6 m across the room, with an aisle of width `gap` between them through its middle."""
    u, middle = np.array([math.cos(yaw), math.sin(yaw)]), np.array([4.0 + offset, 4.0])
    return [OrientedBox(*(middle + side * (gap / 2.0 + 3.0) * u), 6.0, 1.2, yaw) for side in (-1.0, 1.0)]


@pytest.mark.parametrize("yaw", [0.0, 0.1, 0.4, math.pi / 4.0])
@pytest.mark.parametrize("offset", [0.0, 0.013])
def test_exact_clearance_passes_every_aisle_that_is_wider_than_the_disc_and_no_other(make_plan, yaw, offset):
    u = np.array([-math.sin(yaw), math.cos(yaw)])
    ends = [(*(np.array([4.0 + offset, 4.0]) + side * 2.0 * u), 0.0) for side in (-1.0, 1.0)]
    pair = GoalPair(0, ends[0], ends[1], "Hood", "Sink")
    for centimeters in (*range(50, 60), *range(61, 76)):
        plan = make_plan(*aisle(centimeters / 100.0, yaw, offset))
        (verdict,) = feasibility(plan, [pair], method="exact")
        assert verdict.failure == (None if centimeters > 60 else "unreachable"), centimeters


def test_the_grid_refuses_an_aisle_that_exact_clearance_passes(make_plan):
    plan = make_plan(*aisle(0.66, 0.4, 0.0))
    pair = GoalPair(0, (3.2, 5.8, 0.0), (4.8, 2.2, 0.0), "Hood", "Sink")
    verdicts = {method: feasibility(plan, [pair], method=method)[0].failure for method in METHODS}
    assert verdicts == {"grid": "unreachable", "exact": None}


@pytest.mark.parametrize("seed", range(6))
def test_exact_feasibility_is_that_a_shortest_path_exists(make_plan, seed):
    rng = np.random.default_rng(seed)
    boxes = [
        OrientedBox(*rng.uniform(0.5, 7.5, 2), *rng.uniform(0.3, 2.2, 2), float(rng.uniform(0.0, 3.0)))
        for _ in range(18)
    ]
    plan = make_plan(*boxes)
    ends = rng.uniform(0.31, 7.69, (30, 2, 2))
    pairs = [GoalPair(k, (*a, 0.0), (*b, 0.0), "Hood", "Sink") for k, (a, b) in enumerate(ends)]
    paths = ShortestPaths(plan)
    exists = [paths.path(a, b) is not None for a, b in ends]
    assert [verdict.feasible for verdict in feasibility(plan, pairs, method="exact")] == exists


def test_an_unknown_method_is_refused(make_plan, make_protocol):
    with pytest.raises(UnknownNameError, match="exact"):
        transitions(make_plan(), make_protocol("Hood", "Bench"), method="fine")
