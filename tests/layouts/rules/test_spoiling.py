"""Ways to spoil a layout: each worsens the headline figures that it names, on two families."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from laboratories import published_in_order
from spoiling import SPOILINGS

from labgym.layouts import Layout, generate
from labgym.layouts.rules import Assessment, evaluate_layout
from labgym.layouts.rules.rule import mean, worst_mean
from labgym.paper.damage import KINDS, damaged

LESS_IS_BETTER = {"ob", "cn", "v"}
PASSED_PAPER = (
    "sink_in_door", "bare_necessities", "wrong_cabinets", "cabinet_faces_wall", "stools_in_doors", "no_extinguisher",
)  # fmt: skip
"""Spoilt layouts with the v and F of the untouched one under the rule set `paper`."""


TOGETHER = (
    ("no_extinguisher", "heat_by_flammables"),
    ("wrong_cabinets", "incompatibles_together"),
    ("shower_crowded", "no_eyewash"),
    ("stools_in_doors", "vessels_out_of_hood"),
    ("hood_faces_wall", "reagents_on_bench"),
    ("no_waste", "reagent_on_floor"),
    ("furniture_stacked", "items_float"),
    ("instrument_missing", "hood_without_clearance"),
    ("goal_pose_blocked", "no_spill_kit"),
    ("wall_units_on_floor", "no_shower"),
)
"""Pairs of ways to spoil a layout, applied in this order."""


WITH_WAYS = {"prot_nav", "door_nav", "facility"}
"""Figures that depend on ways, which take as long as all the rest."""


@dataclass(frozen=True)
class Case:
    """An untouched layout and its assessments without and with ways."""

    layout: Layout
    without_ways: Assessment
    with_ways: Assessment


def assess(layout: Layout, ways: bool) -> Assessment:
    return evaluate_layout(layout, layout.protocol, navigation=ways)


def figure(assessment: Assessment, name: str) -> float | None:
    """A headline figure, computed from the assessment."""
    drives = (*(assessment.transitions or ()), *assessment.drives_of("entries"))
    entries = assessment.drives_of("entries")
    lists = {
        "store": assessment.of("storage"),
        "glass": assessment.of("glass"),
        "fronts": assessment.of("front"),
        "near": assessment.of("near"),
        "ventilate": assessment.of("ventilation"),
    }
    if name in lists:
        return mean(lists[name])
    return {
        "ob": lambda: len(assessment.out_of_bounds),
        "cn": lambda: len(assessment.collisions),
        "v": lambda: assessment.v,
        "fitness": lambda: assessment.fitness,
        "asset": lambda: float(not (assessment.missing or assessment.unequipped)),
        "safety": lambda: 1.0 - len(assessment.unequipped) / len(assessment.equipment),
        "prot_nav": lambda: float(all(drive.feasible for drive in drives)),
        "door_nav": lambda: sum(drive.feasible for drive in entries) / len(entries),
        "flam": lambda: worst_mean(assessment.of("flammable")),
        "incomp": lambda: worst_mean(assessment.of("incompatible")),
        "facility": lambda: assessment.facility_score,
        "reach": lambda: assessment.reach,
    }[name]()


def worse(name: str, before: float | None, after: float | None) -> bool:
    if before is None or after is None:
        return before is not None
    return after > before + 1e-9 if name in LESS_IS_BETTER else after < before - 1e-9


@pytest.fixture(scope="module")
def cases() -> dict[str, Case]:
    """A published room and a floor of the family `ell`."""
    layouts = {"room": published_in_order(), "ell": generate("sub_02", 704, family="ell")}
    return {name: Case(layout, assess(layout, False), assess(layout, True)) for name, layout in layouts.items()}


def test_untouched_layouts_have_no_violation(cases: dict[str, Case]) -> None:
    assert [case.with_ways.v for case in cases.values()] == [0, 0]


@pytest.mark.cases(20)
@pytest.mark.parametrize("name", SPOILINGS)
def test_every_way_to_spoil_a_layout_worsens_its_headline_figures(cases: dict[str, Case], name: str) -> None:
    spoiling, applied = SPOILINGS[name], 0
    ways = not WITH_WAYS.isdisjoint(spoiling.figures)
    for case in cases.values():
        assert case.layout.protocol is not None
        spoilt = spoiling.spoil(case.layout, case.layout.protocol)
        if spoilt is case.layout:
            continue
        applied += 1
        before, after = case.with_ways if ways else case.without_ways, assess(spoilt, ways)
        for one in spoiling.figures:
            assert worse(one, figure(before, one), figure(after, one)), one
    assert applied


@pytest.mark.cases(10)
@pytest.mark.parametrize("pair", TOGETHER, ids="+".join)
def test_of_two_faults_neither_hides_the_other(cases: dict[str, Case], pair: tuple[str, str]) -> None:
    case, figures = cases["room"], {name for one in pair for name in SPOILINGS[one].figures}
    ways = not WITH_WAYS.isdisjoint(figures)
    spoilt = case.layout
    for name in pair:
        assert case.layout.protocol is not None
        before, spoilt = spoilt, SPOILINGS[name].spoil(spoilt, case.layout.protocol)
        assert spoilt is not before, name
    untouched, after = case.with_ways if ways else case.without_ways, assess(spoilt, ways)
    for one in sorted(figures):
        assert worse(one, figure(untouched, one), figure(after, one)), one


@pytest.mark.parametrize("name", PASSED_PAPER)
def test_some_of_them_pass_the_rule_set_paper_unnoticed(cases: dict[str, Case], name: str) -> None:
    layout = cases["room"].layout
    assert layout.protocol is not None
    spoilt = SPOILINGS[name].spoil(layout, layout.protocol)
    before, after = (evaluate_layout(one, layout.protocol, rules="paper", navigation=True) for one in (layout, spoilt))
    assert (after.v, after.fitness, after.missing) == (before.v, before.fitness, before.missing)


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_of_damage_raises_v(cases: dict[str, Case], kind: str) -> None:
    case = cases["ell"]
    harmed = damaged(case.layout, kind, 1, np.random.default_rng(0)).layout
    assert assess(harmed, True).v > case.with_ways.v
