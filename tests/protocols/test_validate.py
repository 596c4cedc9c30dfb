"""Broken protocols: each breach is found by its rule, at its step, with a remedy."""

from __future__ import annotations

import pytest

from labgym.assets import Catalog, incompatible
from labgym.errors import LabgymError
from labgym.protocols import (
    ChemicalConstraint,
    Protocol,
    ProtocolError,
    ReagentUse,
    SpatialConstraint,
    check,
    get,
    validate,
)
from labgym.protocols.rules.sequence import PREPARATION

BASE = get("sub_01")


def with_step(index: int, /, **changes: object) -> Protocol:
    steps = tuple(step.model_copy(update=changes) if step.index == index else step for step in BASE.steps)
    return BASE.model_copy(update={"steps": steps})


def with_fields(**changes: object) -> Protocol:
    return BASE.model_copy(update=changes)


def with_chemical(kind: str, subject: str, target: str) -> Protocol:
    added = ChemicalConstraint(kind=kind, subject=subject, object=target)
    return with_fields(chemical_constraints=(*BASE.chemical_constraints, added))


def with_spatial(kind: str, subject: str, target: str) -> Protocol:
    added = SpatialConstraint(kind=kind, subject=subject, object=target)
    return with_fields(spatial_constraints=(*BASE.spatial_constraints, added))


def reagent(name: str, role: str = "solvent", amount: str = "1 mL") -> ReagentUse:
    return ReagentUse(name=name, role=role, amount=amount)


BROKEN = {
    "unknown reagent": (with_fields(reagents=(*BASE.reagents, reagent("Unobtainium"))), "asset-exists", None),
    "unknown instrument": (with_fields(instruments=(*BASE.instruments, "Tricorder")), "asset-exists", None),
    "unknown location": (with_step(3, location="Broomcupboard"), "asset-exists", 3),
    "instrument as reagent": (with_fields(reagents=(*BASE.reagents, reagent("Beaker"))), "asset-kind", None),
    "reagent as instrument": (with_fields(instruments=(*BASE.instruments, "Ethanol")), "asset-kind", None),
    "instrument as location": (with_step(3, location="OilBath"), "asset-kind", 3),
    "work in a cabinet": (with_step(7, location="FlammableCabinet"), "location-legal", 7),
    "work under the shower": (with_step(7, location="EmergencyShower"), "location-legal", 7),
    "reagent twice": (with_fields(reagents=(*BASE.reagents, BASE.reagents[0])), "reagent-distinct", None),
    "use not listed": (with_step(7, uses=("ErlenmeyerFlask", "Beaker")), "use-listed", 7),
    "reagent never used": (with_step(7, uses=("ErlenmeyerFlask",)), "all-used", None),
    "instrument never used": (with_step(9, uses=()), "all-used", None),
    "empty name": (with_fields(name=" "), "field-complete", None),
    "empty description": (with_fields(description=""), "field-complete", None),
    "empty product": (with_fields(product=""), "field-complete", None),
    "empty role": (with_fields(reagents=(reagent("Phenol", role=""), *BASE.reagents[1:])), "field-complete", None),
    "unknown unit": (
        with_fields(reagents=(reagent("Phenol", amount="3 spoons"), *BASE.reagents[1:])),
        "amount-unit",
        None,
    ),
    "empty amount": (with_fields(reagents=(reagent("Phenol", amount=""), *BASE.reagents[1:])), "field-complete", None),
    "empty action": (with_step(4, action=""), "field-complete", 4),
    "empty text": (with_step(4, text="  "), "field-complete", 4),
    "no duration": (with_step(4, duration=None), "field-complete", 4),
    "zero duration": (with_step(4, duration=0.0), "field-complete", 4),
    "reflux without temperature": (with_step(3, temperature=None), "field-complete", 3),
    "steps out of order": (with_fields(steps=(BASE.steps[0], BASE.steps[2], *BASE.steps[3:])), "step-order", 3),
    "steps repeat": (with_step(4, index=3), "step-order", 3),
    "no preparation": (with_step(1, action="Reflux"), "preparation-first", 1),
    "preparation elsewhere": (with_step(1, location="SinkBench"), "preparation-first", 1),
    "cleaning forgotten": (with_fields(steps=BASE.steps[:-1]), "cleaning-last", 9),
    "cleaning at the wrong place": (with_step(10, location="FumeHood"), "cleaning-last", 10),
    "no analysis": (with_step(9, action="Look"), "analysis-present", None),
    "solvent on the open bench": (with_step(2, location="MainWorkbench"), "location-safe", 2),
    "solvent at the sink": (with_step(6, location="SinkBench"), "location-safe", 6),
    "reflux without heat": (with_step(3, uses=("RoundBottomFlask", "RefluxCondenser")), "heat-source", 3),
    "bath too cold": (with_step(3, temperature=250.0), "heat-source", 3),
    "constraint on a stranger": (with_chemical("store", "Ethanol", "Flammable"), "constraint-refers", None),
    "heat from a flask": (with_chemical("separate_heat", "Acetone", "FilterFlask"), "constraint-refers", None),
    "heat from elsewhere": (with_chemical("separate_heat", "Acetone", "BunsenBurner"), "constraint-refers", None),
    "apart from itself": (with_chemical("separate_incompatible", "Acetone", "Acetone"), "constraint-refers", None),
    "apart from a stranger": (with_chemical("separate_incompatible", "Acetone", "Bromine"), "constraint-refers", None),
    "no such storage": (with_chemical("store", "Acetone", "Attic"), "constraint-refers", None),
    "wrong storage": (with_chemical("store", "Acetone", "Acid"), "constraint-refers", None),
    "ventilated bench": (with_chemical("ventilate", "Acetone", "SinkBench"), "constraint-refers", None),
    "ventilated elsewhere": (with_chemical("ventilate", "Acetone", "GloveBox"), "constraint-refers", None),
    "near a stranger": (with_spatial("near", "OilBath", "Sofa"), "constraint-refers", None),
    "a stranger near": (with_spatial("near", "Sofa", "OilBath"), "constraint-refers", None),
    "on an instrument": (with_spatial("on", "RoundBottomFlask", "OilBath"), "constraint-refers", None),
    "near itself": (with_spatial("near", "OilBath", "OilBath"), "constraint-refers", None),
}


@pytest.mark.parametrize(("protocol", "rule", "step"), BROKEN.values(), ids=BROKEN)
def test_a_breach_is_found_at_its_step_with_a_remedy(protocol, rule, step):
    findings = validate(protocol)
    assert (rule, step) in {(finding.rule, finding.step) for finding in findings}
    for finding in findings:
        assert finding.message
        assert finding.suggestion
        assert "\n" not in finding.message + finding.suggestion


@pytest.mark.parametrize(("protocol", "rule", "step"), BROKEN.values(), ids=BROKEN)
def test_check_raises_one_line_that_carries_all_findings(protocol, rule, step):
    with pytest.raises(ProtocolError, match="sub_01") as caught:
        check(protocol)
    assert isinstance(caught.value, LabgymError)
    assert caught.value.findings == validate(protocol)
    assert "\n" not in str(caught.value)


def test_an_unknown_name_is_told_with_its_neighbours():
    broken = with_fields(instruments=(*BASE.instruments, "RotaryEvaporater"))
    (finding,) = [finding for finding in validate(broken) if finding.rule == "asset-exists"]
    assert "RotaryEvaporator" in finding.suggestion


def test_weighing_a_toxic_solid_on_the_bench_is_allowed_but_not_pouring_it():
    assert validate(BASE) == ()
    assert "Phenol" in BASE.steps[0].uses
    poured = with_step(1, uses=(*BASE.steps[0].uses, "Acetone"))
    assert [finding.rule for finding in validate(poured)] == ["location-safe"]


def test_violent_partners_meet_only_where_it_is_ventilated():
    protocol = get("con_02")
    quench = next(step for step in protocol.steps if step.action == "Quench")
    moved = quench.model_copy(
        update={"location": "MainWorkbench", "uses": ("Beaker", "HydrochloricAcid", "Piperidine")}
    )
    steps = tuple(moved if step.index == quench.index else step for step in protocol.steps)
    messages = [finding.message for finding in validate(protocol.model_copy(update={"steps": steps}))]
    assert any("together" in message and "Piperidine" in message for message in messages)


def test_what_explodes_together_meets_only_where_it_is_ventilated_though_layouts_may_store_it_together():
    nitrite, ammonium = (Catalog.published().get(name) for name in ("SodiumNitrite", "AmmoniumChloride"))
    assert incompatible(nitrite, ammonium) is None
    step = next(step for step in BASE.steps if step.action not in PREPARATION)
    for location, told in (("MainWorkbench", True), ("FumeHood", False)):
        mixed = with_step(step.index, location=location, uses=(nitrite.name, ammonium.name))
        messages = [finding.message for finding in validate(mixed) if finding.rule == "location-safe"]
        assert any("AmmoniumChloride and SodiumNitrite together" in message for message in messages) == told
