"""Exact driving distances, compiled, against those of `labgym.navigation`."""

from __future__ import annotations

import numpy as np
import pytest
from laboratories import island_laboratory

pytest.importorskip("numba")

from labgym.envs.planar.routes import CompiledDistanceToGo, RouteLengths, compiled_to_go
from labgym.envs.world import World
from labgym.layouts import Layout, load_published
from labgym.layouts.places import layout_at
from labgym.navigation import goal_pairs

LAYOUTS = {
    "island": island_laboratory,
    "room": lambda: load_published("val", "val-con_01"),
    "floor": lambda: layout_at("floors-train", 1, first=900),
}


@pytest.mark.parametrize("name", LAYOUTS)
def test_the_lengths_agree_to_rounding_on_free_ground_near_furniture_and_in_regions_that_are_cut_off(name: str) -> None:
    layout: Layout = LAYOUTS[name]()
    world = World(layout)
    exact = world.to_go(goal_pairs(layout)[0].goal, "exact")
    compiled = compiled_to_go(world, exact)
    assert isinstance(compiled, CompiledDistanceToGo)
    points = np.random.default_rng(0).uniform(world._barriers.low, world._barriers.high, (200, 2))
    points = points[world._barriers.inside(points)]
    expected = [exact.at(x, y) for x, y in points.tolist()]
    assert [compiled.at(x, y) for x, y in points.tolist()] == pytest.approx(expected, rel=0.0, abs=1e-9)
    free = world.clearances(points, 0.30) > 0.0
    assert free.any()
    assert not free.all()


def test_what_was_measured_before_changes_no_bit() -> None:
    layout = load_published("val", "val-con_01")
    world = World(layout)
    to_go = compiled_to_go(world, world.to_go(goal_pairs(layout)[0].goal, "exact"))
    assert isinstance(to_go, CompiledDistanceToGo)
    points = np.random.default_rng(1).uniform(world._barriers.low, world._barriers.high, (100, 2))
    poses = np.column_stack([points, np.zeros(len(points))])
    forwards = [to_go.at(x, y) for x, y in points.tolist()]
    backwards = [to_go.at(x, y) for x, y in points[::-1].tolist()]
    assert forwards == backwards[::-1]
    many = RouteLengths(len(points))
    for robot in range(len(points)):
        many.place(robot, to_go, poses)
    many.measure(0, len(points), poses)
    assert many.to_go.tolist() == forwards


def test_distances_by_the_grid_and_to_goals_without_room_for_the_disc_stay_as_they_are() -> None:
    world = World(island_laboratory())
    for to_go in (world.to_go((5.0, 4.2, 0.0), "grid"), world.to_go((0.01, 0.01, 0.0), "exact")):
        assert compiled_to_go(world, to_go) is to_go
