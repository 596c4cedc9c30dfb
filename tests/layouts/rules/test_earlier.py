"""An earlier assessment saves work and changes no result."""

from __future__ import annotations

import random
from functools import cache

import pytest

from labgym.layouts import Layout, generate
from labgym.layouts.floors import draw_floor
from labgym.layouts.moves import Move, Rotate, Settle, apply, without
from labgym.layouts.placement import FLOOR, WALL
from labgym.layouts.rules.objective import Assessment, evaluate_layout
from labgym.protocols import get


@cache
def laboratory(family: str) -> Layout:
    return generate("sub_01", 1, floor=draw_floor(family, 1).floor, clutter=1)


def everything(assessment: Assessment) -> str:
    """Return all results with every digit."""
    figures = assessment.v, assessment.cost, assessment.fitness, assessment.facility, assessment.lacking
    found = assessment.bounds, assessment.collisions, assessment.measured, assessment.driven
    return repr((*figures, *found, assessment.issues, assessment.violations))


def changed(layout: Layout, draw: random.Random) -> Layout:
    """Return a layout after several pieces moved, turned, changed their support, or vanished."""
    for _ in range(draw.choice((1, 1, 2, 5, 9))):
        kinds = {p.support if p.support in (FLOOR, WALL) else "item" for p in layout.placements}
        kind = draw.choice(sorted(kinds))
        own = [p for p in layout.placements if (p.support if p.support in (FLOOR, WALL) else "item") == kind]
        piece, what = draw.choice(own), draw.random()
        if what < 0.5:
            layout = apply(layout, Move(piece.id, round(draw.gauss(0.0, 1.0), 3), round(draw.gauss(0.0, 1.0), 3)))
        elif what < 0.75:
            layout = apply(layout, Rotate(piece.id, round(draw.uniform(-3.0, 3.0), 3)))
        elif what < 0.9 and kind == "item":
            tables = [p.id for p in layout.placements if p.support == FLOOR and layout.asset(p.id).surfaces]
            layout = apply(layout, Settle(piece.id, draw.choice(tables), 0, 0.0, 0.0))
        else:
            layout = without(layout, [piece.id])
    return layout


@pytest.mark.parametrize("rules", ["touchstone", "paper"])
@pytest.mark.parametrize("family", ["bay", "suite"])
def test_an_assessment_from_an_earlier_one_equals_a_full_one_to_the_bit(family: str, rules: str) -> None:
    start, draw = laboratory(family), random.Random(f"{family} {rules}")
    protocol = start.protocol
    layout = start
    earlier = evaluate_layout(start, protocol, rules, navigation=True)
    everything(earlier)
    for round_ in range(9):
        layout = changed(start if round_ % 4 == 0 else layout, draw)
        navigation = round_ % 3 == 0
        again = evaluate_layout(layout, protocol, rules, navigation, earlier)
        full = evaluate_layout(Layout.model_validate_json(layout.model_dump_json()), protocol, rules, navigation)
        assert everything(again) == everything(full)
        if draw.random() < 0.5:
            earlier = again


@pytest.mark.parametrize("rules", ["touchstone", "paper"])
def test_each_rule_that_keeps_its_results_after_a_single_move_would_find_them_again(rules: str) -> None:
    start, draw = laboratory("suite"), random.Random(f"single {rules}")
    earlier = evaluate_layout(start, start.protocol, rules)
    judged = [rule for rule in earlier.rules.facility if not rule.ways]
    for rule in judged:
        earlier.issues_of(rule)
    for _ in range(40):
        layout = start
        while layout is start:
            piece = draw.choice(start.placements)
            if piece.support == FLOOR and draw.random() < 0.7:
                continue
            layout = apply(start, Move(piece.id, round(draw.gauss(0.0, 0.5), 3), round(draw.gauss(0.0, 0.5), 3)))
        again = evaluate_layout(layout, start.protocol, rules, earlier=earlier)
        full = evaluate_layout(layout, start.protocol, rules)
        assert (again.bounds, again.collisions, again.measured) == (full.bounds, full.collisions, full.measured)
        for rule in judged:
            assert again.issues_of(rule) == full.issues_of(rule), rule.name


def test_another_protocol_or_floor_takes_nothing_over_that_depends_on_it() -> None:
    layout = laboratory("bay")
    earlier = evaluate_layout(layout, layout.protocol, navigation=True)
    everything(earlier)
    for protocol in (None, get("sub_02")):
        again = evaluate_layout(layout, protocol, navigation=True, earlier=earlier)
        assert everything(again) == everything(evaluate_layout(layout, protocol, navigation=True))
    floor = draw_floor("bay", 2).floor
    moved = layout.replace(floor=floor)
    again = evaluate_layout(moved, layout.protocol, navigation=True, earlier=earlier)
    assert everything(again) == everything(evaluate_layout(moved, layout.protocol, navigation=True))
