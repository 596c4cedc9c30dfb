"""The feasibility filter: each kind of obstacle, what it says, and what it writes."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import pytest

from labgym.assets import Catalog
from labgym.errors import DocumentError, OptionError
from labgym.protocols.amounts import read_amount
from labgym.protocols.experiments import Experiment, ExperimentFile, Material, Rejection, read_experiments
from labgym.protocols.experiments.checks import check, disagreement
from labgym.protocols.experiments.collection import PER_FILE, REJECTED, collect, filtered
from labgym.protocols.experiments.feasibility import FeasibilityFilter, FeasibilityVerdict, reasons
from labgym.protocols.experiments.grounding import Grounder
from labgym.protocols.experiments.narration import narrate
from labgym.protocols.importers import read


def esterification(**changes: Any) -> Experiment:
    """An experiment that the published catalogue can do, with changes."""
    data: dict[str, Any] = {
        "id": "x_1",
        "name": "Methyl benzoate",
        "reaction_type": "condensation",
        "reaction": "O=C(O)c1ccccc1.CO>OS(=O)(=O)O>COC(=O)c1ccccc1.O",
        "product": "methyl benzoate",
        "materials": [
            {"name": "BenzoicAcid", "role": "reactant"},
            {"name": "Methanol", "role": "solvent"},
            {"name": "SulfuricAcid", "role": "catalyst"},
        ],
        "actions": [
            {
                "verb": "Add",
                "takes": [{"name": "BenzoicAcid", "amount": "6.1 g, 50 mmol"}, {"name": "Methanol", "amount": "30 mL"}],
            },
            {"verb": "Add", "takes": [{"name": "SulfuricAcid", "amount": "1 mL"}], "manner": "dropwise"},
            {"verb": "Reflux", "temperature": 65, "duration": 120},
            {"verb": "Yield"},
        ],
    }
    return Experiment.model_validate({**data, **changes})


def obstacles(experiment: Experiment, catalog: Catalog | None = None) -> list[tuple[str, int | None]]:
    verdict = FeasibilityFilter(catalog or Catalog.published()).judge(experiment)
    return [(obstacle.code, obstacle.action) for obstacle in verdict.obstacles]


def with_action(action: dict[str, Any], *materials: dict[str, str]) -> Experiment:
    plain = esterification().model_dump()
    return esterification(
        actions=[*plain["actions"][:-1], action, {"verb": "Yield"}], materials=[*plain["materials"], *materials]
    )


def test_what_the_catalogue_can_do_passes() -> None:
    assert obstacles(esterification()) == []


def test_names_as_people_write_them_become_the_names_of_assets() -> None:
    written = esterification(
        materials=[
            {"name": "benzoic acid", "role": "reactant"},
            {"name": "MeOH", "role": "solvent"},
            {"name": "H2SO4", "role": "catalyst"},
        ],
        actions=[
            {"verb": "Add", "takes": [{"name": "benzoic acid"}, {"name": "MeOH", "amount": "30 mL"}]},
            {"verb": "Add", "takes": [{"name": "H2SO4"}]},
            {"verb": "Reflux"},
            {"verb": "Yield"},
        ],
    )
    verdict = FeasibilityFilter(Catalog.published()).judge(written)
    assert verdict.feasible
    assert [material.name for material in verdict.experiment.materials] == ["BenzoicAcid", "Methanol", "SulfuricAcid"]
    assert [p.name for action in verdict.experiment.actions for p in action.takes] == [
        "BenzoicAcid",
        "Methanol",
        "SulfuricAcid",
    ]


@pytest.mark.parametrize(
    "action, expected",
    [
        ({"verb": "Heat", "temperature": 900}, [("temperature", 4)]),
        ({"verb": "Cool", "temperature": -120}, [("temperature", 4)]),
        ({"verb": "DrySolid", "temperature": 110}, []),
        ({"verb": "Sublime"}, [("equipment", 4)]),
        ({"verb": "Hydrogenate", "pressure": 3.0}, []),
        ({"verb": "Hydrogenate", "pressure": 200.0}, [("pressure", 4)]),
    ],
)
def test_conditions_beyond_the_equipment_are_named_with_their_action(
    action: dict[str, Any], expected: list[tuple[str, int]]
) -> None:
    assert obstacles(with_action(action)) == expected


def test_a_material_that_the_catalogue_lacks_is_named_with_what_is_nearest() -> None:
    extra = {"name": "benzyl chloride", "role": "reactant"}
    verdict = FeasibilityFilter(Catalog.published()).judge(
        with_action({"verb": "Add", "takes": [{"name": "benzyl chloride"}]}, extra)
    )
    assert [obstacle.code for obstacle in verdict.obstacles] == ["unlisted"]
    assert "benzyl chloride" in verdict.obstacles[0].message
    assert "nearest" in verdict.obstacles[0].message


def test_a_known_name_with_the_structure_of_something_else_is_not_taken_for_it() -> None:
    pytest.importorskip("rdkit")
    wrong = with_action(
        {"verb": "Add", "takes": [{"name": "Acetone"}]}, {"name": "Acetone", "role": "reactant", "smiles": "CCCCCC#CC"}
    )
    assert obstacles(wrong) == [("unlisted", None)]


def test_a_structure_is_found_however_it_is_drawn() -> None:
    pytest.importorskip("rdkit")
    drawn = with_action(
        {"verb": "Add", "takes": [{"name": "compound 7"}]},
        {"name": "compound 7", "role": "reactant", "smiles": "C(c1ccccc1)=O"},
    )
    verdict = FeasibilityFilter(Catalog.published()).judge(drawn)
    assert verdict.feasible
    assert verdict.experiment.materials[-1].name == "Benzaldehyde"


@pytest.mark.parametrize(
    "amount, code", [("90 kg", "mass"), ("0.1 mg", "mass"), ("20 L", "volume"), ("2 x 12 L", "volume"), ("1 L", None)]
)
def test_a_batch_must_fit_balances_and_flasks(amount: str, code: str | None) -> None:
    plain = esterification().model_dump()
    plain["actions"][0]["takes"][1]["amount"] = amount
    found = {kind for kind, _ in obstacles(esterification(actions=plain["actions"]))}
    assert found >= ({code} if code else set())
    assert bool(found) == bool(code)


def test_solvent_of_the_work_up_does_not_count_as_in_the_reaction_flask() -> None:
    extracted = with_action(
        {"verb": "Extract", "takes": [{"name": "Toluene", "amount": "4 x 900 mL"}]},
        {"name": "Toluene", "role": "workup"},
    )
    assert obstacles(extracted) == []


def test_without_its_apparatus_an_action_is_infeasible() -> None:
    reduced = Catalog([asset for asset in Catalog.published() if asset.name != "RefluxCondenser"])
    assert obstacles(esterification(), reduced) == [("equipment", 3)]


def test_reagents_that_must_not_meet_are_refused() -> None:
    mixed = with_action(
        {"verb": "Add", "takes": [{"name": "SodiumAzide", "amount": "1 g"}]}, {"name": "SodiumAzide", "role": "reagent"}
    )
    verdict = FeasibilityFilter(Catalog.published()).judge(mixed)
    assert [obstacle.code for obstacle in verdict.obstacles] == ["unsafe"]
    assert "hydrazoic acid" in verdict.obstacles[0].message


def test_a_dangerous_product_is_refused_by_name() -> None:
    assert ("unsafe", None) in obstacles(esterification(name="Nitroglycerin"))


def test_reasons_are_counted_once_an_experiment() -> None:
    feasibility = FeasibilityFilter(Catalog.published())
    verdicts = [feasibility.judge(esterification()), feasibility.judge(with_action({"verb": "Sublime"}))]
    assert reasons(verdicts) == {"equipment": 1}


def test_a_collection_holds_what_is_feasible_and_lists_the_rest_with_reasons(tmp_path: Path) -> None:
    records = [
        esterification(),
        Rejection("train.json:7", "no actions"),
        esterification(),
        esterification(id="x_2", name="TNT"),
        esterification(id="x_3"),
    ]
    tally = collect(filtered(records, FeasibilityFilter(Catalog.published())), tmp_path)
    assert (tally.accepted, tally.rejected) == (2, 3)
    assert [experiment.id for experiment in read_experiments(tmp_path)] == ["x_1", "x_3"]
    with (tmp_path / REJECTED).open(newline="", encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    assert [(row["record"], row["kind"]) for row in rows] == [
        ("train.json:7", "unreadable"),
        ("x_1", "repeated"),
        ("x_2", "unsafe"),
    ]


def test_a_large_collection_is_cut_into_files_in_order(tmp_path: Path) -> None:
    collect((esterification(id=f"x_{k:05d}") for k in range(PER_FILE + 3)), tmp_path)
    files = sorted(tmp_path.glob("experiments-*.json"))
    assert [len(ExperimentFile.load(file).experiments) for file in files] == [PER_FILE, 3]
    assert [e.id for e in read_experiments(tmp_path)] == [f"x_{k:05d}" for k in range(PER_FILE + 3)]


def test_an_earlier_collection_is_kept_unless_it_is_to_be_replaced(tmp_path: Path) -> None:
    collect([esterification()], tmp_path)
    with pytest.raises(OptionError, match="--overwrite"):
        collect([esterification(id="other")], tmp_path)
    assert [e.id for e in read_experiments(tmp_path)] == ["x_1"]
    collect([esterification(id="other")], tmp_path, replace=True)
    assert [e.id for e in read_experiments(tmp_path)] == ["other"]


@pytest.mark.parametrize(
    "reagent, amount, agrees",
    [
        ("Benzaldehyde", "5.3 g (5.1 mL), 50 mmol", True),
        ("Benzaldehyde", "5.3 g, 60 mmol", False),
        ("Acetone", "2.9 g (2.7 mL), 50 mmol", False),
        ("Acetone", "3.7 mL, 50 mmol", True),
        ("Acetone", "3.7 mL, 70 mmol", False),
        ("HydrochloricAcid", "10 mL of 2 M, 20 mmol", True),
        ("HydrochloricAcid", "10 mL of 2 M, 30 mmol", False),
        ("SodiumHydroxide", "30 mL of 10 % aq.", True),
        ("Ethanol", "3 x 30 mL", True),
    ],
)
def test_parts_of_an_amount_are_held_against_each_other(reagent: str, amount: str, agrees: bool) -> None:
    assert (disagreement(Catalog.published().get(reagent), amount) is None) == agrees


def test_an_incomplete_entry_is_told_what_it_lacks() -> None:
    told = " ".join(check(esterification(reaction="", synonyms=["methyl ester"], reaction_type=None)))
    for word in ("reaction type", "Chinese", "reactants>agents>products", "analysis"):
        assert word in told


def test_an_action_may_take_only_what_is_listed(tmp_path: Path) -> None:
    data = {"schema": ExperimentFile.SCHEMA, "experiments": [esterification().model_dump(mode="json")]}
    data["experiments"][0]["actions"][0]["takes"][0]["name"] = "Unlisted"
    with pytest.raises(DocumentError, match="'Unlisted', which is not among the materials"):
        ExperimentFile.parse(data, tmp_path)


def test_actions_read_as_sentences() -> None:
    told = narrate(esterification(), Catalog.published())
    assert told.startswith("Add benzoic acid (6.1 g, 50 mmol) and ")
    assert "dropwise" in told
    assert "Reflux at 65 C for 120 min." in told


def test_a_replacement_that_fails_leaves_what_was_there(tmp_path: Path) -> None:
    collect([esterification()], tmp_path)

    def broken() -> Any:
        yield esterification(id="x_9")
        raise DocumentError("file", "", "cut off")

    with pytest.raises(DocumentError):
        collect(broken(), tmp_path, replace=True)
    assert [e.id for e in read_experiments(tmp_path)] == ["x_1"]
    assert sorted(file.name for file in tmp_path.iterdir()) == [".lock", "experiments-00000.json", REJECTED]


@pytest.mark.parametrize(
    "text, millilitres", [("1,200 mL", 1200.0), ("1,5 mL", 1.5), ("0,125 L", 125.0), ("12,000 mL", 12000.0)]
)
def test_a_comma_parts_thousands_or_decimals(text: str, millilitres: float) -> None:
    assert read_amount(text).volume == millilitres


def test_a_hydride_in_a_protic_solvent_is_refused_whatever_role_the_solvent_is_given() -> None:
    mixed = with_action(
        {"verb": "Add", "takes": [{"name": "LithiumAluminumHydride", "amount": "1 g"}]},
        {"name": "LithiumAluminumHydride", "role": "reagent"},
    )
    data = mixed.model_dump()
    for material in data["materials"]:
        material["role"] = "reagent"
    assert "unsafe" in {code for code, _ in obstacles(Experiment.model_validate(data))}


@pytest.mark.parametrize(
    "name, asset",
    [
        ("water1", "DeionizedWater"),
        ("water_2", "DeionizedWater"),
        ("t-butyldimethylsilyl chloride(TBDMSCl)", "TertButyldimethylsilylChloride"),
        ("sodium iodide acetonitrile solution", "SodiumIodide"),
        ("sodium iodide in acetonitrile", "SodiumIodide"),
        ("sodium hydroxide(NaOH) (12.0 g , 0.30 mol in 12 mL of H2O) water solution", "SodiumHydroxide"),
        ("solution of iodine in ethanol", "Iodine"),
        ("half-saturated aqueous sodium acetate", "SodiumAcetate"),
        ("H2O2", "HydrogenPeroxide"),
        ("CO2", None),
        ("SO3", None),
        ("10 % methanol ethyl acetate solution", None),
        ("unobtainium in water", None),
        ("water in ethanol", None),
    ],
)
def test_names_of_machine_files_mean_their_reagent_or_nothing(name: str, asset: str | None) -> None:
    assert Grounder(Catalog.published()).find(Material(name=name, role="reagent")) == asset


@pytest.mark.parametrize("name", ["ethyl (triphenylphosphoranylidene)acetate", "ethyl (2-naphthyloxy) acetate"])
def test_a_substituent_in_brackets_is_no_remark(name: str) -> None:
    assert Grounder(Catalog.published()).find(Material(name=name, role="reagent")) is None


def test_an_xdl_file_without_a_product_is_kept_once_it_is_named(tmp_path: Path) -> None:
    file = tmp_path / "ester.xdl"
    file.write_text(
        """<XDL><Synthesis><Reagents><Reagent name="benzoic acid"/><Reagent name="methanol"/></Reagents><Procedure>
        <Add vessel="r" reagent="benzoic acid" mass="6.1 g"/><Add vessel="r" reagent="methanol" volume="30 mL"/>
        <Add vessel="r" reagent="water1" volume="5 mL"/><HeatChill vessel="r" temp="60 C" time="2 h"/>
        </Procedure></Synthesis></XDL>""",
        encoding="utf-8",
    )
    feasibility = FeasibilityFilter(Catalog.published())
    (unnamed,) = filtered(read(file, "xdl"), feasibility)
    (named,) = filtered(read(file, "xdl", product="methyl benzoate"), feasibility)
    assert isinstance(unnamed, FeasibilityVerdict)
    assert isinstance(named, FeasibilityVerdict)
    assert [obstacle.code for obstacle in unnamed.obstacles] == ["incomplete"]
    assert "product" in unnamed.obstacles[0].message
    assert named.feasible


def test_an_amount_in_an_unknown_unit_stands_against_an_experiment() -> None:
    data = esterification().model_dump()
    data["actions"][1]["takes"][0]["amount"] = "3 spoons"
    verdict = FeasibilityFilter(Catalog.published()).judge(Experiment.model_validate(data))
    assert [(obstacle.code, obstacle.action) for obstacle in verdict.obstacles] == [("amount", 2)]
    assert "'3 spoons'" in verdict.obstacles[0].message
