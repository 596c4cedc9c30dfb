from __future__ import annotations

import gc
import weakref

import furnished_floors
import numpy as np
import pytest
import shapely

from labgym.envs import world
from labgym.envs.world import world_of
from labgym.layouts import Layout
from labgym.layouts.moves import Move, apply
from labgym.navigation import OBSTACLE_HEIGHT


def test_equal_layouts_share_a_world_while_it_is_in_use(layout):
    in_use = world_of(layout)
    world._recent.clear()
    assert world_of(layout.replace(id="another-name")) is in_use


def test_a_world_that_is_not_in_use_is_freed(layout):
    # In another order than in all other tests, whose environments may still use their world.
    own = layout.replace(placements=tuple(reversed(layout.placements)))
    reference = weakref.ref(world_of(own))
    world._recent.clear()
    gc.collect()
    assert reference() is None


def test_worlds_of_new_floors_take_the_place_of_earlier_ones(layout):
    name, worlds = layout.placements[-1].id, []
    for step in range(3 * world.KEPT):
        one = world_of(apply(layout, Move(name, 0.0003 * (step + 1), 0.0)))
        one.clear_at((1.0, 1.0, 0.0))
        worlds.append((weakref.ref(one), weakref.ref(one.model)))
    del one
    gc.collect()
    # The latest worlds are kept, and perhaps one that was looked at just before them.
    assert all(reference() is None for pair in worlds[: world.KEPT] for reference in pair)
    assert all(reference() is not None for pair in worlds[-world.KEPT :] for reference in pair)


@pytest.mark.parametrize("name", sorted(furnished_floors.FLOORS))
def test_clearances_on_any_floor_are_those_that_shapely_measures(name: str) -> None:
    layout = furnished_floors.furnished(name)
    world, floor = world_of(layout), layout.floor
    boxes = [box for box in floor.solids if box.z0 < OBSTACLE_HEIGHT] + [
        layout.box(placement.id) for placement in layout.placements
    ]
    solid = shapely.union_all([shapely.Polygon(box.corners()) for box in boxes])
    x0, y0, x1, y1 = floor.bounds
    points = np.random.default_rng(0).uniform((x0, y0), (x1, y1), (400, 2))
    points = points[floor.inside(points)]
    expected = np.maximum(shapely.distance(solid, shapely.points(points)) - 0.27, 0.0)
    assert world.clearances(points) == pytest.approx(expected, abs=1e-9)
    free = points[expected > 0.05][:20]
    assert all(world.clear_at((x, y, 0.3)) for x, y in free)


def test_the_robot_touches_walls_leaves_and_columns_of_any_floor() -> None:
    floor = furnished_floors.suite()
    world = world_of(Layout(id="bare", floor=floor, placements=()))
    places = {
        "corridor": (6.0, 4.9),
        "passage": (2.5, 5.9),
        "open door": (2.05, 3.9),
        "wall": (6.5, 4.2),
        "closed door": (10.0, 4.0),
        "open leaf": (1.6, 3.3),
        "exit": (13.8, 4.9),
    }
    clear = {name: world.clear_at((x, y, 0.0)) for name, (x, y) in places.items()}
    assert [name for name, free in clear.items() if free] == ["corridor", "passage", "open door"]
