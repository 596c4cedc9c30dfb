"""Facility warnings and the consistency proxy: each rule answers to its own planted fault."""

from __future__ import annotations

import math

import pytest
from floor_shapes import doorway
from laboratories import put

from labgym.assets import Catalog
from labgym.eval import score
from labgym.eval.scoring.layout_report import RuleScore
from labgym.layouts import Door, Layout, Placement, Room
from labgym.layouts.floors import draw_floor
from labgym.layouts.rules import evaluate_layout, rule_set
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.facility.showers import shower_walks
from labgym.layouts.rules.rule import FacilityIssue
from labgym.layouts.rules.zones import door_area, front_zone

DOORS = (Door(wall="front", offset=1.2), Door(wall="left", offset=1.2))
ROOM = Room(width=8.0, depth=8.0, doors=DOORS)


CLEAN = (
    put("hood", "FumeHood", 4.0, 7.575, yaw=math.pi),
    put("bench", "LabBench", 7.625, 3.0, yaw=math.pi / 2),
    put("shower", "EmergencyShower", 0.4, 4.0, yaw=-math.pi / 2),
    put("acids", "AcidCabinet", 0.3, 6.0, yaw=-math.pi / 2),
    put("acid", "HydrochloricAcid", 0.3, 6.0, 0.1, on="acids", slot=0),
)


def lab(*changed: Placement, without: tuple[str, ...] = (), room: Room = ROOM) -> Layout:
    by_id = {placement.id: placement for placement in (*CLEAN, *changed) if placement.id not in without}
    return Layout(id="lab", floor=room.floor, placements=tuple(by_id.values()))


def issues(layout: Layout, thresholds: str = "default") -> tuple[FacilityIssue, ...]:
    return evaluate_layout(layout, rules=rule_set("paper", thresholds)).issues


def test_a_good_laboratory_has_no_issues() -> None:
    assert issues(lab()) == ()


TOP = Catalog.load().get("AcidCabinet").surfaces[-1].z
NARROW = ROOM.model_copy(update={"doors": (Door(wall="front", offset=1.2, width=0.8), DOORS[1])})
FAULTS = {
    "a narrow exit": (lab(room=NARROW), "exit_width", 0.8, ()),
    "one exit only": (lab(room=ROOM.model_copy(update={"doors": DOORS[:1]})), "second_exit", 1.0, ()),
    "a bin inside the door": (lab(put("bin", "SolidWasteBin", 1.2, 0.9, yaw=math.pi)), "door_area", None, ()),
    "a stool inside the door": (lab(put("stool", "LabStool", 1.2, 0.3)), "door_area", None, ()),
    "a hood near the door": (
        lab(put("second", "FumeHood", 5.0, 0.425), without=("bench",)),
        "hood_door",
        5.0 - 0.75 - (1.2 + 0.5),
        (),
    ),
    "a desk before the hood": (
        lab(put("desk", "WritingDesk", 4.0, 5.3)),
        "hood_opposite_desk",
        7.15 - 5.6,
        ("back_to_wall",),
    ),
    "no shower": (lab(without=("shower",)), "shower_walk", None, ()),
    "a bin before the bench": (
        lab(put("bin", "WasteBin", 6.8, 3.0, yaw=math.pi / 2)),
        "front_clearance",
        7.25 - 6.95,
        (),
    ),
    "a cabinet in the middle of the room": (
        lab(put("tall", "GeneralCabinet", 4.0, 4.0)),
        "back_to_wall",
        4.0 - 0.45 / 2.0,
        (),
    ),
    "a slanted bench": (
        lab(put("bench", "LabBench", 7.4, 3.0, yaw=math.pi / 2 + 0.4)),
        "back_to_wall",
        0.6 - 0.375 * math.cos(0.4) + 0.75 * math.sin(0.4),
        (),
    ),
    "a cabinet with its doors to the wall": (
        lab(put("tall", "GeneralCabinet", 6.0, 0.3, yaw=math.pi)),
        "front_clearance",
        0.3 - 0.45 / 2.0,
        ("back_to_wall",),
    ),
    "a cabinet next to the shower": (
        lab(put("tall", "GeneralCabinet", 0.24, 4.84, yaw=-math.pi / 2)),
        "shower_clear",
        4.84 - 0.45 - 4.0,
        (),
    ),
    "acid above the head": (
        lab(put("acid", "HydrochloricAcid", 0.3, 6.0, TOP, on="acids", slot=4)),
        "corrosive_height",
        TOP,
        (),
    ),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_planted_fault_gives_its_own_issue_with_the_measured_value(fault: str) -> None:
    layout, rule, value, further = FAULTS[fault]
    by_rule = {issue.rule: issue for issue in issues(layout)}
    assert set(by_rule) == {rule, *further}
    assert by_rule[rule].value == (None if value is None else pytest.approx(value, abs=1e-6))
    assert all(issue.message and issue.source for issue in by_rule.values())


def test_benches_back_to_back_in_the_middle_of_the_room_need_no_wall() -> None:
    south = put("south", "LabBench", 4.0, 3.6, yaw=math.pi)
    north = put("north", "LabBench", 4.0, 4.36)
    assert issues(lab(south, north)) == ()
    assert {issue.rule for issue in issues(lab(south))} == {"back_to_wall"}


def test_a_missing_second_exit_is_a_warning_by_default_and_an_error_under_the_profile_code() -> None:
    layout = lab(room=ROOM.model_copy(update={"doors": DOORS[:1]}))
    (issue,) = issues(layout)
    assert issue.severity == "warning"
    assert issue.message == "only one exit for 64 m²; above 46.5 m² two are required (NFPA 45, class B): add a door"
    (issue,) = issues(layout, "code")
    assert issue.severity == "error"


@pytest.mark.parametrize("width", [4.0, 6.0, 7.0])
def test_the_area_that_needs_a_second_exit_is_that_of_the_profile(width) -> None:
    room = Room(width=width, depth=7.0, doors=(Door(wall="front", offset=1.2),))
    empty = Layout(id="empty", floor=room.floor, placements=())
    assert bool(issues(empty)) == (width * 7.0 > 46.5)
    assert bool(issues(empty, "code")) == (width * 7.0 > 18.6)


def test_a_hood_next_to_a_door_has_another_limit_than_one_that_is_only_near() -> None:
    hood = lab(put("second", "FumeHood", 3.0, 0.425), without=("bench",))
    assert [(issue.value, issue.limit) for issue in issues(hood)] == [
        (pytest.approx(3.0 - 0.75 - (1.2 + 0.5)), 1.0),  # the front door
        (pytest.approx(3.0 - 0.75), 3.0),  # the left door
    ]


def test_a_small_laboratory_needs_no_second_exit() -> None:
    room = Room(width=4.0, depth=4.6, doors=(Door(wall="front", offset=1.2),))
    assert issues(Layout(id="small", floor=room.floor, placements=())) == ()


def test_the_walk_to_the_shower_is_the_way_around_and_not_the_line_through() -> None:
    direct = shower_walks(Arrangement.of(lab()))["hood"]
    straight = math.dist((4.0, 6.55), (1.35, 4.0))  # 0.6 m before each front
    assert straight - 0.1 <= direct <= 1.1 * straight
    wall = [put(f"rack{k}", "EquipmentRack", 0.95 + k, 5.0) for k in range(5)]
    around = shower_walks(Arrangement.of(lab(*wall)))["hood"]
    end = 0.95 + 4 + 0.5 + 0.3  # the free end of the row, a robot's radius off
    assert around >= math.dist((4.0, 6.55), (end, 5.0)) + math.dist((end, 5.0), (1.35, 4.0)) - 0.3
    closed = [put(f"rack{k}", "EquipmentRack", 0.5 + k, 5.0) for k in range(8)]
    assert shower_walks(Arrangement.of(lab(*closed)))["hood"] == math.inf


@pytest.mark.parametrize(
    ("wall", "expected"),
    [
        ("front", (0.6, 0.0, 1.8, 1.2)),
        ("back", (0.6, 4.8, 1.8, 6.0)),
        ("left", (0.0, 0.6, 1.2, 1.8)),
        ("right", (6.8, 0.6, 8.0, 1.8)),
    ],
)
def test_door_areas_lie_inside_the_room_at_their_door(wall: str, expected: tuple[float, ...]) -> None:
    room = Room(width=8.0, depth=6.0, doors=(Door(wall=wall, offset=1.2),))
    assert door_area(room, room.doors[0]).bounds() == pytest.approx(expected, abs=1e-12)
    opening = doorway(room, room.doors[0]).bounds()
    assert (opening[2] - opening[0]) + (opening[3] - opening[1]) == pytest.approx(1.0)


@pytest.mark.parametrize("yaw", [0.0, 1.0, math.pi / 2, -2.5])
def test_a_front_zone_begins_at_the_front_and_ends_at_its_depth(yaw: float) -> None:
    box = Layout(id="t", floor=ROOM.floor, placements=(put("b", "LabBench", 4.0, 4.0, yaw=yaw),)).box("b")
    zone = front_zone(box, 0.9)
    assert zone.to_local(*box.to_world(0.0, 0.375)) == pytest.approx((0.0, -0.45), abs=1e-12)
    assert zone.to_local(*box.to_world(0.75, 1.275)) == pytest.approx((0.75, 0.45), abs=1e-12)


def rules(layout: Layout) -> dict[str, RuleScore]:
    return {rule.rule: rule for rule in score(layout, rules="paper", contacts=False).consistency_proxy.rules}


PROXY_FAULTS = {
    "a hood turned to the wall": (
        lab(put("hood", "FumeHood", 4.0, 7.575)),
        "hoods stand with their back to a wall",
        0.0,
    ),
    "a cabinet in the middle": (
        lab(put("tall", "GeneralCabinet", 4.0, 4.0)),
        "tall furniture stands against a wall",
        1 / 2,
    ),
    "a slanted bench": (
        lab(put("bench", "LabBench", 6.0, 3.0, yaw=1.0)),
        "furniture is parallel to the walls",
        2 / 3,
    ),
    "a beaker on the floor": (
        lab(put("beaker", "Beaker", 5.0, 3.0)),
        "desktop items stand on furniture, not on the floor",
        1 / 2,
    ),
    "a blocked door": (lab(put("bin", "SolidWasteBin", 1.6, 0.4)), "the area inside each door is clear", 1 / 2),
    "no shower": (lab(without=("shower",)), "a safety shower is within 16.8 m of each hood", 0.0),
}


@pytest.mark.parametrize("fault", PROXY_FAULTS)
def test_the_proxy_lowers_the_rule_that_is_broken(fault: str) -> None:
    layout, rule, expected = PROXY_FAULTS[fault]
    assert rules(layout)[rule].score == pytest.approx(expected)
    assert rules(lab())[rule].score == 1.0


def test_the_proxy_counts_what_stands_on_the_furniture_and_along_the_walls() -> None:
    found = rules(lab())
    assert found["benches, desks and hoods carry something"].score == 0.0
    busy = rules(lab(put("beaker", "Beaker", 7.6, 3.0, 0.9, on="bench", slot=0)))
    assert busy["benches, desks and hoods carry something"].score == pytest.approx(1 / 2)
    lined = 1.5 + 1.5 + 0.75 + 0.6  # hood, bench, shower and cabinet along 32 m of wall
    assert found["walls are lined with furniture"].score == pytest.approx(lined / 32.0 / 0.2, abs=4 * 0.1 / 32.0 / 0.2)
    assert found["a laboratory's essentials are present"].score == pytest.approx(4 / 7)  # bench, hood, shower, cabinet


def test_each_dimension_is_ten_times_the_mean_of_its_rules() -> None:
    proxy = score(lab(), rules="paper", contacts=False).consistency_proxy
    for dimension in ("realism", "layout", "completeness"):
        own = [rule.score for rule in proxy.rules if rule.dimension == dimension]
        assert getattr(proxy, dimension) == pytest.approx(10.0 * sum(own) / len(own))
    assert proxy.total == pytest.approx(proxy.realism + proxy.layout + proxy.completeness)


def test_furniture_behind_which_no_wall_runs_has_no_distance() -> None:
    floor = draw_floor("suite", 4).floor
    corner = max(floor.walls, key=lambda wall: wall.end[0] - wall.end[1]).end
    astride = Layout(id="lab", floor=floor, placements=(put("acids", "AcidCabinet", *corner, yaw=math.pi / 4.0),))
    issue = next(one for one in issues(astride) if one.rule == "back_to_wall")
    assert issue.value is None
    assert issue.message == "the back of acids faces no wall: move it to a wall"


@pytest.mark.parametrize(
    ("x", "y", "words"), [(6.0, 0.3, "has 0.07 m: turn it away"), (60.0, 4.0, "is in a wall or outside: move it")]
)
def test_a_front_says_what_is_in_its_way(x: float, y: float, words: str) -> None:
    found = issues(lab(put("tall", "GeneralCabinet", x, y, yaw=math.pi)))
    (message,) = [issue.message for issue in found if issue.rule == "front_clearance"]
    assert words in message
