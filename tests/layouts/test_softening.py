"""The last stage of a repair: soft terms of a layout without faults, and optional pieces beyond their number."""

from __future__ import annotations

import math

import pytest
from laboratories import orderly_laboratory, put
from shapely.geometry import LineString, Polygon

from labgym.layouts import Layout
from labgym.layouts.repairs import repair_layout
from labgym.layouts.repairs.rank import RepairState
from labgym.layouts.repairs.softening import MOVES, softened, without_surplus
from labgym.layouts.rules import Assessment, evaluate_layout, rule_set

V2 = rule_set("touchstone")
LEFT = -math.pi / 2
ACID_WIDTH, BASE_WIDTH = 0.08, 0.075
"""Widths of the two bottles, meters."""
FULL_M = 1.0
"""Distance from which incompatible reagents are fully separated under the default profile, meters."""


def neighbors(apart: float = 0.62, **fixed: bool) -> Layout:
    """A laboratory without faults whose acid and base stand in two cabinets, the middles a distance apart."""
    pieces = (
        put("acids", "AcidCabinet", 0.31, 6.3, yaw=LEFT),
        put("bases", "BaseCabinet", 0.31, 6.3 + apart, yaw=LEFT),
        put("acid", "HydrochloricAcid", 0.31, 6.3, 0.1, yaw=LEFT, on="acids", slot=0),
        put("base", "SodiumHydroxide", 0.31, 6.3 + apart, 0.1, yaw=LEFT, on="bases", slot=0),
        put("spills", "SpillKit", 2.4, 7.75, yaw=math.pi),
    )
    return orderly_laboratory(*(one.model_copy(update={"fixed": fixed.get(one.id, False)}) for one in pieces))


def state(layout: Layout) -> RepairState:
    return RepairState.of(layout, layout.protocol, V2)


def judged(layout: Layout) -> Assessment:
    assessment = evaluate_layout(layout, layout.protocol, V2, navigation=True)
    assert isinstance(assessment, Assessment)
    return assessment


def gap(layout: Layout, first: str, second: str) -> float:
    """Distance of two objects on one height, by shapely."""
    polygons = [Polygon(layout.box(item).corners()) for item in (first, second)]
    return float(polygons[0].distance(polygons[1]))


def pair(layout: Layout) -> float:
    """Satisfaction of the rule on the acid and the base, which stand on two shelves of one height, by hand."""
    one, other = layout.box("acid"), layout.box("base")
    rise = max(one.z0 - other.z1, other.z0 - one.z1, 0.0)
    return min(math.hypot(gap(layout, "acid", "base"), rise) / FULL_M, 1.0)


HOOD_AT_DOOR = (
    put("hood", "FumeHood", 0.425, 2.3, yaw=LEFT),
    put("flask", "RoundBottomFlask", 0.45, 2.3, 0.9, yaw=LEFT, on="hood", slot=0),
    put("plate", "MagneticHotplateStirrer", 0.45, 2.7, 0.9, yaw=LEFT, on="hood", slot=0),
    put("extinguisher", "FireExtinguisher", 3.5, 0.1, 0.9, on="wall"),
    put("flammables", "FlammableCabinet", 0.23, 4.5, yaw=LEFT),
    put("ether", "DiethylEther", 0.23, 4.5, 0.1, on="flammables", slot=0),
)
"""The hood stands less than 3 m from a door."""


def test_incompatible_reagents_of_a_faultless_layout_are_moved_apart() -> None:
    before = neighbors()
    start = judged(before)
    assert start.v == 0
    distance = 0.62 - (ACID_WIDTH + BASE_WIDTH) / 2.0
    assert gap(before, "acid", "base") == pytest.approx(distance)
    instances = len(start.instances)
    assert start.fitness == pytest.approx(1.0 - 0.5 * (1.0 - distance / FULL_M) / instances)
    result = repair_layout(before, rules=V2)
    after = judged(result.layout)
    assert after.v == 0
    assert pair(result.layout) == 1.0
    assert after.fitness == pytest.approx(1.0)
    assert result.problems == ()
    assert len(result.changes) == 1
    (change,) = result.changes
    assert "incompatible" in change.reason
    assert change.id in ("acids", "bases", "acid", "base")


def test_each_step_raises_the_fitness_or_ends_a_warning_and_worsens_nothing() -> None:
    before = orderly_laboratory(*neighbors().placements, *HOOD_AT_DOOR)
    assert judged(before).v == 0
    earlier, count = judged(before), 0
    for step, reason in softened(state(before)):
        later = judged(step.layout)
        assert later.v == 0
        assert later.cost == 0
        assert later.fitness >= earlier.fitness - 1e-9
        assert len(later.advice) <= len(earlier.advice)
        assert later.fitness >= earlier.fitness + 1e-3 or len(later.advice) < len(earlier.advice)
        assert reason
        earlier, count = later, count + 1
    assert 0 < count <= MOVES


def test_a_hood_near_a_door_moves_away_from_it() -> None:
    before = orderly_laboratory(*HOOD_AT_DOOR)
    assert judged(before).v == 0
    door = LineString([(0.7, 0.0), (1.7, 0.0)])
    assert Polygon(before.box("hood").corners()).distance(door) < 3.0
    result = repair_layout(before, rules=V2)
    assert judged(result.layout).v == 0
    assert Polygon(result.layout.box("hood").corners()).distance(door) >= 3.0
    reason = next(change.reason for change in result.changes if change.id == "hood")
    assert "hood_door warnings 1 -> 0" in reason


def test_what_is_fixed_stays_and_a_layout_that_cannot_be_improved_is_the_same_object() -> None:
    layout = neighbors(acids=True, bases=True, acid=True, base=True)
    result = repair_layout(layout, rules=V2)
    assert result.layout is layout
    assert (result.changes, result.problems) == ((), ())
    perfect = orderly_laboratory()
    assert repair_layout(perfect, rules=V2).layout is perfect


def test_a_layout_with_a_fault_is_not_softened() -> None:
    layout = neighbors()
    fallen = put("scale", "ElectronicScale", 4.0, 4.0, 0.4, on="bench", slot=0)
    spoilt = layout.replace(placements=tuple(fallen if one.id == "scale" else one for one in layout.placements))
    assert judged(spoilt).v > 0
    assert list(softened(state(spoilt))) == []


def test_soft_terms_improve_although_the_building_has_no_exit() -> None:
    data = neighbors().to_json()
    for wall in data["floor"]["walls"]:
        wall["openings"] = []
    before = Layout.parse(data, "no exit")
    result = repair_layout(before, rules=V2)
    assert (judged(before).v, judged(result.layout).v) == (1, 1)
    assert pair(result.layout) == 1.0
    assert len(result.problems) == 1
    assert "no exit for 64 m²" in result.problems[0]


def test_a_report_says_why_each_object_was_changed() -> None:
    scale = put("scale", "ElectronicScale", 3.6, 7.55, 0.9, on="hood", slot=0)
    result = repair_layout(orderly_laboratory(scale, without=("detector", "spills")), rules=V2)
    reasons = {change.id: change.reason for change in result.changes}
    assert "fume hoods" in reasons["scale"]
    assert reasons["GasDetector_1"] == reasons["SpillKit_1"] == "required and missing"


def test_softening_is_deterministic() -> None:
    first, second = (repair_layout(neighbors(), rules=V2).layout.hash for _ in range(2))
    assert first == second


BOARDS = tuple(put(f"board_{k}", "NoticeBoard", x, 0.02, 1.2, on="wall") for k, x in enumerate((3.0, 4.2)))


def test_surplus_optional_pieces_are_removed_and_the_report_says_why() -> None:
    before = orderly_laboratory(*BOARDS)
    assert judged(before).v == 0
    result = repair_layout(before, rules=V2)
    assert [(change.id, change.kind) for change in result.changes] == [("board_1", "removed")]
    assert "2 NoticeBoard in one laboratory, at most 1 are useful" in result.changes[0].reason
    assert {one.id for one in before.placements} - {one.id for one in result.layout.placements} == {"board_1"}
    assert result.problems == ()


def test_fixed_surplus_pieces_stay() -> None:
    boards = tuple(board.model_copy(update={"fixed": True}) for board in BOARDS)
    layout = orderly_laboratory(*boards)
    assert repair_layout(layout, rules=V2).layout is layout
    last = orderly_laboratory(BOARDS[0], boards[1])
    assert {one.id for one in last.placements} - {p.id for p in repair_layout(last, rules=V2).layout.placements} == {
        "board_0"
    }


def test_what_stands_in_a_surplus_piece_is_kept() -> None:
    fridges = tuple(put(f"cold_{k}", "LabRefrigerator", x, 7.67, yaw=math.pi) for k, x in enumerate((2.0, 2.7, 0.4)))
    beakers = (
        put(f"beaker_{k}", "Beaker", one.position[0], 7.67, 0.1, on=one.id, slot=0) for k, one in enumerate(fridges)
    )
    before = orderly_laboratory(*fridges, *beakers)
    steps = list(without_surplus(state(before)))
    assert len(steps) == 1
    after = steps[0][0].layout
    assert sum(one.asset == "LabRefrigerator" for one in after.placements) == 2
    assert all(f"beaker_{k}" in after.by_id for k in range(3))
    assert judged(after).v <= judged(before).v


def test_pieces_that_the_protocol_requires_stay() -> None:
    layout = orderly_laboratory(*BOARDS)
    protocol = layout.protocol
    assert protocol is not None
    both = protocol.model_copy(update={"instruments": (*protocol.instruments, "NoticeBoard", "NoticeBoard")})
    needed = layout.replace(protocols=(both,))
    assert [step.layout.by_id.keys() for step, _ in without_surplus(state(needed))] == []


def test_touchstone_1_has_no_limit_of_optional_pieces() -> None:
    layout = orderly_laboratory(*BOARDS)
    assert list(without_surplus(RepairState.of(layout, layout.protocol, "paper"))) == []
