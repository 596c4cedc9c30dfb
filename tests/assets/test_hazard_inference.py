"""Grave hazards by structure: GHS statements of public classifications against the flags that are inferred.

`ghs_hazards.csv` has the statements of CLP Annex VI, and of suppliers where the annex has no entry. Every second row
was held back while the rules were written, as were the last 48.
"""

from __future__ import annotations

import csv
from pathlib import Path

import pytest
from every_case import for_each

from labgym.assets.inference import ProhibitedSubstanceError, classify, infer
from labgym.cli import main

pytest.importorskip("rdkit.Chem")

with (Path(__file__).parent / "ghs_hazards.csv").open(encoding="utf-8") as text:
    ROWS = [(row["name"], row["smiles"], row["state"], row["statements"].split()) for row in csv.DictReader(text)]

STATEMENTS = {
    "pyrophoric": ("H232", "H250"),
    "explosive": ("H200", "H201", "H202", "H203", "H204", "H205", "H240", "H241"),
    "flammable": ("H220", "H221", "H224", "H225", "H226", "H228", "H232", "H250", "H251", "H252", "H260"),
    "oxidizer": ("H270", "H271", "H272"),
    "water_reactive": ("H260", "H261", "EUH014"),
    "volatile_or_toxic": ("H300", "H301", "H310", "H311", "H330", "H331", "H340", "H350", "H360"),
}
LIQUID_AT_ROOM_TEMPERATURE_BUT_TAKEN_FOR_A_SOLID = {"nitroglycerin"}
rows = for_each(("name", "smiles", "state", "statements"), ROWS)


@rows
def test_what_ghs_states_is_inferred(name: str, smiles: str, state: str, statements: list[str]) -> None:
    inference = classify(smiles)
    stated = {flag for flag, codes in STATEMENTS.items() if any(code.startswith(codes) for code in statements)}
    assert stated <= inference.flags.keys()
    exact = {"pyrophoric", "explosive", *(["flammable"] if state == "gas" else [])}
    assert exact & inference.flags.keys() <= stated
    if name not in LIQUID_AT_ROOM_TEMPERATURE_BUT_TAKEN_FOR_A_SOLID:
        assert not state or inference.state == state


@rows
def test_grave_hazards_have_a_storage_class(name: str, smiles: str, state: str, statements: list[str]) -> None:
    inference = classify(smiles)
    grave = {"pyrophoric", "explosive", "flammable", "volatile_or_toxic", "oxidizer", "water_reactive"}
    assert inference.storage_class != "General" or not grave & inference.flags.keys()
    if inference.state == "gas":
        assert inference.storage_class == "Gas"
    if "explosive" in inference.flags:
        assert "may explode" in inference.storage_reason
    if "pyrophoric" in inference.flags:
        assert "in air" in inference.storage_reason


def test_an_inferred_reagent_carries_the_flag() -> None:
    assert infer("CC(C)(C)[Li]", "tert-butyllithium").chemistry.pyrophoric
    assert not infer("CCO", "ethanol").chemistry.pyrophoric
    assert classify("P12P3P1P23").storage_class == "Flammable"


@pytest.mark.parametrize(("smiles", "group"), [("C1CO1", "epoxide"), ("CC1CS1", "epoxide"), ("C1CN1", "epoxide")])
def test_strained_rings_are_no_ethers(smiles: str, group: str) -> None:
    assert group in classify(smiles).groups
    assert "ether" not in classify(smiles).groups


WEAPONS = {
    "sarin": "CC(C)OP(C)(=O)F",
    "soman": "CC(OP(C)(=O)F)C(C)(C)C",
    "tabun": "CCOP(=O)(C#N)N(C)C",
    "cyclosarin": "CP(=O)(F)OC1CCCCC1",
    "ethyl analogue of sarin": "CCP(=O)(F)OC(C)C",
    "thiono analogue of sarin": "CC(C)OP(C)(=S)F",
    "diisopropyl fluorophosphate": "CC(C)OP(=O)(F)OC(C)C",
    "methylphosphonyl difluoride": "CP(=O)(F)F",
    "chlorosarin": "CC(C)OP(C)(=O)Cl",
    "VX": "CCOP(C)(=O)SCCN(C(C)C)C(C)C",
    "VX, drawn with charges": "CCO[P+](C)([O-])SCCN(C(C)C)C(C)C",
    "salt of VX": "CCOP(C)(=O)SCC[NH+](C(C)C)C(C)C.[Cl-]",
    "Russian VX": "CC(C)COP(C)(=O)SCCN(CC)CC",
    "amiton": "CCOP(=O)(OCC)SCCN(CC)CC",
    "QL": "CCOP(C)OCCN(C(C)C)C(C)C",
    "EA-2192": "CP(=O)(O)SCCN(C(C)C)C(C)C",
    "A-230": "CP(=O)(F)N=C(C)N(CC)CC",
    "A-234": "CCOP(=O)(F)N=C(C)N(CC)CC",
    "sulfur mustard": "ClCCSCCCl",
    "bromine analogue of mustard": "BrCCSCCBr",
    "2-chloroethyl chloromethyl sulfide": "ClCSCCCl",
    "sesquimustard": "ClCCSCCSCCCl",
    "O-mustard": "ClCCSCCOCCSCCCl",
    "HN1": "CCN(CCCl)CCCl",
    "HN2 hydrochloride": "CN(CCCl)CCCl.Cl",
    "HN3": "ClCCN(CCCl)CCCl",
    "lewisite": "Cl/C=C/[As](Cl)Cl",
    "lewisite 2": "ClC=C[As](Cl)C=CCl",
}
"""Substances of schedule 1 of the Chemical Weapons Convention, and relatives that act alike."""
ORDINARY = {
    "dimethyl methylphosphonate": "COP(C)(=O)OC",
    "diethyl cyanophosphonate": "CCOP(=O)(C#N)OCC",
    "diethyl chlorophosphate": "CCOP(=O)(Cl)OCC",
    "malathion": "CCOC(=O)CC(SP(=S)(OC)OC)C(=O)OCC",
    "glyphosate": "OC(=O)CNCP(O)(O)=O",
    "potassium hexafluorophosphate": "[K+].F[P-](F)(F)(F)(F)F",
    "sodium fluorophosphate": "[Na+].[Na+].[O-]P(=O)([O-])F",
    "PMSF": "O=S(=O)(F)Cc1ccccc1",
    "BOP-Cl": "O=C1OCCN1P(=O)(Cl)N1CCOC1=O",
    "pyridostigmine": "CN(C)C(=O)Oc1ccc[n+](C)c1",
    "thiodiglycol": "OCCSCCO",
    "2-chloroethyl ether": "ClCCOCCCl",
    "2-chloroethylamine": "NCCCl",
    "hexamethylphosphoramide": "CN(C)P(=O)(N(C)C)N(C)C",
}


@pytest.mark.parametrize("name", WEAPONS)
def test_chemical_weapons_are_refused_in_one_line(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(ProhibitedSubstanceError, match="chemical weapons"):
        classify(WEAPONS[name])
    assert main(["assets", "infer", WEAPONS[name]]) == 2
    told = capsys.readouterr()
    assert told.out == ""
    assert told.err.count("\n") == 1


@pytest.mark.parametrize("name", ORDINARY)
def test_relatives_of_weapons_that_are_ordinary_reagents_are_classified(name: str) -> None:
    assert classify(ORDINARY[name]).formula


def test_a_weapon_is_not_compared_with_other_reagents(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["assets", "compat", "CC(C)OP(C)(=O)F", "water"]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_the_command_lists_pyrophoric_among_the_hazards(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["assets", "NButyllithium"]) == 0
    line = next(line for line in capsys.readouterr().out.splitlines() if line.startswith("hazards"))
    assert "pyrophoric" in line
    assert "water reactive" in line
