"""What is in a room where it does not belong, and exits without a sign, are violations; repair marks the exits."""

from __future__ import annotations

import math
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


def test_a_published_floor_breaks_neither_rule():
    assert broken(floor(), "exit_sign") == broken(floor(), "wrong_room") == []


@pytest.mark.parametrize(("role", "use"), WRONG)
def test_hazards_in_corridors_and_write_up_rooms_are_named(role, use):
    layout = floor()
    item, space = first(layout, role), next(space for space in layout.floor.spaces if space.use == use)
    middle = (space.boxes[0].x, space.boxes[0].y, 0.0)
    moved = layout.placement(item).model_copy(update={"position": middle, "support": "floor", "slot": None})
    assert (item,) in broken(replaced(layout, {item: moved}), "wrong_room")


def test_every_exit_of_several_spaces_needs_its_sign():
    layout = floor()
    exits = sum(way.exit for way in layout.floor.doorways)
    assert len(signs(layout)) == exits >= 2
    assert len(broken(without(layout, signs(layout)[:1]), "exit_sign")) == 1
    assert len(broken(without(layout, signs(layout)), "exit_sign")) == exits


@pytest.mark.parametrize(("meters", "marks"), [(0.5, True), (1.0, True), (3.0, False), (-3.0, False)])
def test_a_sign_marks_its_exit_within_the_width_of_the_exit(meters, marks):
    sign = signs(floor())[0]
    found = broken(shifted(floor(), sign, meters), "exit_sign")
    assert found == ([] if marks else [(), (sign,)])


def test_one_room_in_sight_needs_no_sign_but_one_that_misleads_is_named():
    room = load_published("val", "val-alk_02")
    assert broken(room, "exit_sign") == []
    kit = room.placement(first(room, "FirstAidKit"))
    sign = kit.model_copy(update={"id": "sign", "asset": SIGN, "position": (*kit.position[:2], 2.3)})
    assert ("sign",) in broken(room.replace(placements=(*room.placements, sign)), "exit_sign")


@pytest.mark.parametrize("spoil", [lambda layout: without(layout, [*signs(layout), first(layout, "FirstAidKit")]),
                                   lambda layout: shifted(layout, signs(layout)[0], 3.0)])  # fmt: skip
def test_repair_marks_the_exits_and_hangs_the_first_aid_kit(spoil):
    repair = repair_layout(spoil(floor()))
    assert (repair.before.v > 0, repair.after.v, repair.after.lacking, repair.problems) == (True, 0, (), ())
    assert len(signs(repair.layout)) == len(signs(floor()))
