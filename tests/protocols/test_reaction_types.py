"""The type of a reaction from its equation: agreement with labelled reactions, and input that is none."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from labgym.cli import main
from labgym.errors import MissingDependencyError
from labgym.protocols import Protocol, protocols
from labgym.protocols.experiments import experiments
from labgym.protocols.experiments.model import ExperimentFile
from labgym.protocols.experiments.reaction_types import typed

pytest.importorskip("rdkit")

# Reactions that are neither in the library nor among the protocols, labelled before the rules were run on them.
TEXTBOOK = [
    ("CCBr.[Na+].[C-]#N>>CCC#N", "substitution"),
    ("CS(=O)(=O)OCCC.[Na+].[I-]>>CCCI", "substitution"),
    ("CC(=O)Cl.CCN>>CC(=O)NCC", "alkylation_acylation"),
    ("c1ccccc1C.CC(=O)Cl>Cl[Al](Cl)Cl>CC(=O)c1ccc(C)cc1", "alkylation_acylation"),
    ("CC(C)=O.C[Mg]Br>>CC(C)(C)O", "alkylation_acylation"),
    ("CCOC(=O)CC(=O)OCC.CCI>[Na+].CC[O-]>CCOC(=O)C(CC)C(=O)OCC", "alkylation_acylation"),
    ("O=Cc1ccccc1.CN>>CN=Cc1ccccc1", "condensation"),
    ("CC(=O)O.CCCO>>CC(=O)OCCC.O", "condensation"),
    ("CC(=O)c1ccccc1.NN>>CC(=NN)c1ccccc1", "condensation"),
    ("CCC=O.CCC=O>>CCC=C(C)C=O.O", "condensation"),
    ("CC(C)=O>[Na+].[BH4-]>CC(C)O", "redox"),
    ("CCO>O=[Cr](=O)=O>CC=O", "redox"),
    ("C=CCC>[H][H].[Pd]>CCCC", "redox"),
    ("O=[N+]([O-])c1ccccc1C>[Fe].Cl>Nc1ccccc1C", "redox"),
    ("CSC>OO>CS(C)=O", "redox"),
    ("C=CC=C.C=CC(C)=O>>CC(=O)C1CCC=CC1", "cyclization"),
    ("OCCCCO>>C1CCOC1.O", "cyclization"),
    ("CCCO.C[Si](C)(C)Cl>>CCCO[Si](C)(C)C", "protection_deprotection"),
    ("CC(C)(C)OC(=O)NCC>>CCN", "protection_deprotection"),
    ("CCC#N.O>>CCC(N)=O", "functional_group_transformation"),
    ("CC=C.BrBr>>CC(Br)CBr", "functional_group_transformation"),
    ("CCCCO>OS(=O)(=O)O>CCC=C.O", "functional_group_transformation"),
    ("CC(=O)OC>[Na+].[OH-].O>CC(=O)O", "functional_group_transformation"),
    ("Brc1ccccc1.OB(O)c1ccc(C)cc1>[Pd]>Cc1ccc(cc1)-c1ccccc1", "functional_group_transformation"),
]


@pytest.mark.parametrize(("reaction", "expected"), TEXTBOOK)
def test_textbook_reactions_have_their_type(reaction: str, expected: str) -> None:
    found = typed(reaction)
    assert found is not None
    assert found.reaction_type == expected
    assert found.why


def test_most_labelled_reactions_are_typed_as_labelled() -> None:
    for labelled, share in ((experiments(), 0.8), (protocols(), 0.9)):
        proposed = [(item.reaction_type, typed(item.reaction)) for item in labelled.values()]
        right = sum(found is not None and found.reaction_type == label for label, found in proposed)
        assert right >= share * len(labelled)


def test_order_spelling_and_spectators_do_not_count() -> None:
    plain = typed("CCBr.[Na+].C[O-]>>CCOC")
    assert plain == typed("C[O-].BrCC.[Na+]>CN(C)C=O>COCC.[Na+].[Br-]") == typed("CCBr.CO[Na].O>>COCC.O")


@pytest.mark.parametrize(
    "reaction",
    ["", ">>", "CCO", "CCO>CC", "CCO>>", ">>CCO", "CCO>>CCO", "CC(>>C", "a>b>c", "C.>" * 50, "C" * 600 + ">>C"],
)
def test_what_is_no_reaction_has_no_type(reaction: str) -> None:
    assert typed(reaction) is None


def test_too_many_molecules_have_no_type() -> None:
    assert typed(".".join(["C"] * 61) + ">>CC") is None


def test_staging_takes_the_type_from_the_equation_and_says_so(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    untyped = experiments()["red_ethylbenzene_styrene"].model_copy(update={"reaction_type": None})
    ExperimentFile(experiments=(untyped,)).save(tmp_path / "imported.json")
    where = ["--path", str(tmp_path / "imported.json"), "--out", str(tmp_path / "out")]
    assert main(["protocols", "stage", untyped.id, *where]) == 0
    assert "reaction type redox" in capsys.readouterr().err
    (made,) = (tmp_path / "out").glob("*.json")
    assert Protocol.load(made).reaction_type == "redox"


def test_without_rdkit_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "rdkit", None)
    with pytest.raises(MissingDependencyError, match=r"labgym-nav\[chem\]"):
        typed("CCCCCCCCCCCCO>>CCCCCCCCCCCC=O")
