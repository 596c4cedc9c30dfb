"""A wish in one line becomes a protocol by a general procedure; what it says is used, reported or refused."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest.importorskip("rdkit")
pytest.importorskip("chemicals")

from labgym.assets import Catalog
from labgym.assets.structures import canonical
from labgym.cli import main
from labgym.errors import LabgymError
from labgym.protocols import Protocol, RefusalError
from labgym.protocols.experiments.model import Material
from labgym.protocols.substances import Resolver
from labgym.protocols.synthesis.equations import backward, balanced, forward
from labgym.protocols.synthesis.general_procedures import ANY, GeneralProcedure, general_procedures
from labgym.protocols.synthesis.wishes import fulfill

NAMES = Resolver(Catalog.published(), parser=False)
TABLE = general_procedures()
PRODUCTS = [
    ("Couple benzoic acid with benzylamine using EDC and HOBt", "O=C(NCc1ccccc1)c1ccccc1"),
    ("Acid chloride formation from benzoic acid with thionyl chloride", "O=C(Cl)c1ccccc1"),
    ("Suzuki coupling of bromobenzene with phenylboronic acid", "c1ccc(-c2ccccc2)cc1"),
    ("Wittig olefination of cyclohexanone with methyltriphenylphosphonium bromide", "C=C1CCCCC1"),
    ("Reduction of acetophenone using sodium borohydride", "CC(O)c1ccccc1"),
    ("Boc deprotection of N-Boc-piperazine using HCl in dioxane", "C1CNCCN1"),
    ("Reductive amination of benzaldehyde with piperidine", "c1ccc(CN2CCCCC2)cc1"),
    ("Alkylation of phenol with benzyl bromide and potassium carbonate in acetone", "c1ccc(COc2ccccc2)cc1"),
    ("Swern oxidation of cyclohexanol", "O=C1CCCCC1"),
    ("Arbuzov reaction of benzyl bromide with triethyl phosphite", "CCOP(=O)(OCC)Cc1ccccc1"),
    ("Condensation of o-phenylenediamine with benzil", "c1ccccc1-c1nc2ccccc2nc1-c1ccccc1"),
    ("Condensation of phthalic anhydride with aniline", "O=C1N(c2ccccc2)C(=O)c2ccccc12"),
    ("Acylation of aniline with benzyl chloroformate", "O=C(OCc1ccccc1)Nc1ccccc1"),
    ("Wolff-Kishner reduction of acetophenone with hydrazine hydrate", "CCc1ccccc1"),
    ("Claisen rearrangement of allyl phenyl ether", "C=CCc1ccccc1O"),
    ("Hydrogenation of benzonitrile over Raney nickel", "NCc1ccccc1"),
    ("Oxidation of diphenyl sulfide to diphenyl sulfone with mCPBA", "O=S(=O)(c1ccccc1)c1ccccc1"),
    ("Chemoselective reduction of 4-nitroacetophenone using sodium borohydride", "CC(O)c1ccc(cc1)[N+](=O)[O-]"),
]
"""Wishes of named substances with the structure that a chemist expects, drawn by hand."""


@pytest.mark.parametrize(("text", "product"), PRODUCTS)
def test_the_product_is_what_the_reaction_gives(text: str, product: str) -> None:
    protocol = fulfill(text, names=NAMES).protocol
    assert canonical(protocol.reaction.rpartition(">")[2]) == canonical(product)
    assert protocol.partial == ()


def test_a_class_without_a_name_becomes_an_unclassified_bottle_that_the_protocol_marks() -> None:
    protocol = fulfill(
        "Conversion of the carboxylic acid to the acid chloride using oxalyl chloride", names=NAMES
    ).protocol
    (bottle,) = protocol.substances
    assert bottle.names == ("unnamed carboxylic acid",)
    assert (bottle.is_classified, bottle.storage_class) == (False, "Toxic")
    assert any("unnamed carboxylic acid" in line for line in protocol.partial)
    assert "OxalylChloride" in {use.name for use in protocol.reagents}


def test_the_substrate_follows_from_the_name_of_the_product() -> None:
    text = "Preparation of benzoyl chloride: Reaction of the carboxylic acid with thionyl chloride."
    done = fulfill(text, names=NAMES)
    assert done.protocol.reaction == f"{canonical('OC(=O)c1ccccc1')}>>{canonical('O=C(Cl)c1ccccc1')}"
    assert any("follows from the product, assumed" in note for note in done.notes)


def test_what_the_wish_leaves_open_is_named_as_assumed() -> None:
    notes = fulfill("Mesylation of cyclohexanol", names=NAMES).notes
    for what in ("amounts", "methanesulfonyl chloride", "triethylamine", "dichloromethane"):
        assert any(what in note and "assumed" in note for note in notes)


@pytest.mark.parametrize(
    ("text", "amounts"),
    [
        # 1.0 g / 120.15 g/mol = 8.32 mmol; 8.32 mmol x 37.83 g/mol = 0.315 g
        ("Reduce 1.0 g acetophenone with NaBH4", {"Acetophenone": "1.0 g, 8.32 mmol", "SodiumBorohydride": "0.315 g"}),
        (
            "Reduce acetophenone (2.4 g, 20 mmol) with sodium borohydride (0.8 g) in methanol (40 mL)",
            {"Acetophenone": "2.4 g, 20 mmol", "SodiumBorohydride": "0.8 g", "Methanol": "40 mL"},
        ),
        (
            "Couple 5 mmol of benzoic acid with benzylamine (1.2 equiv) using EDC",
            {"BenzoicAcid": "0.611 g, 5 mmol", "Benzylamine": "0.643 g, 6 mmol"},
        ),
    ],
)
def test_amounts_of_a_wish_are_kept_and_all_else_is_scaled_to_them(text: str, amounts: dict[str, str]) -> None:
    uses = {use.name: use.amount for use in fulfill(text, names=NAMES).protocol.reagents}
    assert {name: uses[name][: len(amount)] for name, amount in amounts.items()} == amounts


def test_conditions_of_a_wish_replace_those_of_the_procedure() -> None:
    text = "Alkylation of 2 g phenol with benzyl bromide and potassium carbonate in acetone"
    usual, changed = (fulfill(wish, names=NAMES).protocol for wish in (text, f"{text} at 40 °C for 7 h"))
    held = [step for step in changed.steps if step.duration == 420.0]
    assert [step.temperature for step in held] == [40.0]
    assert not [step for step in usual.steps if step.duration == 420.0]


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("Reduce acetophenone (5 blorps) with NaBH4", "5 blorps"),
        ("Reduce acetophenone (0 g) with NaBH4", "above 0"),
        ("Reduce acetophenone (-5 g) with NaBH4", "above 0"),
        ("Reduce acetophenone with NaBH4 at 0 C, then at 25 C", "one temperature"),
        ("Reduce acetophenone with NaBH4 (1 g, 2 mmol)(3 g)", "belongs to no substance"),
    ],
)
def test_an_amount_that_cannot_be_kept_is_refused(text: str, reason: str) -> None:
    with pytest.raises(RefusalError, match=reason):
        fulfill(text, partial=True, names=NAMES)


def test_a_reaction_without_a_procedure_needs_a_balanced_equation() -> None:
    acetoacetate, acetaldehyde = "CC(=O)CC(=O)OCC", "CC=O"
    # 2 C6H10O3 + C2H4O = C11H16O3 + CO2 + C2H6O + H2O
    losses = ["O", "CCO", "O=C=O"]
    assert balanced([acetoacetate, acetaldehyde], "CCOC(=O)C1C(C)CC(=O)C=C1C", losses) == (2, 1)
    assert balanced([acetoacetate, acetaldehyde], "CCOC(=O)C1C(C)CC(=O)C=C1CC", losses) == ()


def test_a_reaction_without_a_procedure_is_partial_and_never_violent() -> None:
    text = "Synthesis of ethyl 2-cyano-3-(dimethylamino)acrylate: Reaction of ethyl cyanoacetate with {}."
    done = fulfill(text.format("N,N-dimethylformamide dimethyl acetal"), names=NAMES).protocol
    assert "no general procedure covers" not in " ".join(done.partial)
    product = "Synthesis of CC(=O)C=C(C)Nc1ccccc1: Reaction of CC(=O)CC(C)=O with aniline."
    made = fulfill(product, names=NAMES).protocol
    assert any("no general procedure covers" in line for line in made.partial)
    with pytest.raises(RefusalError):
        fulfill("Synthesis of CC(=O)OOC(C)=O: Reaction of acetic anhydride with hydrogen peroxide.", names=NAMES)


@pytest.mark.parametrize(
    ("text", "substrate"),
    [
        ("Mesylate cyclohexanol with MsCl", "Cyclohexanol"),
        ("Grignard reaction: Addition of methylmagnesium bromide to benzaldehyde", "Benzaldehyde"),
        ("Cleavage of 2-methoxynaphthalene: Cleavage of the methyl ether with boron tribromide", "2Methoxynaphthalene"),
    ],
)
def test_the_substrate_is_what_the_grammar_says(text: str, substrate: str) -> None:
    assert any(use.name.endswith(substrate) for use in fulfill(text, names=NAMES).protocol.reagents)


def test_a_solvent_that_is_also_a_reagent_is_the_only_solvent() -> None:
    protocol = fulfill("Tosylation of benzyl alcohol with tosyl chloride in pyridine", names=NAMES).protocol
    uses = {use.name: use.amount for use in protocol.reagents}
    assert "40 mL" in uses["Pyridine"]
    assert "Dichloromethane" not in uses


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("Oxidation of a protected amino alcohol to the aldehyde with Dess-Martin periodinane", "protected amino"),
        ("Conversion of a hydroxymethyl thiazole to the aldehyde using manganese dioxide", "hydroxymethyl thiazole"),
        ("N-Methylation of an oxindole derivative with iodomethane and sodium hydride", "oxindole"),
        ("Fmoc-protected amino ester: Fmoc removal using piperidine", "amino ester"),
        ("EDC-mediated coupling of a thiophene carboxylic acid with a substituted aniline", "substituted aniline"),
    ],
)
def test_parts_of_a_name_say_its_class(text: str, words: str) -> None:
    assert any(words in line for line in fulfill(text, names=NAMES).protocol.partial)


def test_a_word_without_effect_stops_the_protocol_or_marks_it() -> None:
    text = "Regioselective alkylation of phenol with benzyl bromide"
    with pytest.raises(RefusalError, match="'Regioselective'"):
        fulfill(text, names=NAMES)
    assert any("'Regioselective'" in line for line in fulfill(text, partial=True, names=NAMES).protocol.partial)


@pytest.mark.parametrize(
    "text",
    [
        "Alkylation of a piperazine derivative followed by reduction with sodium borohydride",
        "Reduction of the sulfonyl chloride with lithium aluminum hydride",
        "Preparation of benzyl alcohol: Oxidation of benzaldehyde with manganese dioxide",
        "Boc deprotection of cyclohexane using TFA",
        "Reduce 5 g of acetophenone with NaBH4 at 0 C for 30 min and then at 25 C for 2 h",
        "Reduce acetophenone with NaBH4 (5 g)(3 g)",
        "Reduce 5 mL of the ketone with NaBH4",
        "Recite a poem about benzene",
    ],
)
def test_a_wish_that_no_procedure_carries_out_as_written_is_refused(text: str) -> None:
    with pytest.raises(RefusalError):
        fulfill(text, partial=True, names=NAMES)


@pytest.mark.parametrize(
    "text",
    [
        "Methylation of benzoic acid with diazomethane",
        "Acylation of aniline with phosgene",
        "Synthesis of ClC#C: Reaction of the alcohol with thionyl chloride",
        "Synthesis of ClCCSCCCl: Reaction of the alcohol with thionyl chloride",
        "Grignard addition of phenylmagnesium bromide to acetone in ethanol",
        "Dissolving chromium trioxide in acetone",
        "Reduction of benzophenone with LiAlH4 in methanol",
        "Distillation of tert-butyl hydroperoxide",
        "Chlorination of 2,2'-thiodiethanol using thionyl chloride",
    ],
)
def test_a_dangerous_wish_is_refused_in_one_line(text: str) -> None:
    with pytest.raises(LabgymError) as refusal:
        fulfill(text, partial=True, names=NAMES)
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize("item", TABLE.procedures, ids=lambda item: item.id)
def test_a_general_procedure_is_consistent(item: GeneralProcedure) -> None:
    taken = {portion.name for action in item.actions for portion in action.takes}
    keys = [slot.key for slot in item.slots]
    assert set(keys) <= taken
    assert len(set(keys)) == len(keys)
    assert ("S" in taken) == bool(item.solvent)
    assert item.source
    assert {name for slot in item.slots for name in slot.classes} <= {ANY, *TABLE.classes}
    fixed = [name for name in (*taken - {*keys, "S"}, item.solvent, *(slot.default for slot in item.slots)) if name]
    named = NAMES.resolve([Material(name=name, role="reagent") for name in fixed])
    assert [meaning.name for meaning in named if not meaning.is_known] == []


def test_equations_lead_forward_and_back() -> None:
    acid, chloride = "OC(=O)c1ccccc1", "O=C(Cl)c1ccccc1"
    item = next(item for item in TABLE.procedures if item.id == "acid_chloride_thionyl")
    assert forward(item.equations, [acid]) == (canonical(chloride),)
    assert backward(item.retro, chloride) == ((canonical(acid),),)


def test_a_wish_is_saved_and_reloads(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "wish.json"
    assert main(["protocols", "new", "Boc deprotection using HCl in dioxane", "--out", str(file)]) == 0
    assert "unnamed Boc amine" in capsys.readouterr().err
    assert Protocol.load(file).partial
