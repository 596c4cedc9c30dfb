"""Exports: what other programs read, and what comes back when an export is imported."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

from labgym.cli.app import main
from labgym.protocols import protocols
from labgym.protocols.amounts import read_amount
from labgym.protocols.experiments import Action, Experiment, Material, Portion, Rejection, experiments
from labgym.protocols.experiments.model import Period
from labgym.protocols.experiments.remarks import read_remark
from labgym.protocols.exporters import SUFFIXES, as_experiment, export
from labgym.protocols.importers import Format, read

SAMPLE = Experiment(
    id="sample",
    name="Sample",
    reaction="CCO.CC(=O)O>>CCOC(C)=O",
    product="ethyl acetate",
    materials=(
        Material(name='ethanol -- "dry"', role="reactant", smiles="CCO"),
        Material(name="acid <1>", role="reactant", smiles="CC(=O)O"),
        Material(name="dichloromethane", role="solvent", smiles="ClCCl"),
        Material(name="magnesium sulfate", role="workup"),
    ),
    actions=(
        Action(verb="Purge", atmosphere="argon", duration=5.0),
        Action(
            verb="MakeSolution",
            takes=(
                Portion(name='ethanol -- "dry"', amount="1.2 equiv"),
                Portion(name="acid <1>", amount="5 mg, 2 mmol"),
            ),
            manner="dropwise",
            vessel="flask",
        ),
        Action(verb="Heat", temperature=80.0, duration=90.0, pressure=2.5, then=(Period(temperature=20.0),)),
        Action(verb="Extract", takes=(Portion(name="dichloromethane", amount="3 x 30 mL"),), keep="organic"),
        Action(verb="DrySolution", takes=(Portion(name="magnesium sulfate"),)),
        Action(
            verb="Wash", takes=(Portion(name="acid <1>", amount="10 mL", solvent="water"),), ph=5.5, note="to -- end"
        ),
        Action(verb="Concentrate", temperature=40.0, pressure=0.05),
        Action(verb="Monitor"),
        Action(verb="DrySolid", atmosphere="vacuum", repeats=2),
        Action(verb="Yield", gives=(Portion(name="ethyl acetate", amount="3 g"),)),
    ),
)
"""Actions that are hard to express: no verb, conditions, amount or name of them is in every format."""
EXPERIMENTS = (
    SAMPLE,
    *list(experiments().values())[::12],
    *(as_experiment(p) for p in list(protocols().values())[::6]),
)


def facts(experiment: Experiment) -> list[dict[str, Any]]:
    """Return the actions with substances, amounts and conditions, without the final Yield."""
    left_out = {"span", "assumed", "gives", "note"}
    actions = [action.model_dump(exclude=left_out) for action in experiment.unrolled().actions]
    return actions[: -1 if actions[-1]["verb"] == "Yield" else None]


def again(experiment: Experiment, format: Format, folder: Path) -> Experiment:  # noqa: A002
    file = folder / f"x{SUFFIXES[format]}"  # type: ignore[index]
    file.write_text(export(experiment, format), encoding="utf-8")  # type: ignore[arg-type]
    (found,) = read(file, format)
    assert isinstance(found, Experiment), found
    return found


@pytest.mark.parametrize("format", ["ord", "xdl"])
@pytest.mark.parametrize("experiment", EXPERIMENTS, ids=lambda item: item.id)
def test_an_export_comes_back_with_the_same_actions(experiment: Experiment, format: Format, tmp_path: Path) -> None:  # noqa: A002
    if format == "ord":
        pytest.importorskip("google.protobuf")
    found = again(experiment, format, tmp_path)
    assert facts(found) == facts(experiment)
    assert found.reaction == experiment.reaction
    used = {portion.name for action in experiment.actions for portion in action.takes}
    structures = {material.name: material.smiles for material in experiment.materials if material.name in used}
    assert {material.name: material.smiles for material in found.materials} == structures


def test_a_reaction_has_inputs_conditions_and_workups() -> None:
    (reaction,) = json.loads(export(SAMPLE, "ord"))["reactions"]
    (inputs,) = reaction["inputs"].values()
    assert [item["reactionRole"] for item in inputs["components"]] == ["REACTANT", "REACTANT"]
    assert inputs["components"][1]["amount"] == {"mass": {"value": 5.0, "units": "MILLIGRAM"}}
    assert reaction["conditions"]["temperature"]["setpoint"] == {"value": 80.0, "units": "CELSIUS"}
    assert reaction["outcomes"][0]["reactionTime"] == {"value": 90.0, "units": "MINUTE"}
    assert [workup["type"] for workup in reaction["workups"]] == [
        *("CUSTOM", "EXTRACTION", "DRY_WITH_MATERIAL", "WASH", "CONCENTRATION", "CUSTOM", "DRY_IN_VACUUM")
    ]
    assert all(workup.get("details") for workup in reaction["workups"] if workup["type"] == "CUSTOM")
    assert reaction["workups"][1]["input"]["components"][0]["amount"]["volume"] == {
        "value": 90.0,
        "units": "MILLILITER",
    }


def test_steps_of_xdl_declare_what_they_use_and_have_units() -> None:
    synthesis = ElementTree.fromstring(export(SAMPLE, "xdl"))
    reagents = {reagent.get("name") for reagent in synthesis.iter("Reagent")}
    vessels = {component.get("id") for component in synthesis.iter("Component")}
    steps = list(synthesis.find("Procedure") or ())
    for step in steps:
        assert {value for key, value in step.items() if key in ("reagent", "solvent")} <= reagents
        assert {value for key, value in step.items() if "vessel" in key} <= vessels
    separated = next(step for step in steps if step.tag == "Separate")
    assert separated.get("product_phase") == "bottom"
    assert (separated.get("solvent_volume"), separated.get("repeats")) == ("30 mL", "3")
    assert next(step for step in steps if step.tag == "HeatChill").get("temp") == "80 °C"


def test_autoprotocol_provisions_all_that_has_a_mass_or_a_volume() -> None:
    experiment = experiments()["cyc_biginelli"]
    instructions = json.loads(export(experiment, "autoprotocol"))["instructions"]
    provisioned = [item for item in instructions if item["op"] == "provision"]
    amounts = [read_amount(portion.amount) for action in experiment.actions for portion in action.takes]
    for item, amount in zip(provisioned, amounts, strict=True):
        (well,) = item["to"]
        base = amount.volume if item["measurement_mode"] == "volume" else amount.mass
        assert base is not None
        value, unit = well[item["measurement_mode"]].split(":")
        assert float(value) == pytest.approx(base * amount.portions, rel=1e-5)
        assert unit == {"volume": "milliliter", "mass": "gram"}[item["measurement_mode"]]


def test_each_action_that_autoprotocol_lacks_is_an_instruction_of_its_own() -> None:
    instructions = json.loads(export(SAMPLE, "autoprotocol"))["instructions"]
    ops = [item["op"] for item in instructions]
    assert ops == [
        *("purge", "add", "provision", "make_solution", "heat", "heat", "provision", "extract", "add", "dry_solution"),
        *("provision", "wash", "concentrate", "monitor", "dry_solid", "yield"),
    ]
    assert next(item for item in instructions if item["op"] == "concentrate")["temperature"] == "40:celsius"


@pytest.mark.parametrize(
    "text",
    [
        'Wash {"a": ' + "[" * 9000 + "}",
        "Wash {",
        "Wash {}" * 10_000,
        'Dance {"keep": "organic"}',
        "Wash the layer {twice}",
    ],
)
def test_a_text_that_is_no_remark_is_a_note(text: str) -> None:
    assert read_remark(text) == ("", {}, text)


@pytest.mark.parametrize(
    "remark",
    [
        'Wash {"takes": 7}',
        'Wash {"takes": [{"name": "unheard of"}]}',
        'Wash {"temperature": 1e400}',
        'Wash {"inputs": 1, "materials": {}}',
        'Wash {"note": ["x"]}',
        "Portion {}",
    ],
)
@pytest.mark.parametrize("format", ["ord", "xdl"])
def test_a_hostile_remark_is_one_rejection(remark: str, format: Format, tmp_path: Path) -> None:  # noqa: A002
    if format == "ord":
        pytest.importorskip("google.protobuf")
        component = {"identifiers": [{"type": "NAME", "value": "water"}]}
        inputs = {"1": {"components": [component]}}
        workups = [{"type": "WASH", "details": remark}]
        text = json.dumps({"reactions": [{"reactionId": "a", "inputs": inputs, "workups": workups}]})
    else:
        step = f'<Add reagent="water" volume="1 mL"/><!-- {remark} --><WashSolid solvent="water" volume="1 mL"/>'
        text = f"<Synthesis><Procedure>{step}</Procedure></Synthesis>"
    file = tmp_path / ("x.json" if format == "ord" else "x.xdl")
    file.write_text(text)
    (found,) = read(file, format)
    if "unheard" in remark and format == "xdl":
        assert isinstance(found, Experiment)  # XDL has no other list of materials than those that are used
    else:
        assert isinstance(found, Rejection)
        assert found.reason.isprintable()


def test_the_command_writes_a_file_and_keeps_one_of_other_content(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["protocols", "export", "alk_01", "--format", "xdl", "--out", str(tmp_path)]
    assert main(command) == 0
    file = tmp_path / "protocol_alk_01.xdl"
    assert file.read_text(encoding="utf-8") == export(as_experiment(protocols()["alk_01"]), "xdl")
    assert main(command) == 0
    file.write_text("mine")
    assert main(command) == 2
    assert "--overwrite" in capsys.readouterr().err
    assert main([*command, "--overwrite"]) == 0


def test_the_steps_of_a_protocol_keep_their_conditions_and_each_reagent_is_taken_once() -> None:
    for protocol in protocols().values():
        found = as_experiment(protocol)
        assert [action.temperature for action in found.actions] == [step.temperature for step in protocol.steps]
        assert [action.duration for action in found.actions] == [step.duration for step in protocol.steps]
        taken = [portion.name for action in found.actions for portion in action.takes]
        assert sorted(taken) == sorted(material.name for material in found.materials)
