"""Experiments become protocols: complete, sound, and the same every time."""

from __future__ import annotations

from typing import get_args

import pytest

from labgym.assets import Catalog
from labgym.errors import LabgymError
from labgym.layouts import generate
from labgym.protocols import Protocol, examine
from labgym.protocols.experiments import Action, Experiment, experiments
from labgym.protocols.experiments.model import Verb
from labgym.protocols.synthesis import RefusalError
from labgym.protocols.synthesis.staging import stage
from labgym.protocols.validate import ProtocolError

INFEASIBLE = {
    "alk_benzyltrimethylammonium_iodide",
    "cyc_diels_alder_furan",
    "cyc_phenylhydantoin",
    "pro_acetal_removal_benzaldehyde",
    "pro_acetanilide_removal",
    "pro_acetate_removal_zemplen",
    "pro_benzyl_ester_hydrogenolysis",
    "pro_ketal_cyclohexanone_removal",
    "pro_phenol_acetate_removal",
    "pro_tert_butyl_ester_removal",
    "pro_tfa_amide_removal",
    "pro_tms_phenol_removal",
    "sub_bmim_iodide",
    "sub_bromopropane_from_tosylate",
}
"""Experiments with a substance that the catalog lacks."""
FEASIBLE = [name for name in experiments() if name not in INFEASIBLE]


@pytest.mark.cases(40)
@pytest.mark.parametrize("name", FEASIBLE)
def test_a_feasible_experiment_becomes_a_protocol_without_faults(name: str) -> None:
    experiment, protocol = experiments()[name], stage(experiments()[name])
    assert [finding for finding in examine(protocol) if finding.severity == "fault"] == []
    assert {use.name for use in protocol.reagents} >= {material.name for material in experiment.materials}
    assert protocol.steps[0].location == "PreparationBench"
    assert protocol.steps[-1].location == "SinkBench"
    assert protocol.reaction_type == experiment.reaction_type
    hottest = max((a.temperature for a in experiment.actions if a.temperature is not None), default=22.0)
    assert max(step.temperature for step in protocol.steps if step.temperature is not None) >= hottest
    assert Protocol.parse(protocol.to_json()) == protocol


def test_what_breaks_a_rule_is_not_written_and_the_rule_is_named() -> None:
    bromination = experiments()["fgt_benzyl_bromide_nbs"].model_dump()
    initiator = next(take for take in bromination["actions"][0]["takes"] if take["name"] == "AIBN")
    initiator["amount"] = "8.2 g, 50 mmol"
    with pytest.raises(ProtocolError) as error:
        stage(Experiment.model_validate(bromination))
    assert [finding.rule for finding in error.value.findings] == ["explosive-heated"]


@pytest.mark.parametrize("name", sorted(INFEASIBLE))
def test_what_is_infeasible_is_refused_with_the_reason(name: str) -> None:
    with pytest.raises(RefusalError, match="the catalog has no"):
        stage(experiments()[name])


def test_an_experiment_of_unknown_type_is_a_protocol_without_a_type() -> None:
    untyped = experiments()["cyc_biginelli"].model_copy(update={"reaction_type": None})
    protocol = stage(untyped)
    assert protocol.reaction_type is None
    assert Protocol.parse(protocol.to_json()) == protocol


def test_solids_that_moisture_spoils_are_weighed_in_the_glove_box() -> None:
    steps = stage(experiments()["alk_acetophenone_fc"]).steps
    (dry,) = [step for step in steps if step.location == "GloveBox"]
    assert "AluminumChloride" in dry.uses


def test_strong_acid_is_poured_onto_water_in_another_vessel() -> None:
    experiment = experiments()["fgt_benzamide_nitrile_acid"]
    quench = next(step for step in stage(experiment).steps if step.action == "Quench")
    assert any(Catalog.published().get(name).subtype in ("beaker", "reactor") for name in quench.uses)
    assert "onto the water" in quench.text


def test_a_staged_experiment_gets_a_laboratory() -> None:
    layout = generate(stage(experiments()["cyc_biginelli"]), seed=0)
    assert layout.protocol_id == "cyc_biginelli"
    assert {item.asset for item in layout.placements} >= {"Urea", "Benzaldehyde", "RefluxCondenser", "FumeHood"}


def test_an_experiment_without_analysis_gets_one_that_says_it_is_assumed() -> None:
    plain = experiments()["cyc_biginelli"]
    bare = plain.model_copy(update={"actions": tuple(a for a in plain.actions if a.verb != "Analyze")})
    (analysis,) = [step for step in stage(bare).steps if step.location == "ValidationPlatform"]
    assert "assumed" in analysis.text


def test_staging_twice_gives_the_same() -> None:
    for name in FEASIBLE[::20]:
        assert stage(experiments()[name]) == stage(experiments()[name])


def test_actions_of_every_verb_can_be_staged_or_are_refused_clearly() -> None:
    plain = experiments()["cyc_biginelli"]
    for verb in get_args(Verb):
        action = Action(verb=verb, duration=20.0)
        changed: Experiment = plain.model_copy(update={"actions": (*plain.actions[:3], action, *plain.actions[3:])})
        try:
            told = "; ".join(step.text for step in stage(changed).steps)
        except LabgymError as error:
            told = str(error)
        assert told
        assert "\n" not in told


def test_zero_degrees_is_a_temperature() -> None:
    plain = experiments()["alk_benzylacetamide"]
    changed = [
        action.model_copy(update={"temperature": 0.0}) if action.verb == "Concentrate" else action
        for action in plain.actions
    ]
    steps = stage(plain.model_copy(update={"actions": tuple(changed)})).steps
    assert [step.temperature for step in steps if step.action == "Concentrate"] == [0.0]


def test_a_reagent_may_be_added_any_number_of_times() -> None:
    plain = experiments()["cyc_biginelli"]
    portion = Action(verb="Add", takes=({"name": "Ethanol", "amount": "1 mL"},), temperature=22, duration=5)
    protocol = stage(plain.model_copy(update={"actions": (*plain.actions[:2], *[portion] * 7, *plain.actions[2:])}))
    (use,) = [use for use in protocol.reagents if use.name == "Ethanol"]
    assert "solvent 8" in use.role


def test_a_hydrogenation_takes_hydrogen_even_where_the_action_names_the_catalyst_alone() -> None:
    plain = experiments()["red_ethylbenzene_styrene"]
    actions = []
    for action in plain.actions:
        if action.verb == "Hydrogenate":
            action = action.model_copy(update={"takes": ()})
        actions.append(action)
    protocol = stage(plain.model_copy(update={"actions": tuple(actions)}))
    (step,) = [step for step in protocol.steps if step.action == "Hydrogenate"]
    assert "Hydrogen" in step.uses


def test_an_experiment_that_is_too_long_for_a_protocol_is_refused_in_one_line() -> None:
    plain = experiments()["cyc_biginelli"]
    stir = Action(verb="Stir", temperature=22, duration=5)
    with pytest.raises(RefusalError, match="100 items"):
        stage(plain.model_copy(update={"actions": (*plain.actions[:3], *[stir] * 120, *plain.actions[3:])}))
