"""Walks of the workflow and drives from doors against shapely in a published room; the facility score by counting."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest
import shapely
from laboratories import put
from polygon_paths import PolygonPaths

from labgym.layouts import Door, Layout, Placement, Room, load_published
from labgym.layouts.floor import Floor, Opening, Rectangle, Space, Wall
from labgym.layouts.moves import Place, apply
from labgym.layouts.rules import Assessment, evaluate_layout
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.drives import entry_legs
from labgym.layouts.rules.thresholds import MOVABLE
from labgym.layouts.rules.workflow import walking_distance
from labgym.navigation import goal_poses
from labgym.protocols import get

PERSON, ROBOT = 0.25, 0.30


@pytest.fixture(scope="module")
def layout() -> Layout:
    return load_published("test", "test-sub_02")


def obstacles(layout: Layout, movable: bool) -> list:
    return [
        layout.box(each.id)
        for each in layout.placements
        if each.support in ("floor", "wall")
        and layout.box(each.id).z0 < 1.4
        and (movable or each.support == "wall" or layout.asset(each.id).subtype not in MOVABLE)
    ]


def test_walks_between_steps_agree_with_shapely(layout: Layout) -> None:
    assert layout.protocol is not None
    paths = PolygonPaths(obstacles(layout, movable=False), PERSON, (0.0, 0.0, layout.room.width, layout.room.depth))
    poses = goal_poses(layout)
    route = [poses[name][:2] for name in layout.protocol.route]
    lengths = [paths.length(*leg) for leg in pairwise(route)]
    walk = walking_distance(Arrangement.of(layout), layout.protocol)
    assert walk.between == pytest.approx(sum(lengths), rel=2e-3)
    assert walk.blocked == 0


@pytest.mark.parametrize("blocked", [False, True])
def test_drives_from_doors_agree_with_free_space_by_shapely(layout: Layout, blocked: bool) -> None:
    door = layout.room.doors[0]
    bench = next(each.id for each in layout.placements if layout.asset(each.id).subtype == "workbench")
    changed = apply(layout, Place(bench, door.offset, 1.0, 0.0)) if blocked else layout
    assessment = evaluate_layout(changed, changed.protocol, navigation=True, rules="touchstone")
    assert isinstance(assessment, Assessment)
    room = shapely.box(0.0, 0.0, layout.room.width, layout.room.depth).buffer(-ROBOT)
    shapes = [
        shapely.Polygon(box.corners()).buffer(ROBOT - 1e-6, quad_segs=32) for box in obstacles(changed, movable=True)
    ]
    free = shapely.difference(room, shapely.union_all(shapes))
    parts = list(getattr(free, "geoms", [free]))
    for drive in assessment.drives_of("entries"):
        assert drive.start is not None
        assert drive.goal is not None
        ends = shapely.Point(drive.start[:2]), shapely.Point(drive.goal[:2])
        assert drive.feasible == any(part.covers(ends[0]) and part.covers(ends[1]) for part in parts)
    assert all(drive.feasible for drive in assessment.drives_of("entries")) != blocked


def two_rooms(state: str) -> Layout:
    """Two rooms of 4 m x 5 m with an exit each and a door between them; the protocol works in the first."""

    def wall(start: tuple[float, float], end: tuple[float, float], *openings: Opening) -> Wall:
        return Wall(start=start, end=end, thickness=0.2, openings=openings)

    walls = (
        wall((-0.1, -0.1), (8.3, -0.1), Opening(position=1.5), Opening(position=7.0)),
        wall((8.3, -0.1), (8.3, 5.1)),
        wall((8.3, 5.1), (-0.1, 5.1)),
        wall((-0.1, 5.1), (-0.1, -0.1)),
        wall((4.1, 0.0), (4.1, 5.0), Opening(position=2.0, state=state)),
    )
    spaces = (
        Space(id="west", region=(Rectangle(x0=0.0, y0=0.0, x1=4.0, y1=5.0),)),
        Space(id="east", region=(Rectangle(x0=4.2, y0=0.0, x1=8.2, y1=5.0),)),
    )
    floor = Floor(walls=walls, spaces=spaces)
    placements = (
        put("hood", "FumeHood", 2.5, 4.5, yaw=math.pi),
        put("sink", "SinkBench", 0.45, 2.5, yaw=-math.pi / 2.0),
    )
    return Layout(id="two-rooms", floor=floor, protocols=(get("alk_03"),), placements=placements)


@pytest.mark.parametrize("state", ["open", "closed"])
def test_doors_of_rooms_that_the_protocol_does_not_use_are_no_starts(state: str) -> None:
    layout = two_rooms(state)
    assert layout.protocol is not None
    legs = entry_legs(Arrangement.of(layout), layout.protocol)
    starts = sorted((round(start[0], 2), round(start[1], 2)) for _, _, start, _ in legs if start is not None)
    assert starts == [(1.4, 0.35), (3.65, 2.0)]
    ahead = {
        (round(math.cos(start[2]), 6), round(math.sin(start[2]), 6)) for _, _, start, _ in legs if start is not None
    }
    assert ahead == {(0.0, 1.0), (-1.0, 0.0)}


def test_the_facility_score_counts_the_objects_that_keep_each_rule() -> None:
    floor = Room(width=9.0, depth=9.0, doors=(Door(wall="front", offset=1.5),)).floor

    def scored(*placements: Placement) -> dict[str, float]:
        assessment = evaluate_layout(Layout(id="f", floor=floor, placements=placements), rules="touchstone")
        assert isinstance(assessment, Assessment)
        total = sum(assessment.facility.values()) / len(assessment.facility)
        assert assessment.facility_score == pytest.approx(total)
        return dict(assessment.facility)

    far, near = put("far", "FumeHood", 6.0, 8.57, yaw=math.pi), put("near", "FumeHood", 0.43, 2.6, yaw=-math.pi / 2.0)
    assert scored(far, near)["hood_door"] == 0.5
    assert scored(far)["hood_door"] == 1.0
    assert "hood_door" not in scored()
    loose = put("loose", "LabBench1800", 4.5, 5.0)
    wall = put("wall", "LabBench1800", 4.0, 0.38)
    assert scored(loose, wall)["back_to_wall"] == 0.5
    assert scored(put("stool", "LabStool", 1.5, 0.6))["door_area"] == 0.0
    assert scored(loose)["second_exit"] == 0.0
