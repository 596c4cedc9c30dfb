"""Reagents that must never meet are refused where they do meet, and only there."""

from __future__ import annotations

from typing import get_args

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from labgym.assets import Catalog, Substance
from labgym.protocols.experiments import Action, Experiment, Material, Portion
from labgym.protocols.experiments.feasibility import PURIFYING, FeasibilityFilter
from labgym.protocols.experiments.model import Verb
from labgym.protocols.refusals import refusals

CATALOG = Catalog.published()
FILTER = FeasibilityFilter(CATALOG)
MIXTURES = tuple(
    tuple(sorted(side)[0] for side in (mixture.a, mixture.b, mixture.c) if side) for mixture in refusals().mixtures
)
KEEPING = sorted(set(get_args(Verb)) - PURIFYING - {"Concentrate", "DrySolution", "Refers", "Repeat"})
"""Actions that separate nothing for certain."""


def experiment(*actions: Action) -> Experiment:
    names = dict.fromkeys(portion.name for action in actions for portion in action.takes)
    materials = tuple(Material(name=name, role="reagent") for name in names)
    return Experiment(id="meet", name="meeting", product="acetanilide", materials=materials, actions=actions)


def add(name: str, verb: Verb = "Add") -> Action:
    return Action(verb=verb, takes=(Portion(name=name, amount="1 mmol"),))


def unsafe(*actions: Action) -> list[str]:
    return [item.message for item in FILTER.judge(experiment(*actions)).obstacles if item.code == "unsafe"]


@settings(deadline=None, max_examples=60)
@given(
    st.sampled_from(MIXTURES),
    st.lists(st.sampled_from(KEEPING), max_size=3),
    st.sampled_from(["Add", "Quench", "Wash"]),
)
def test_a_pair_that_meets_is_refused_whatever_happens_in_between(mixture, between, last) -> None:
    *first, end = mixture
    middle = [Action(verb=verb) for verb in between]
    found = unsafe(*(add(name) for name in first), *middle, add(end, last), Action(verb="Stir", duration=5.0))
    assert any("must not be part of one experiment" in message or "reacts violently" in message for message in found)


@pytest.mark.parametrize("mixture", MIXTURES)
def test_a_pair_in_one_action_is_refused(mixture) -> None:
    together = Action(verb="Add", takes=tuple(Portion(name=name, amount="1 mmol") for name in mixture))
    assert unsafe(together, Action(verb="Stir", duration=5.0))


def test_a_pair_that_the_work_up_keeps_apart_is_not_refused() -> None:
    # The product of the azide reaction is chromatographed before an acid is added to it.
    assert unsafe(add("SodiumAzide"), add("HydrochloricAcid"))
    assert not unsafe(add("SodiumAzide"), Action(verb="Chromatograph"), add("HydrochloricAcid"))
    # Two washes in a row do not meet, a solvent that is evaporated does not meet what follows.
    washes = (add("Cyclohexanol"), add("SodiumHypochlorite", "Wash"), add("AmmoniumChloride", "Wash"))
    assert not unsafe(*washes)
    assert unsafe(add("Cyclohexanol"), add("SodiumHypochlorite"), add("AmmoniumChloride", "Wash"))
    assert not unsafe(add("Dichloromethane"), Action(verb="Concentrate"), add("SodiumAzide"))
    assert unsafe(add("Dichloromethane"), Action(verb="Filter"), add("SodiumAzide"))


def test_an_open_substance_is_refused_like_the_reagent_with_its_groups() -> None:
    pytest.importorskip("rdkit")
    hydride = Substance(
        name="PotassiumHydride",
        names=("potassium hydride",),
        smiles="[K+].[H-]",
        source="table",
        state="solid",
        flags=("pyrophoric", *(flag for flag, holds in _flags("SodiumHydride") if holds)),
        groups=CATALOG.get("SodiumHydride").chemistry.groups,
    )
    judge = FeasibilityFilter(CATALOG.including((hydride,)))
    verdict = judge.judge(
        experiment(add("PotassiumHydride"), add("Dichloromethane"), Action(verb="Stir", duration=5.0))
    )
    assert any("SodiumHydride" in item.message for item in verdict.obstacles if item.code == "unsafe")


def _flags(name: str):
    from labgym.assets.flags import carried

    return carried(CATALOG.get(name)).items()
