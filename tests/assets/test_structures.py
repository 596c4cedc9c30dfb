"""Structures from SMILES: spellings of one substance, and input that is none."""

from __future__ import annotations

import sys

import pytest

from labgym.assets.structures import StructureError, canonical, molecule
from labgym.errors import MissingDependencyError

pytest.importorskip("rdkit")


@pytest.mark.parametrize(
    "first, second",
    [
        ("CCO", "OCC"),
        ("c1ccccc1C=O", "O=CC1=CC=CC=C1"),
        ("CO[Na]", "[Na+].C[O-]"),
        ("[Na]Cl", "[Na+].[Cl-]"),
        ("[K]C#N", "[K+].[C-]#N"),
        ("CN(=O)=O", "C[N+](=O)[O-]"),
        ("[CH3:1][OH:2]", "CO"),
        ("CS(=O)C", "C[S+](C)[O-]"),
    ],
)
def test_spellings_of_one_substance_are_the_same(first: str, second: str) -> None:
    assert canonical(first) == canonical(second)


@pytest.mark.parametrize(
    "first, second",
    [("CCO", "CO"), ("C/C=C/C", "C/C=C\\C"), ("CC(=O)O", "CC(=O)[O-].[Na+]"), ("C[C@H](O)F", "C[C@@H](O)F")],
)
def test_different_substances_are_told_apart(first: str, second: str) -> None:
    assert canonical(first) != canonical(second)


@pytest.mark.parametrize("smiles", ["", "CC O", "C1CC", "C" * 501, "C(C)(C)(C)(C)C", "乙醇", "C" * 300, "[Xx]", "C\n"])
def test_what_is_no_smiles_is_refused_in_one_line(smiles: str, capfd: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(StructureError) as error:
        molecule(smiles)
    assert "\n" not in str(error.value)
    assert capfd.readouterr() == ("", "")


def test_rdkit_speaks_again_afterwards(capfd: pytest.CaptureFixture[str]) -> None:
    from rdkit import Chem

    with pytest.raises(StructureError):
        molecule("C1CC")
    Chem.MolFromSmiles("C1CC")
    assert "ring" in capfd.readouterr().err


def test_without_rdkit_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "rdkit", None)
    with pytest.raises(MissingDependencyError, match=r"labgym-nav\[chem\]"):
        canonical("CCCCCCCCCCO")


@pytest.mark.parametrize("smiles", ["*", "C*", "C~C", "[*]CO"])
def test_a_pattern_is_no_substance(smiles: str) -> None:
    with pytest.raises(StructureError, match="pattern"):
        molecule(smiles)


@pytest.mark.parametrize("smiles", ["[2H]O[2H]", "[2H]C(Cl)(Cl)Cl", "[13CH3]I", "CO[Na]", "CN(=O)=O", "[H][H]"])
def test_the_canonical_form_is_its_own_canonical_form(smiles: str) -> None:
    assert canonical(canonical(smiles)) == canonical(smiles)
