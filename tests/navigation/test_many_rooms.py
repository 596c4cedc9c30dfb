"""Shortest paths over a floor of several furnished rooms: published layouts on both sides of a corridor."""

from __future__ import annotations

import math
import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from polygon_paths import PolygonPaths

from labgym.geometry import OrientedBox
from labgym.layouts import Layout
from labgym.layouts.splits import load_published, published
from labgym.navigation import OBSTACLE_HEIGHT, PLANNING_RADIUS, ShortestPaths, goal_pairs

THICKNESS, CORRIDOR = 0.2, 2.0


class Tiled:
    """Rooms on both sides of a corridor along x, each with its front door to the corridor."""

    def __init__(self, layouts: list[Layout]) -> None:
        self.boxes: list[OrientedBox] = []
        self._frames: dict[str, tuple[float, float, float]] = {}
        deepest = max(layout.room.depth for layout in layouts)
        self.depth = 2.0 * (deepest + THICKNESS) + CORRIDOR
        begins = [0.0, 0.0]
        for k, layout in enumerate(layouts):
            width = layout.room.width
            if k % 2:
                self._frames[layout.id] = (begins[1] + width, deepest, -1.0)
            else:
                self._frames[layout.id] = (begins[0], deepest + 2.0 * THICKNESS + CORRIDOR, 1.0)
            begins[k % 2] += width + THICKNESS
            self._add(layout)
        self.width = max(begins)

    def _add(self, layout: Layout) -> None:
        yaw = 0.0 if self._frames[layout.id][2] > 0.0 else math.pi
        width, depth, half = layout.room.width, layout.room.depth, THICKNESS / 2.0
        door = next(door for door in layout.room.doors if door.wall == "front")
        low, high = door.offset - door.width / 2.0, door.offset + door.width / 2.0
        walls = (
            OrientedBox(low / 2.0, -half, low, THICKNESS),
            OrientedBox((high + width) / 2.0, -half, width - high, THICKNESS),
            OrientedBox(width + half, depth / 2.0, THICKNESS, depth + 2.0 * THICKNESS),
            OrientedBox(-half, depth / 2.0, THICKNESS, depth + 2.0 * THICKNESS),
            OrientedBox(width / 2.0, depth + half, width, THICKNESS),
        )
        for box in (*walls, *layout.obstacles(OBSTACLE_HEIGHT)):
            x, y = self.place(layout, (box.x, box.y))
            self.boxes.append(replace(box, x=x, y=y, yaw=box.yaw + yaw))

    def place(self, layout: Layout, point: tuple[float, ...]) -> tuple[float, float]:
        """A point of a room in the floor's frame."""
        x, y, side = self._frames[layout.id]
        return x + side * point[0], y + side * point[1]


@pytest.fixture(scope="module")
def rooms() -> list[Layout]:
    return [load_published("test", name) for name in list(published("test"))[:8]]


@pytest.fixture(scope="module")
def floor(rooms: list[Layout]) -> Tiled:
    return Tiled(rooms)


@pytest.fixture(scope="module")
def paths(floor: Tiled, make_plan) -> ShortestPaths:
    return ShortestPaths(make_plan(*floor.boxes, width=floor.width, depth=floor.depth))


def test_drives_within_a_room_are_as_long_as_in_the_room_alone(rooms, floor, paths):
    compared = 0
    for layout in rooms:
        alone = ShortestPaths(layout)
        for pair in goal_pairs(layout):
            length = alone.path(pair.start, pair.goal).length
            ends = floor.place(layout, pair.start), floor.place(layout, pair.goal)
            assert paths.path(*ends).length == pytest.approx(length, abs=1e-6)
            compared += 1
    assert compared > 20


def test_a_drive_to_another_room_is_the_sum_of_its_parts_at_a_contact_on_the_way(rooms, floor, paths):
    first, last = rooms[0], rooms[-1]
    start = floor.place(first, goal_pairs(first)[0].start)
    goal = floor.place(last, goal_pairs(last)[-1].goal)
    way = paths.path(start, goal)
    assert way.length > math.dist(start, goal) + 1.0
    for via in way.points[1:-1:7]:
        # Points on arcs may lie within the radius by the rounding of the drawing only.
        parts = paths.path(start, via), paths.path(via, goal)
        assert sum(part.length for part in parts) == pytest.approx(way.length, abs=1e-6)


def test_lengths_between_rooms_agree_with_a_visibility_graph_over_polygons(rooms, make_plan):
    some = rooms[:2]
    floor = Tiled(some)
    paths = ShortestPaths(make_plan(*floor.boxes, width=floor.width, depth=floor.depth))
    by_polygons = PolygonPaths(floor.boxes, PLANNING_RADIUS, (0.0, 0.0, floor.width, floor.depth))
    for here in goal_pairs(some[0])[:3]:
        for there in goal_pairs(some[1])[:3]:
            ends = floor.place(some[0], here.start), floor.place(some[1], there.goal)
            exact, chords = paths.path(*ends).length, by_polygons.length(*ends)
            assert chords * (1.0 - 1e-6) <= exact <= chords * 1.0016 + 1e-6


def test_eight_rooms_fit_in_a_tenth_of_a_gigabyte(floor, make_plan):
    plan = make_plan(*floor.boxes, width=floor.width, depth=floor.depth)
    tracemalloc.start()
    try:
        ShortestPaths(plan)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak < 100e6


def test_a_closed_room_is_cut_off(rooms, floor, make_plan):
    layout = rooms[0]
    door = next(door for door in layout.room.doors if door.wall == "front")
    x, y = floor.place(layout, (door.offset, -THICKNESS / 2.0))
    plan = make_plan(*floor.boxes, OrientedBox(x, y, door.width, THICKNESS), width=floor.width, depth=floor.depth)
    paths = ShortestPaths(plan)
    start = floor.place(layout, goal_pairs(layout)[0].start)
    assert paths.path(start, floor.place(rooms[1], goal_pairs(rooms[1])[0].start)) is None
    assert paths.path(start, floor.place(layout, goal_pairs(layout)[0].goal)) is not None
    assert np.isfinite(paths.space.high).all()
