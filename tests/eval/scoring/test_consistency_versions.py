"""Both versions of the consistency proxy on spoilt layouts: what version 1 passes, and version 2 does not."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from labgym.eval.scoring.consistency import SAFETY, consistency_proxy
from labgym.eval.scoring.layout_report import ConsistencyProxy
from labgym.layouts import Layout, load_published
from labgym.layouts.moves import Place, Settle, apply, descendants
from labgym.layouts.placement import FLOOR, WALL
from labgym.layouts.rules import PAPER, evaluate_layout
from labgym.layouts.rules.whereabouts import resolved
from labgym.paper.damage import KINDS, damaged

LAYOUT = load_published("test", "test-alk_02")


def proxy(layout: Layout, version: int) -> ConsistencyProxy:
    rules = replace(PAPER, proxy=version)
    return consistency_proxy(evaluate_layout(layout, LAYOUT.protocol, rules, navigation=True))


@pytest.fixture(scope="module")
def sound() -> dict[int, ConsistencyProxy]:
    return {version: proxy(LAYOUT, version) for version in (1, 2)}


def instruments_on_the_floor() -> Layout:
    """Every item that is not a reagent lies on the floor, on a grid, away from furniture."""
    boxes = [LAYOUT.box(p.id) for p in LAYOUT.placements if p.support == FLOOR]
    room = LAYOUT.room
    free = [
        (x, y)
        for x in np.arange(0.3, room.width - 0.3, 0.35)
        for y in np.arange(0.3, room.depth - 0.3, 0.35)
        if all(math.hypot(x - box.x, y - box.y) > 0.3 + math.hypot(box.width, box.depth) / 2.0 for box in boxes)
    ]
    placements, spots = [], iter(free)
    for placement in LAYOUT.placements:
        lies = placement.support not in (FLOOR, WALL) and LAYOUT.asset(placement.id).kind == "instrument"
        spot = next(spots, None) if lies else None
        if spot is not None:
            update = {"position": (float(spot[0]), float(spot[1]), 0.0), "support": FLOOR, "slot": None}
            placement = placement.model_copy(update=update)
        placements.append(placement)
    return LAYOUT.replace(placements=tuple(placements))


def sink_in_the_door() -> Layout:
    door = LAYOUT.room.doors[0]
    assert door.wall == "front"
    sink = LAYOUT.find("SinkBench")
    return apply(LAYOUT, Place(sink.id, door.offset, LAYOUT.box(sink.id).depth / 2.0 + 0.01, 0.0))


def only_what_is_required() -> Layout:
    names = set(resolved(LAYOUT.protocol.required_assets(), LAYOUT.catalog))
    stored = {p.support for p in LAYOUT.placements if LAYOUT.asset(p.id).kind == "reagent"}
    held = {p.support for p in LAYOUT.placements if p.asset in names}
    kept = [p for p in LAYOUT.placements if p.asset in names or p.id in stored | held]
    return LAYOUT.replace(placements=tuple(kept))


def reagents_in_wrong_cabinets() -> Layout:
    """Every reagent stands where one of another class stood."""
    reagents = [p for p in LAYOUT.placements if LAYOUT.asset(p.id).kind == "reagent"]
    classes = {p.id: LAYOUT.asset(p.id).chemistry.storage_class for p in reagents}
    layout = LAYOUT
    for reagent in reagents:
        other = next(o for o in reagents if classes[o.id] != classes[reagent.id])
        surface = LAYOUT.surface(other.support, other.slot)
        x, y = surface.to_local(*other.position[:2])
        layout = apply(layout, Settle(reagent.id, other.support, other.slot, x, y))
    return layout


def furniture_that_faces_the_wall() -> Layout:
    layout = LAYOUT
    for placement in LAYOUT.placements:
        if placement.support == FLOOR and LAYOUT.asset(placement.id).clearance > 0.0:
            layout = apply(layout, Place(placement.id, *placement.position[:2], placement.yaw + math.pi))
    return layout


SPOILT = {
    "instruments on the floor": (instruments_on_the_floor, "realism"),
    "the sink in the door": (sink_in_the_door, "layout"),
    "only what is required": (only_what_is_required, "completeness"),
    "reagents in wrong cabinets": (reagents_in_wrong_cabinets, "layout"),
    "furniture that faces the wall": (furniture_that_faces_the_wall, "layout"),
}


@pytest.mark.parametrize(("spoil", "dimension"), SPOILT.values(), ids=SPOILT)
def test_version_2_takes_two_points_from_a_layout_that_is_useless(sound, spoil, dimension):
    after = proxy(spoil(), 2)
    assert getattr(after, dimension) <= getattr(sound[2], dimension) - 2.0
    assert after.total <= sound[2].total - 2.0


def test_version_1_passes_reagents_in_wrong_cabinets_which_is_why_there_is_a_second(sound):
    assert proxy(reagents_in_wrong_cabinets(), 1).total == pytest.approx(sound[1].total)


@pytest.mark.parametrize("kind", KINDS)
def test_version_2_takes_half_a_point_for_each_kind_of_damage_to_one_piece(sound, kind):
    spoilt = damaged(LAYOUT, kind, 1, np.random.default_rng(5)).layout
    assert proxy(spoilt, 2).total <= sound[2].total - 0.5


def test_a_sound_layout_has_full_points_without_hard_zeros(sound):
    assert not [rule for rule in sound[2].rules if rule.rule.startswith("hard zero")]
    assert sound[2].total > 27.0
    assert (sound[1].version, sound[2].version) == (1, 2)


def test_version_1_is_unchanged_by_the_second(sound):
    added = {rule.rule for rule in sound[2].rules} - {rule.rule for rule in sound[1].rules}
    assert len(added) == 6
    assert [rule for rule in sound[2].rules if rule.rule not in added] == list(sound[1].rules)


@pytest.mark.parametrize("name", SAFETY)
def test_each_piece_of_safety_equipment_counts(sound, name):
    gone = {p.id for p in LAYOUT.placements if LAYOUT.asset(p.id).subtype in SAFETY[name]}
    gone |= {item for each in gone for item in descendants(LAYOUT, each)}
    assert gone
    layout = LAYOUT.replace(placements=tuple(p for p in LAYOUT.placements if p.id not in gone))
    assert proxy(layout, 2).completeness < sound[2].completeness - 0.5


def test_a_door_that_is_blocked_makes_the_layout_zero():
    spoilt = proxy(sink_in_the_door(), 2)
    assert spoilt.layout == 0.0
    assert any(rule.rule == "hard zero: a door or the way to it is blocked" for rule in spoilt.rules)
