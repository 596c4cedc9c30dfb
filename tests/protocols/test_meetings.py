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
from labgym.protocols.rules.consumption import moles, used_up
from labgym.protocols.synthesis.endings import ended

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


def _judge(*actions: Action) -> list[str]:
    """Return the messages on unsafe actions of an experiment whose additions end it as the text says."""
    return [
        item.message for item in FILTER.judge(ended(experiment(*actions), CATALOG)).obstacles if item.code == "unsafe"
    ]


def _take(name: str, amount: str, verb: Verb = "Add") -> Action:
    return Action(verb=verb, takes=(Portion(name=name, amount=amount),))


def test_a_metal_that_an_alcohol_used_up_meets_no_acid() -> None:
    pytest.importorskip("rdkit")
    alcohol, acid = _take("BenzylAlcohol", "10 mL"), _take("HydrochloricAcid", "10 mL", "AdjustPH")
    heat, pour = Action(verb="Heat", temperature=100.0, duration=30.0), _take("DeionizedWater", "100 mL", "Pour")
    assert not _judge(alcohol, _take("Sodium", "0.368 g"), heat, pour, acid)
    # Ten times as much sodium is not used up, and none is before the acid of the reaction itself.
    assert _judge(alcohol, _take("Sodium", "3.68 g"), heat, pour, acid)
    assert _judge(alcohol, _take("Sodium", "0.368 g"), _take("HydrochloricAcid", "10 mL"))


def test_water_after_the_reaction_of_a_hydride_is_a_quench_whatever_else_is_washed_later() -> None:
    hydride, stir = _take("LithiumAluminumHydride", "1 g"), Action(verb="Stir", duration=60.0)
    ether, water = _take("DiethylEther", "50 mL"), _take("DeionizedWater", "5 mL")
    assert not _judge(ether, hydride, stir, water, Action(verb="Filter"))
    assert _judge(_take("Methanol", "50 mL"), hydride, stir)


def test_what_uses_up_a_hydride_is_an_equimolar_acid_and_no_water() -> None:
    pytest.importorskip("rdkit")
    hydride, alcohol, water = (CATALOG.get(name) for name in ("SodiumHydride", "BenzylAlcohol", "DeionizedWater"))
    assert used_up((hydride, alcohol), {"SodiumHydride": 0.1, "BenzylAlcohol": 0.1}) == {"SodiumHydride"}
    assert not used_up((hydride, alcohol), {"SodiumHydride": 0.1, "BenzylAlcohol": 0.09})
    assert not used_up((hydride, water), {"SodiumHydride": 0.1, "DeionizedWater": 5.0})
    complex_hydride = CATALOG.get("LithiumAluminumHydride")
    assert not used_up((complex_hydride, alcohol), {"LithiumAluminumHydride": 0.1, "BenzylAlcohol": 1.0})
    assert moles(hydride, "1.2 g of 60 %; 0.4 g of 60 %") == pytest.approx(0.04, rel=0.01)
