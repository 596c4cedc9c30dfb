"""Products that must not be made are refused by structure: in texts, experiments, imports and protocols."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

pytest.importorskip("rdkit")

from labgym.assets import Catalog
from labgym.assets.inference.substructures import pattern
from labgym.assets.structures import molecule
from labgym.protocols import RefusalError, examine, library
from labgym.protocols.experiments import library as experiments
from labgym.protocols.experiments.feasibility import FeasibilityFilter
from labgym.protocols.refusals import refusals, refuse_making, refuse_structure, refuse_to_make

STRUCTURES = json.loads((Path(__file__).parent / "structures.json").read_text(encoding="utf-8"))
CATALOG = Catalog.load()


def test_every_structure_and_pattern_of_the_table_is_valid() -> None:
    for product in refusals().products:
        for smarts in (*product.smarts, *product.several, *product.small, *product.without):
            pattern(smarts)
        for smiles in product.smiles:
            molecule(smiles)
    for making in refusals().makings:
        for smarts in (*making.a, *making.b, *making.c):
            pattern(smarts)


@pytest.mark.parametrize("smiles", STRUCTURES["dangerous"])
def test_a_dangerous_structure_is_refused(smiles: str) -> None:
    with pytest.raises(RefusalError, match="no protocol makes") as refusal:
        refuse_structure(smiles)
    assert refusal.value.reason == "unsafe"


@pytest.mark.parametrize("smiles", STRUCTURES["harmless"])
def test_an_ordinary_structure_is_not_refused(smiles: str) -> None:
    refuse_structure(smiles)


@pytest.mark.parametrize("product", ["tert-butyl hydroperoxide", "CC(C)(C)OO", "2,4,6-trinitrotoluеne", "phenyl azide"])
def test_a_protocol_of_a_dangerous_product_has_a_fault(product: str) -> None:
    protocol = library.get("red_01").model_copy(update={"product": product})
    findings = [finding for finding in examine(protocol, CATALOG) if finding.rule == "dangerous-product"]
    assert [finding.severity for finding in findings] == ["fault"]


@pytest.mark.parametrize(
    "update", [{"product": "methyl azide"}, {"reaction": "CC(C)(C)O.OO>>CC(C)(C)OO", "product": ""}]
)
def test_an_experiment_of_a_dangerous_product_is_infeasible(update: dict[str, str]) -> None:
    experiment = experiments.get("red_cyclohexanol_nabh4").model_copy(update=update)
    obstacles = FeasibilityFilter(CATALOG).judge(experiment).obstacles
    assert [obstacle.code for obstacle in obstacles if "no protocol" in obstacle.message] == ["unsafe"]


def test_no_experiment_or_protocol_of_the_library_makes_a_dangerous_product() -> None:
    for experiment in experiments.of_type(None):
        refuse_to_make(experiment.name, experiment.product, experiment.reaction.rpartition(">")[2].split("."))
    for protocol in library.protocols().values():
        refuse_to_make(protocol.name, protocol.product)


@pytest.mark.parametrize(
    "smiles",
    [
        ("CN(CCO)CCO", "O=S(Cl)Cl"),
        ("CC(C)OP(=O)(Cl)OC(C)C", "[K+].[F-]"),
        ("OCC(CO)(CO)CO", "[K+].[O-][N+](=O)[O-]", "OS(=O)(=O)O"),
        ("C1N2CN3CN1CN(C2)C3", "OO"),
        ("NCCc1c[nH]c2ccccc12", "C=O"),
        ("[Na+].[N-]=[N+]=[N-]", "[Pb+2].[O-][N+](=O)[O-].[O-][N+](=O)[O-]"),
    ],
)
def test_substances_that_make_a_dangerous_product_are_refused_whatever_it_is_called(smiles: tuple[str, ...]) -> None:
    present = dict(zip("abc", smiles, strict=False))
    with pytest.raises(RefusalError, match="make"):
        refuse_making(present)
    for name in present:
        refuse_making({key: value for key, value in present.items() if key != name})


@pytest.mark.parametrize("smiles", ["OCCSCCO", "CP(=O)(Cl)Cl", "CC(=O)Cc1ccccc1", "c1ccccc1CCN1CCC(CC1)Nc1ccccc1"])
def test_a_precursor_of_a_weapon_or_drug_is_refused(smiles: str) -> None:
    with pytest.raises(RefusalError, match="a precursor of"):
        refuse_structure(smiles)


def test_ordinary_pairs_of_substances_make_nothing_dangerous() -> None:
    refuse_making({"a": "OCCO", "b": "O=S(Cl)Cl", "c": "CCN(CC)CC"})
    refuse_making({"a": "OO", "b": "CC(C)=O"})
