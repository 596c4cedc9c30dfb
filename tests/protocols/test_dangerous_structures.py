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
from labgym.protocols.refusals import refusals, refuse_structure, refuse_to_make

STRUCTURES = json.loads((Path(__file__).parent / "structures.json").read_text(encoding="utf-8"))
CATALOG = Catalog.load()


def test_every_structure_and_pattern_of_the_table_is_valid() -> None:
    for product in refusals().products:
        for smarts in (*product.smarts, *product.several, *product.small, *product.without):
            pattern(smarts)
        for smiles in product.smiles:
            molecule(smiles)


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
