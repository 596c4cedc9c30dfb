"""Navigation on floors of several spaces, with walls at any angle."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import pytest
from laboratories import PROTOCOL, put

from labgym.geometry import OrientedBox, to_world
from labgym.layouts import Layout
from labgym.layouts.floor import Column, Floor, Opening, Rectangle, Space, Wall
from labgym.layouts.rules.objective import evaluate_layout
from labgym.navigation import (
    Gaps,
    GoalPair,
    LengthsTo,
    ShortestPaths,
    feasibility,
    goal_pose,
    occupancy,
    shortest_path,
    transitions,
)
from labgym.protocols import get

R = 0.30


def two_rooms(x: float = 0.0, y: float = 0.0, yaw: float = 0.0, door: Opening | None = None, **fields) -> Floor:
    """Two rooms of 4 x 5 m on both sides of a wall of 0.2 m with a door in its middle; a frame for the whole floor."""
    door = door or Opening(kind="passage", position=2.6, width=0.9)

    def wall(start, end, *openings):
        ends = to_world([start, end], (x, y, yaw))
        return Wall(start=tuple(ends[0].tolist()), end=tuple(ends[1].tolist()), openings=openings)

    return Floor(
        walls=(
            wall((-0.1, -0.1), (8.3, -0.1), Opening(position=2.1, width=1.0)),
            wall((8.3, -0.1), (8.3, 5.1)),
            wall((8.3, 5.1), (-0.1, 5.1)),
            wall((-0.1, 5.1), (-0.1, -0.1)),
            wall((4.1, -0.1), (4.1, 5.1), door),
        ),
        spaces=(
            Space(id="west", x=x, y=y, yaw=yaw, region=(Rectangle(x1=4.0, y1=5.0),)),
            Space(id="east", x=x, y=y, yaw=yaw, region=(Rectangle(x0=4.2, x1=8.2, y1=5.0),)),
        ),
        **fields,
    )


@dataclass(frozen=True)
class FurnishedFloor:
    floor: Floor
    boxes: tuple[OrientedBox, ...] = ()
    protocols = ()
    protocol = None

    def obstacles(self, below):
        return [box for box in self.boxes if box.z0 < below]


FRAMES = [(0.0, 0.0, 0.0), (-20.0, 7.0, 0.0), (3.0, -4.0, 0.25), (0.0, 0.0, -math.pi / 3.0)]


def through_the_door() -> float:
    """Length from (1, 1) to (7.2, 1) through the passage from y = 2.05 to 2.95 in the wall from x = 4 to 4.2."""
    away, up = math.hypot(3.0, 1.05), math.atan2(1.05, 3.0)
    return 2.0 * (math.sqrt(away**2 - R**2) + R * (up + math.asin(R / away))) + 0.2


@pytest.mark.parametrize("frame", FRAMES)
def test_the_way_to_the_next_room_leads_through_the_passage(frame):
    paths = ShortestPaths(FurnishedFloor(two_rooms(*frame)))
    start, goal = to_world([(1.0, 1.0), (7.2, 1.0)], frame)
    assert paths.path(start, goal).length == pytest.approx(through_the_door(), abs=1e-9)
    assert LengthsTo(paths, goal).at(*start) == pytest.approx(through_the_door(), abs=1e-9)


@pytest.mark.parametrize("frame", FRAMES)
def test_a_closed_door_and_the_walls_let_nothing_through(frame):
    plan = FurnishedFloor(two_rooms(*frame, door=Opening(position=2.6, width=0.9)))
    paths = ShortestPaths(plan)
    west, west_2, east, outside = to_world([(1.0, 1.0), (3.5, 4.5), (7.2, 1.0), (-1.0, -1.0)], frame)
    assert paths.path(west, east) is None
    assert paths.path(west, west_2).length == pytest.approx(math.hypot(2.5, 3.5))
    assert paths.path(west, outside) is None
    assert not paths.free(*outside)
    pairs = [GoalPair(0, (*west, 0.0), (*end, 0.0), "Hood", "Sink") for end in (west_2, east, outside)]
    for method in ("grid", "exact"):
        verdicts = feasibility(plan, pairs, method=method)
        assert [v.failure for v in verdicts] == [None, "unreachable", "outside_room"]
        assert verdicts[2].ends == ("goal",)


def test_a_column_out_of_the_way_changes_no_length():
    rng = np.random.default_rng(3)
    boxes = tuple(
        OrientedBox(*rng.uniform(1.0, 6.0, 2), *rng.uniform(0.2, 1.4, 2), float(rng.uniform(-3.0, 3.0)))
        for _ in range(8)
    )
    room = Floor.rectangle(7.0, 7.0)
    same = Floor(walls=room.walls, spaces=room.spaces, columns=(Column(id="c", x=0.05, y=0.05, width=0.1, depth=0.1),))
    one, other = ShortestPaths(FurnishedFloor(room, boxes)), ShortestPaths(FurnishedFloor(same, boxes))
    compared = 0
    for start, goal in rng.uniform(0.4, 6.6, (40, 2, 2)):
        path, again = one.path(start, goal), other.path(start, goal)
        assert (path is None) == (again is None)
        if path is not None:
            assert again.length == pytest.approx(path.length, abs=1e-9)
            compared += 1
    assert compared > 5


@pytest.mark.parametrize("frame", FRAMES)
def test_occupancy_covers_the_floor_and_nothing_outside(frame):
    plan = FurnishedFloor(two_rooms(*frame), (OrientedBox(*to_world([(2.0, 3.0)], frame)[0], 1.0, 0.5, frame[2]),))
    grid = occupancy(plan)
    x, y = grid.centres()
    centers = np.column_stack([part.ravel() for part in np.meshgrid(x, y)])
    inside = plan.floor.inside(centers)
    free = ~grid.occupied.ravel()
    assert not (free & ~inside).any()
    # Cells that a box may touch are nearer to it than half their diagonal.
    clear = np.min([ShortestPaths(plan).space.obstacles.nearest(centers)], axis=0) > 0.05 * math.sqrt(0.5)
    assert free[inside & clear].all()
    assert grid.shape[0] * grid.shape[1] * 0.05**2 < 100.0
    (ax, ay), (bx, by) = to_world([(1.0, 1.0), (7.2, 1.0)], frame)
    assert grid.connected((ax, ay), (bx, by))


def test_columns_and_what_stands_in_the_passage_stop_the_disc():
    start, goal = (1.0, 1.0), (7.2, 1.0)
    column = Column(id="c", x=3.1, y=2.2, width=0.3, depth=0.3)
    beside = FurnishedFloor(two_rooms(columns=(column,)))
    assert shortest_path(beside, start, goal).length > through_the_door()
    crate = OrientedBox(4.1, 2.9, 0.2, 0.2)
    assert shortest_path(replace(beside, boxes=(crate,)), start, goal) is not None
    assert shortest_path(replace(beside, boxes=(replace(crate, y=2.7),)), start, goal) is None


def test_the_neck_between_two_rooms_is_the_passage():
    plan = FurnishedFloor(two_rooms(yaw=0.2))
    start, goal = to_world([(1.0, 1.0), (7.2, 1.0)], (0.0, 0.0, 0.2))
    route = shortest_path(plan, start, goal).points
    assert Gaps(plan).narrowest(route) == pytest.approx(0.9)
    assert Gaps(plan).widest(route) == pytest.approx(0.9)


def test_a_pose_before_a_bench_on_an_oblique_wall_is_free():
    frame = (0.0, 0.0, 0.25)
    x, y = to_world([(2.0, 0.375)], frame)[0].tolist()
    bench = OrientedBox(x, y, 1.5, 0.75, frame[2])
    assert ShortestPaths(FurnishedFloor(two_rooms(*frame), (bench,))).free(*goal_pose(bench)[:2])


@pytest.mark.parametrize("yaw", [0.0, 0.25])
def test_rules_judge_drives_between_rooms_by_exact_clearance(yaw):
    def placed(name, asset, x, y, turn):
        (px, py), heading = to_world([(x, y)], (0.0, 0.0, yaw))[0].tolist(), turn + yaw
        return put(name, asset, px, py, yaw=heading)

    layout = Layout(
        id="narrow",
        protocols=(get(PROTOCOL),),
        floor=two_rooms(yaw=yaw, door=Opening(kind="passage", position=2.6, width=0.66)),
        placements=(
            placed("PreparationBench_1", "PreparationBench", 0.38, 2.5, -math.pi / 2.0),
            placed("FumeHood_1", "FumeHood", 2.0, 5.0 - 0.43, math.pi),
            placed("SinkBench_1", "SinkBench", 1.5, 0.38, 0.0),
            placed("ValidationPlatform_1", "ValidationPlatform", 8.2 - 0.41, 2.5, math.pi / 2.0),
        ),
    )
    judged = evaluate_layout(layout, layout.protocol, navigation=True).transitions
    assert len(judged) >= 3
    assert all(transition.feasible for transition in judged)
    assert not all(transition.feasible for transition in transitions(layout, method="grid"))
