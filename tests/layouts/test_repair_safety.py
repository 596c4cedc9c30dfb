"""Repair cures what makes a laboratory unsafe, as a checker that shares no code with it finds."""

from __future__ import annotations

import math
from functools import cache

import pytest
from outside.safety_checker import Laboratory, faults, reactive

from labgym.layouts import Layout, generate
from labgym.layouts.moves import Place, Rotate, Settle, apply, lifted, replaced
from labgym.layouts.repairs import Repair, repair_layout
from labgym.layouts.rules import rule_set

V2 = rule_set("touchstone")
LABORATORIES = [("red_05", 3, "12x9"), ("cyc_02", 5, "12x9")]


def kinds(layout: Layout) -> set[str]:
    return {fault.kind for fault in faults(layout.to_json())}


def repaired(layout: Layout) -> Repair:
    return repair_layout(layout, rules=V2)


@cache
def good(protocol: str, seed: int, room: str) -> Layout:
    layout = repaired(generate(protocol, seed, room=room)).layout
    assert not kinds(layout)
    return layout


def first(layout, *subtypes):
    return next(p.id for p in layout.placements if layout.asset(p.id).subtype in subtypes)


def without(layout, *assets):
    return layout.replace(placements=tuple(p for p in layout.placements if p.asset not in assets))


def beside(layout, item, target):
    """The layout with an item to the left of another, their backs in line."""
    box, size = layout.box(target), layout.asset(item).size
    along = (box.width + size.width) / 2.0 + 0.05
    x, y = box.x + along * math.cos(box.yaw), box.y + along * math.sin(box.yaw)
    return apply(layout, Place(item, round(x, 4), round(y, 4), box.yaw))


def reactive_at_sink(layout):
    return beside(layout, first(layout, "water_reactive_cabinet", "flammable_cabinet"), first(layout, "sink"))


def extinguisher_high(layout):
    return lifted(layout, next(p.id for p in layout.placements if p.asset == "FireExtinguisher"), 2.0)


def board_over_exit(layout):
    board = next(p for p in layout.placements if p.support == "wall" and layout.asset(p.id).subtype == "board")
    way = next(way for way in layout.floor.doorways if way.exit)
    x, y, yaw = way.side(way.spaces[0])
    out = layout.asset(board.id).size.depth / 2.0 + 0.002
    pose = (x - out * math.sin(yaw), y + out * math.cos(yaw), 1.2)
    return replaced(layout, {board.id: board.model_copy(update={"position": pose, "yaw": yaw})})


def laptop_in_hood(layout):
    return apply(layout, Settle(first(layout, "computer"), first(layout, "ventilation"), 0, 0.3, -0.2))


def waste_on_desk(layout):
    waste = next(p.id for p in layout.placements if p.asset == "SolventWasteContainer")
    return apply(layout, Settle(waste, first(layout, "desk"), 0, -0.3, 0.0))


def reagents_high(layout):
    cabinet = first(layout, "reagent_cabinet")
    top = len(layout.asset(cabinet).surfaces) - 1
    reagents = [p.id for p in layout.children(cabinet) if layout.asset(p.id).kind == "reagent"]
    for k, reagent in enumerate(reagents):
        layout = apply(layout, Settle(reagent, cabinet, top, -0.2 + 0.16 * k, 0.0))
    return layout


def island_askew(layout):
    island = next(p for p in layout.placements if p.asset.startswith("IslandBench"))
    return apply(layout, Rotate(island.id, island.yaw + math.radians(27.0)))


def basin_at_reactive(layout):
    return beside(layout, first(layout, "sink"), first(layout, "water_reactive_cabinet", "flammable_cabinet"))


SPOILT = {
    "reactive_at_sink": reactive_at_sink,
    "basin_at_reactive": basin_at_reactive,
    "extinguisher_high": extinguisher_high,
    "board_over_exit": board_over_exit,
    "laptop_in_hood": laptop_in_hood,
    "waste_on_desk": waste_on_desk,
    "reagents_high": reagents_high,
    "island_askew": island_askew,
    "no_extinguishers": lambda layout: without(layout, "FireExtinguisher", "CO2Extinguisher", "ClassDExtinguisher"),
    "no_basin": lambda layout: without(layout, "HandWashSink"),
    "no_shower_and_eyewash": lambda layout: without(layout, "EmergencyShower", "EyewashStation"),
    "no_detector": lambda layout: without(layout, "GasDetector"),
}


UNSPOILT = {("cyc_02", "reagents_high"), ("cyc_02", "no_detector")}
"""Cases without a general cabinet, or without vapors that call for a detector."""
CASES = [(one, name) for one in LABORATORIES for name in SPOILT if (one[0], name) not in UNSPOILT]
TOGETHER = [
    ("extinguisher_high", "board_over_exit", "laptop_in_hood", "waste_on_desk", "reagents_high"),
    ("no_extinguishers", "no_basin", "no_shower_and_eyewash", "no_detector"),
    ("reactive_at_sink", "island_askew"),
]
"""All ways to spoil a laboratory, those together that do not hide each other; `basin_at_reactive` mirrors the first of
the last ones."""


def spoilt(layout, names):
    for name in names:
        layout = SPOILT[name](layout)
    return layout


@pytest.mark.parametrize("names", TOGETHER, ids=" ".join)
def test_a_laboratory_that_is_spoilt_in_several_ways_is_safe_after_its_repair(names):
    layout = spoilt(good(*LABORATORIES[0]), names)
    assert len(kinds(layout)) >= len(names)
    result = repaired(layout)
    assert result.before.v >= len(names)
    assert (result.after.v, result.problems) == (0, ())
    assert not kinds(result.layout)
    assert len(result.changes) <= 12 * len(names)


@pytest.mark.slow
@pytest.mark.parametrize(("laboratory", "name"), CASES, ids=lambda one: one if isinstance(one, str) else one[0])
def test_a_spoilt_laboratory_is_safe_after_its_repair(laboratory, name):
    result = repaired(spoilt(good(*laboratory), [name]))
    assert result.before.v > 0
    assert (result.after.v, result.problems) == (0, ())
    assert not kinds(result.layout)
    assert len(result.changes) <= 12


USES = [(("red_01", 3, "bay"), "eyewash"), (("alk_03", 4, "12x9"), "sink"), (("pro_03", 8, "two_exits"), "shower")]
"""Laboratories whose protocols handle a borohydride or chlorides, which react with water, and a wet fitting of each."""


@pytest.mark.cases(1)
@pytest.mark.parametrize("moved", ["fitting", "place"])
@pytest.mark.parametrize(("laboratory", "fitting"), USES, ids=lambda one: one if isinstance(one, str) else one[0])
def test_repair_takes_the_use_of_water_reactives_and_wet_fittings_apart(laboratory, moved, fitting):
    before = good(*laboratory)
    places = {item.id for _, item in Laboratory(before.to_json()).used(reactive)}
    assert places
    for place in sorted(places):
        wet = first(before, fitting)
        spoilt = beside(before, *((wet, place) if moved == "fitting" else (place, wet)))
        assert "wet" in kinds(spoilt)
        result = repaired(spoilt)
        assert (result.after.v, result.problems) == (0, ())
        assert not kinds(result.layout)
