"""Ways out, judged a second time by polygons: the free floor, shrunk by half the width, stays in one piece."""

import itertools
import math
from dataclasses import FrozenInstanceError

import pytest
from shapely import Point, Polygon, box, unary_union

from labgym.eval import score
from labgym.layouts import Door, Layout, Placement, Room, generate, load_published, optimise
from labgym.layouts.floor import Floor, Opening, Rectangle, Space, Wall
from labgym.layouts.moves import Place, apply
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.egress import narrow_exits, narrow_ways
from labgym.layouts.rules.handling import Handling
from labgym.layouts.rules.objective import evaluate_layout
from labgym.navigation import goal_pose
from labgym.protocols import protocols

HALF = 0.45
CLUTTER = {"LabStool", "WasteBin", "SolidWasteBin", "BrokenGlassBin", "SpillKit", "SolventWasteContainer"}
CORNER_DOORS = {  # rooms in which generator 1 left ways of 0.50 to 0.58 m
    "red_01 paper": ("red_01", 389906313, Room(width=9.72, depth=8.61, doors=(Door(wall="front", offset=9.01),))),
    "pro_01": ("pro_01", 247413, Room(width=9.07, depth=6.22, doors=(Door(wall="left", offset=5.70),))),
    "pro_04": ("pro_04", 561594, Room(width=10.99, depth=7.55, doors=(Door(wall="front", offset=0.52),))),
    "red_01": ("red_01", 874028, Room(width=9.25, depth=6.49, doors=(Door(wall="left", offset=5.97),))),
}
FRESH = {
    **CORNER_DOORS,
    "bay_small": ("con_02", 71, "bay_small"),
    "bay": ("alk_02", 72, "bay"),
    "bay_large": ("cyc_03", 73, "bay_large"),
    "two_exits": ("fgt_04", 74, "two_exits"),
    "tight": ("sub_03", 75, "tight"),
    "three doors": (
        "red_03",
        76,
        Room(
            width=9.0,
            depth=9.0,
            doors=(Door(wall="front", offset=0.6), Door(wall="left", offset=8.0), Door(wall="right", offset=4.0)),
        ),
    ),
}


@pytest.fixture(scope="module", params=FRESH)
def layout(request: pytest.FixtureRequest) -> Layout:
    protocol, seed, room = FRESH[request.param]
    return generate(protocol, seed, room, profile="paper" if "paper" in request.param else "default")


def footprint(layout: Layout, placement: str) -> Polygon:
    return Polygon(layout.box(placement).corners())


def furniture(layout: Layout) -> list[Placement]:
    return [item for item in layout.placements if item.support == "floor" and item.asset not in CLUTTER]


def inside(room: Room, door: Door, depth: float) -> Point:
    along, wide, deep = door.offset, room.width, room.depth
    return Point(
        {
            "front": (along, depth),
            "back": (along, deep - depth),
            "left": (depth, along),
            "right": (wide - depth, along),
        }[door.wall]
    )


def places_not_reached(layout: Layout) -> list[str]:
    room = layout.room
    floor = box(0.0, 0.0, room.width, room.depth)
    free = floor - unary_union([footprint(layout, item.id) for item in furniture(layout)])
    centers = free.buffer(-(HALF - 1e-4), quad_segs=64)
    parts = list(getattr(centers, "geoms", [centers]))
    missed = []
    for door in room.doors:
        entry = inside(room, door, HALF)
        way = min(parts, key=lambda part: part.distance(entry))
        if way.distance(entry) > 0.02:
            missed.append(f"{door.wall} door")
        for item in furniture(layout):
            asset = layout.asset(item.id)
            x, y, _ = goal_pose(layout.box(item.id))
            reach = HALF + (0.3 if asset.size.width < 0.9 else 0.0)
            if asset.clearance > 0.0 and way.distance(Point(x, y)) > reach + 0.03:
                missed.append(item.id)
    return missed


@pytest.mark.cases(4)
def test_every_door_of_a_generated_laboratory_leads_to_every_place_by_a_way_of_90_cm(layout: Layout) -> None:
    assert places_not_reached(layout) == []
    assert evaluate_layout(layout, layout.protocol, navigation=True, rules="paper").cost == 0


def test_the_emergency_shower_of_a_generated_laboratory_has_its_clear_radius(layout: Layout) -> None:
    showers = [item for item in layout.placements if item.asset == "EmergencyShower"]
    assert showers
    for shower in showers:
        clear = Point(shower.position[:2]).buffer(0.41 - 1e-3)
        others = [item for item in layout.placements if item.support in ("floor", "wall") and item.id != shower.id]
        assert [item.id for item in others if clear.intersects(footprint(layout, item.id))] == []


def corridor(width: float, *more: Placement) -> Layout:
    """Two rows of racks across a room 6 m wide leave one passage between the door and a bench."""
    left = (6.0 - width) / 2.0
    racks = [
        Placement(id=f"rack{k}", asset="EquipmentRack", position=(x, 3.0, 0.0))
        for k, x in enumerate(
            (left - 0.5, left - 1.5, left - 2.5, 6.0 - left + 0.5, 6.0 - left + 1.5, 6.0 - left + 2.5)
        )
    ]
    bench = Placement(id="bench", asset="LabBench", position=(3.0, 5.6, 0.0), yaw=math.pi)
    room = Room(width=6.0, depth=6.0, doors=(Door(wall="front", offset=3.0),))
    return Layout(id="corridor", floor=room.floor, placements=(*racks, bench, *more))


def oblique_corridor(width: float, angle: float, shift: float) -> Layout:
    """A row of racks across a room of 8 x 8 m at an angle, with one passage through its middle."""
    racks = []
    for k, at in enumerate((width / 2.0 + 0.5 + j) * side for side in (-1.0, 1.0) for j in range(7)):
        x, y = 4.0 + shift + at * math.cos(angle), 4.0 + shift / 3.0 + at * math.sin(angle)
        racks.append(Placement(id=f"rack{k}", asset="EquipmentRack", position=(x, y, 0.0), yaw=angle))
    bench = Placement(id="bench", asset="LabBench", position=(4.0, 7.6, 0.0), yaw=math.pi)
    room = Room(width=8.0, depth=8.0, doors=(Door(wall="front", offset=4.0),))
    return Layout(id="oblique", floor=room.floor, placements=(*racks, bench))


@pytest.mark.parametrize("shift", [0.0, 0.004, 0.011, 0.017])
@pytest.mark.parametrize("degrees", [0.0, 7.0, 13.0, 22.5, 31.0, 45.0])
def test_a_passage_of_the_required_width_is_taken_at_any_angle_and_a_clearly_narrower_one_at_none(degrees, shift):
    for width in (0.9001, 0.905, 0.91, 0.92, 0.935, 0.96):
        ways = narrow_ways(Arrangement.of(oblique_corridor(width, math.radians(degrees), shift)))
        assert not [way for way in ways if "bench" in way.destinations], width
    (way,) = narrow_ways(Arrangement.of(oblique_corridor(0.82, math.radians(degrees), shift)))
    assert "bench" in way.destinations
    assert way.width == pytest.approx(0.82, abs=0.04)


@pytest.mark.parametrize("width", [0.5, 0.7, 0.85])
def test_a_passage_that_is_too_narrow_is_measured(width: float) -> None:
    (way,) = narrow_ways(Arrangement.of(corridor(width)))
    assert narrow_exits(Arrangement.of(corridor(width))) == [way.destinations]
    assert "bench" in way.destinations
    assert way.width == pytest.approx(width, abs=0.03)


@pytest.mark.parametrize("width", [0.9, 0.93, 1.3])
def test_a_passage_that_is_wide_enough_is_no_issue_and_a_stool_in_it_is_pushed_aside(width: float) -> None:
    stool = Placement(id="stool", asset="LabStool", position=(3.0, 3.0, 0.0))
    for layout in (corridor(width), corridor(width, stool)):
        assert [way for way in narrow_ways(Arrangement.of(layout)) if "bench" in way.destinations] == []


def test_a_cabinet_in_the_doorway_is_an_error_of_the_score_and_the_optimiser_moves_it() -> None:
    source = load_published("test", "test-sub_01")
    door = source.room.doors[0]
    cabinet = next(item for item in source.placements if source.asset(item.id).subtype == "toxic_cabinet")
    blocked = apply(source, Place(cabinet.id, door.offset, 0.3, 0.0))
    report = score(blocked, contacts=False, rules="paper")
    errors = {issue.rule: issue.message for issue in report.warnings if issue.severity == "error"}
    assert cabinet.id in errors["door_area"]
    assert "egress" in errors
    protocol = protocols()["sub_01"]
    after = evaluate_layout(optimise(blocked, protocol, rules="paper"), protocol, navigation=True, rules="paper")
    assert after.v == 0
    assert "door_area" not in {issue.rule for issue in after.errors}
    assert "egress" not in {issue.rule for issue in after.errors}


@pytest.mark.parametrize("closed", [True, False])
def test_a_free_floor_beside_a_door_that_is_blocked_is_no_way_out(closed: bool) -> None:
    posts = [
        Placement(id=f"post{k}", asset="EyewashStation", position=(3.0 + 0.475 * k, 0.175, 0.0))
        for k in ((-1, 1) if closed else (1,))
    ]
    rack = Placement(id="rack", asset="EquipmentRack", position=(3.0, 0.6, 0.0))
    bench = Placement(id="bench", asset="LabBench", position=(3.0, 5.6, 0.0), yaw=math.pi)
    room = Room(width=6.0, depth=6.0, doors=(Door(wall="front", offset=3.0),))
    layout = Layout(id="pocket", floor=room.floor, placements=(*posts, rack, bench))
    missed = [name for names in narrow_exits(Arrangement.of(layout), width=0.35) for name in names]
    assert ("bench" in missed) is closed


def test_what_rules_return_does_not_change() -> None:
    layout = corridor(0.7)
    (way,) = narrow_ways(Arrangement.of(layout))
    assessment = evaluate_layout(layout, rules="touchstone")
    handling = Handling(0, (0,), frozenset(), frozenset(), frozenset())
    for value in (way, handling, assessment):
        name = next(iter(vars(value)))
        with pytest.raises(FrozenInstanceError):
            setattr(value, name, None)


@pytest.mark.parametrize(("swing", "stands"), [("right", True), ("left", False)])
def test_an_open_leaf_stands_in_the_way_only_if_leaves_count(swing: str, stands: bool) -> None:
    # A corridor 1.1 m wide along x = 4.2: its exit is at one end, a sink at the other, a door to a room between.
    corners = ((5.3, 5.1), (-0.1, 5.1), (-0.1, -0.1), (5.4, -0.1), (5.4, 5.1))
    walls = [Wall(start=a, end=b, thickness=0.2) for a, b in itertools.pairwise(corners)]
    walls[2] = walls[2].model_copy(update={"openings": (Opening(position=4.85, width=0.9),)})
    door = Opening(position=2.5, width=0.9, swing=swing, state="open", angle=math.pi / 2.0)
    walls.append(Wall(start=(4.1, 0.0), end=(4.1, 5.0), thickness=0.2, openings=(door,)))
    spaces = tuple(
        Space(id=name, region=(Rectangle(x0=x0, y0=0.0, x1=x1, y1=5.0),))
        for name, x0, x1 in (("room", 0.0, 4.0), ("corridor", 4.2, 5.3))
    )
    sink = Placement(id="sink", asset="HandWashSink", position=(4.75, 4.75, 0.0), yaw=math.pi)
    layout = Layout(id="leaf", floor=Floor(walls=tuple(walls), spaces=spaces), placements=(sink,))
    for leaves, missed in ((False, []), (True, [("sink",)] if stands else [])):
        assert narrow_exits(Arrangement.of(layout), width=0.7, leaves=leaves) == missed
