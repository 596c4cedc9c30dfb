"""What is in a room where it does not belong, and exits without a sign, are violations; repair marks the exits."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache

import pytest

from labgym.layouts import Layout, load_published
from labgym.layouts.moves import replaced, without
from labgym.layouts.repairs import repair_layout
from labgym.layouts.rules import evaluate_layout

SIGN = "ExitSign"
WRONG = (
    ("SpillKit", "write-up"), ("SpillKit", "corridor"), ("SolventWasteContainer", "write-up"),
    ("NitrogenCylinder", "write-up"), ("NitrogenCylinder", "corridor"), ("FumeHood", "write-up"),
    ("WasteStation", "corridor"), ("FlammableCabinet", "corridor"),
)  # fmt: skip


@cache
def floor() -> Layout:
    return load_published("floors-val", "floors-val-0023")


def first(layout: Layout, role: str) -> str:
    return next(p.id for p in layout.placements if layout.asset(p.id).role == role)


def signs(layout: Layout) -> list[str]:
    return [p.id for p in layout.placements if p.asset == SIGN]


def shifted(layout: Layout, item: str, meters: float) -> Layout:
    placement = layout.placement(item)
    x, y, z = placement.position
    position = (x + meters * math.cos(placement.yaw), y + meters * math.sin(placement.yaw), z)
    return replaced(layout, {item: placement.model_copy(update={"position": position})})


def broken(layout: Layout, rule: str) -> list[tuple[str, ...]]:
    assessment = evaluate_layout(layout, layout.protocol, navigation=False)
    own = [issue.ids for issue in assessment.hard_issues if issue.rule == rule]
    assert assessment.v >= len(own)
    return own


def test_a_published_floor_breaks_neither_rule() -> None:
    assert broken(floor(), "exit_sign") == broken(floor(), "wrong_room") == []


@pytest.mark.parametrize(("role", "use"), WRONG)
def test_hazards_in_corridors_and_write_up_rooms_are_named(role: str, use: str) -> None:
    layout = floor()
    item, space = first(layout, role), next(space for space in layout.floor.spaces if space.use == use)
    middle = (space.boxes[0].x, space.boxes[0].y, 0.0)
    moved = layout.placement(item).model_copy(update={"position": middle, "support": "floor", "slot": None})
    assert (item,) in broken(replaced(layout, {item: moved}), "wrong_room")


def test_every_exit_of_several_spaces_needs_its_sign() -> None:
    layout = floor()
    exits = sum(way.exit for way in layout.floor.doorways)
    assert len(signs(layout)) == exits >= 2
    assert len(broken(without(layout, signs(layout)[:1]), "exit_sign")) == 1
    assert len(broken(without(layout, signs(layout)), "exit_sign")) == exits


@pytest.mark.parametrize(("meters", "marks"), [(0.5, True), (1.0, True), (3.0, False), (-3.0, False)])
def test_a_sign_marks_its_exit_within_the_width_of_the_exit(meters: float, marks: bool) -> None:
    sign = signs(floor())[0]
    found = broken(shifted(floor(), sign, meters), "exit_sign")
    assert found == ([] if marks else [(), (sign,)])


def test_one_room_in_sight_needs_no_sign_but_one_that_misleads_is_named() -> None:
    room = load_published("val", "val-alk_02")
    assert broken(room, "exit_sign") == []
    kit = room.placement(first(room, "FirstAidKit"))
    sign = kit.model_copy(update={"id": "sign", "asset": SIGN, "position": (*kit.position[:2], 2.3)})
    assert ("sign",) in broken(room.replace(placements=(*room.placements, sign)), "exit_sign")


@pytest.mark.parametrize("spoil", [lambda layout: without(layout, [*signs(layout), first(layout, "FirstAidKit")]),
                                   lambda layout: shifted(layout, signs(layout)[0], 3.0)])  # fmt: skip
def test_repair_marks_the_exits_and_hangs_the_first_aid_kit(spoil: Callable[[Layout], Layout]) -> None:
    repair = repair_layout(spoil(floor()))
    assert (repair.before.v > 0, repair.after.v, repair.after.lacking, repair.problems) == (True, 0, (), ())
    assert len(signs(repair.layout)) == len(signs(floor()))


@pytest.mark.parametrize("role", ["FireExtinguisher", "EyewashStation", "EmergencyShower", "FirstAidKit", "SpillKit"])
@pytest.mark.parametrize("loose", ["Carton", "LabStool", "SteelDrum"])
def test_nothing_loose_stands_before_emergency_equipment(role: str, loose: str) -> None:
    layout = floor()
    item, size = first(layout, role), layout.catalog.get(loose).size
    box = layout.box(item)
    x, y = box.to_world(0.0, box.depth / 2.0 + size.depth / 2.0 + 0.05)
    placement = layout.placement(item).model_copy(update={"id": "loose", "asset": loose, "support": "floor"})
    strewn = placement.model_copy(update={"position": (x, y, 0.0)})
    assert ("loose", item) in broken(layout.replace(placements=(*layout.placements, strewn)), "emergency_front")


@pytest.mark.parametrize(("width", "severity"), [(0.65, "error"), (0.8, "warning"), (1.0, None)])
def test_a_door_under_28_inches_is_no_way_out(width: float, severity: str | None) -> None:
    layout = load_published("val", "val-alk_02")
    (front, *others) = layout.floor.walls
    doors = tuple(opening.model_copy(update={"width": width}) for opening in front.openings)
    walls = (front.model_copy(update={"openings": doors}), *others)
    narrow = layout.replace(floor=layout.floor.model_copy(update={"walls": walls}))
    issues = [issue for issue in evaluate_layout(narrow, narrow.protocol).issues if issue.rule == "exit_width"]
    assert [issue.severity for issue in issues] == ([] if severity is None else [severity])
    assert len(broken(narrow, "exit_width")) == (severity == "error")
