"""Classification from structure: agreement with the catalogue and with labels of reagents that it does not list."""

from __future__ import annotations

import csv
import json
import re
import statistics
import sys
from collections import Counter
from pathlib import Path

import pytest
from every_case import for_each

from labgym.assets import Catalog
from labgym.assets.checks import cas_is_valid, sizes_are_plausible, surfaces_fit
from labgym.assets.compatibility import incompatible, rulebook
from labgym.assets.flags import FLAGS
from labgym.assets.inference import classify, compare, infer, listed, substructures
from labgym.assets.inference.volatility import boiling_point, flash_point, molar_mass
from labgym.assets.shapes import build
from labgym.assets.structures import StructureError, canonical, molecule
from labgym.cli import main
from labgym.errors import MissingDependencyError, OptionError

Chem = pytest.importorskip("rdkit.Chem")
Descriptors = pytest.importorskip("rdkit.Chem.Descriptors")

HERE = Path(__file__).parent
CATALOG = Catalog.published()
REAGENTS = [asset for asset in CATALOG.of_kind("reagent") if asset.chemistry.smiles]
with (HERE / "unlisted_reagents.csv").open(encoding="utf-8") as text:
    UNLISTED = [
        (row["name"], row["smiles"], row["cas"], frozenset(row["groups"].split()), frozenset(row["flags"].split()))
        for row in csv.DictReader(text)
    ]
LABELLED = [(name, smiles, groups, flags) for name, smiles, _, groups, flags in UNLISTED]
SETS = {"catalogue": listed(CATALOG), "unlisted": LABELLED}
DISAGREEMENTS = json.loads((HERE / "inference_disagreements.json").read_text(encoding="utf-8"))


def test_labelled_substances_are_real_and_none_is_in_the_catalogue() -> None:
    known = {canonical(asset.chemistry.smiles) for asset in REAGENTS}
    numbers = {asset.chemistry.cas for asset in CATALOG.of_kind("reagent")}
    assert len(UNLISTED) >= 80
    for name, smiles, cas, groups, flags in UNLISTED:
        assert cas_is_valid(cas), name
        assert cas not in numbers, name
        assert canonical(smiles) not in known, name
        assert groups <= set(rulebook().groups), name
        assert flags <= set(FLAGS), name
    assert len({canonical(smiles) for _, smiles, *_ in UNLISTED}) == len(UNLISTED)


@pytest.mark.parametrize("name", SETS)
def test_every_disagreement_is_known_with_its_reason(name: str) -> None:
    found = {(item.name, item.label, item.inferred) for item in compare(SETS[name]).disagreements}
    stated = {(item["name"], item["label"], item["inferred"]) for item in DISAGREEMENTS if item["set"] == name}
    assert found == stated
    assert all(len(item["reason"]) > 10 for item in DISAGREEMENTS)


@pytest.mark.parametrize(
    ("name", "kind", "precision", "recall"),
    [
        ("catalogue", "groups", 0.95, 0.95),
        ("catalogue", "flags", 0.93, 0.90),
        ("unlisted", "groups", 0.95, 0.95),
        ("unlisted", "flags", 0.90, 0.90),
    ],
)
def test_most_groups_and_flags_are_right(name: str, kind: str, precision: float, recall: float) -> None:
    total = compare(SETS[name]).total(kind)
    assert total.precision is not None
    assert total.recall is not None
    assert total.precision >= precision
    assert total.recall >= recall


def test_scores_count_what_a_hand_counts() -> None:
    water_as_alcohol = ("water", "O", frozenset({"alcohol"}), frozenset({"acid"}))
    found = compare([water_as_alcohol, ("methanol", "CO", frozenset({"alcohol"}), frozenset({"flammable"}))])
    by_label = {score.label: (score.right, score.wrong, score.missed) for score in found.scores["groups"]}
    assert by_label == {"alcohol": (1, 0, 1), "aqueous": (0, 1, 0)}
    assert found.total("groups").precision == pytest.approx(1 / 2)
    assert found.total("groups").recall == pytest.approx(1 / 2)
    assert found.exact["groups"] == 1


def test_every_reactive_group_can_be_inferred_and_nothing_else_is() -> None:
    assert {rule.gives for rule in substructures().groups} == set(rulebook().groups)
    assert {rule.gives for rule in substructures().flags} <= set(FLAGS)


@pytest.mark.cases(15)
@pytest.mark.parametrize("smiles", [smiles for _, smiles, *_ in UNLISTED[::3]])
def test_every_spelling_is_classified_alike(smiles: str) -> None:
    expected = classify(smiles)
    mol = Chem.MolFromSmiles(smiles)
    for spelling in {Chem.MolToSmiles(mol, doRandom=True) for _ in range(4)}:
        assert classify(spelling).model_dump(exclude={"groups", "flags"}) == expected.model_dump(
            exclude={"groups", "flags"}
        )
        assert classify(spelling).groups.keys() == expected.groups.keys()
        assert classify(spelling).flags.keys() == expected.flags.keys()


@pytest.mark.parametrize(
    ("first", "second"),
    [
        ("CO[Na]", "C[O-].[Na+]"),
        ("CN(=O)=O", "C[N+](=O)[O-]"),
        ("O=S(Cl)Cl", "[O-][S+](Cl)Cl"),
        ("[Li]CC", "[Li+].[CH2-]C"),
    ],
)
def test_ways_of_drawing_a_bond_are_classified_alike(first: str, second: str) -> None:
    assert classify(first).groups.keys() == classify(second).groups.keys()
    assert classify(first).flags.keys() == classify(second).flags.keys()


# (C + O) / N of organic azides: below 3 they count as explosive.
@pytest.mark.parametrize(
    ("smiles", "explosive"),
    [
        ("CN=[N+]=[N-]", True),
        ("CCCCCCCCN=[N+]=[N-]", True),
        ("CCCCCCCCCN=[N+]=[N-]", False),
        ("CCCCCCCCOCCCN=[N+]=[N-]", False),
        ("C[N+](=O)[O-]", False),
        ("O=[N+]([O-])c1cccc([N+](=O)[O-])c1", True),
        ("OCC(CO)(CO)CO", False),
        ("O=[N+]([O-])OCC(CO[N+](=O)[O-])O[N+](=O)[O-]", True),
        ("CC(C)(C)OOC(C)(C)C", True),
        ("c1ccccc1N=Nc1ccccc1", False),
    ],
)
def test_explosive_groups_are_told_from_similar_ones(smiles: str, explosive: bool) -> None:
    assert ("explosive" in classify(smiles).flags) == explosive


def test_a_reason_names_the_rule_the_part_and_how_sure_it_is() -> None:
    found = classify("CC(=O)Cl")
    (reason,) = found.groups["acyl_halide"]
    assert Chem.CanonSmiles(reason.part) == Chem.CanonSmiles("O=CCl")
    assert reason.why
    assert all(0.0 < item.confidence < 1.0 for why in found.flags.values() for item in why)
    assert {"water_reactive", "flammable"} <= found.flags.keys()


def test_boiling_points_follow_the_published_worked_example() -> None:
    acetone = 198.2 + 2 * 23.58 + 76.75  # Joback and Reid, kelvin
    assert boiling_point(molecule("CC(C)=O")) == pytest.approx(acetone - 273.15, abs=0.06)
    decane = 198.2 + 2 * 23.58 + 8 * 22.88
    assert boiling_point(molecule("CCCCCCCCCC")) == pytest.approx(decane - 273.15, abs=0.06)
    assert boiling_point(molecule("[Na+].[Cl-]")) is None


def test_estimates_are_near_what_was_measured() -> None:
    boiling, flash = [], []
    for asset in REAGENTS:
        found, known = classify(asset.chemistry.smiles), asset.chemistry
        if found.boiling_point is not None and known.boiling_point is not None:
            boiling.append(abs(found.boiling_point - known.boiling_point))
        if known.boiling_point is not None and known.flash_point is not None and known.boiling_point > 20.0:
            flash.append(abs(flash_point(known.boiling_point) - known.flash_point))
    assert len(boiling) > 60
    assert statistics.median(boiling) < 15.0
    assert len(flash) > 40
    assert statistics.median(flash) < 15.0


@for_each("asset", REAGENTS)
def test_masses_are_those_of_rdkit(asset) -> None:
    mol = molecule(asset.chemistry.smiles)
    assert molar_mass(mol) == pytest.approx(Descriptors.MolWt(mol), abs=0.01)


@pytest.mark.parametrize("smiles", ["CCO", "[K+].[O-][N+](=O)[O-]", "C=C", "CC(=O)OO", "C1CO1", "[He]", "C" * 100])
def test_an_inferred_reagent_is_an_asset_that_says_so(smiles: str) -> None:
    asset = infer(smiles, "test substance")
    assert asset.name == "TestSubstance"
    assert asset.kind == "reagent"
    assert asset.chemistry.confidence == "low"
    assert asset.chemistry.notes.startswith("inferred from structure")
    assert set(asset.chemistry.groups) == set(classify(smiles).groups)
    assert not [*sizes_are_plausible(asset), *surfaces_fit(asset)]
    assert list(build(asset))
    assert (asset.size.width, asset.size.depth, asset.size.height) in {
        (known.size.width, known.size.depth, known.size.height) for known in REAGENTS
    }


def test_an_inferred_reagent_is_kept_apart_like_a_listed_one() -> None:
    anhydride, amine = infer("CCC(=O)OC(=O)CC", "propionic anhydride"), infer("CCNCC", "diethylamine")
    assert incompatible(infer("OS(=O)(=O)C(F)(F)F", "triflic acid"), amine).kind == "strong_acid_with_base"
    assert incompatible(anhydride, CATALOG.find("Toluene")) is None


@pytest.mark.parametrize("name", ["", "\x1b[31m\n", "2-丁酮", "../../etc", "a" * 200])
def test_any_name_gives_a_valid_asset_name(name: str) -> None:
    asset = infer("CCC(C)=O", name)
    assert re.fullmatch(r"[A-Z][A-Za-z0-9]{1,63}", asset.name)
    assert asset.synonyms_en[0].isprintable()


def test_too_long_a_name_is_refused() -> None:
    with pytest.raises(OptionError, match="at most 200"):
        infer("CCO", "a" * 201)


@pytest.mark.parametrize(
    "smiles",
    [
        "",
        "C" * 501,
        "C" * 201,
        "C1CC",
        "C(C)(C)(C)(C)C",
        "(" * 400,
        "乙醇",
        "CC O",
        "[U]%10%11" * 40,
        "\x00",
        ".",
        ">>",
    ],
)
def test_what_is_no_structure_is_refused_in_one_line(smiles: str, capfd: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(StructureError) as error:
        classify(smiles)
    assert "\n" not in str(error.value)
    assert capfd.readouterr().err == ""


@pytest.mark.parametrize(
    "smiles",
    [
        "C1CC1" * 50,
        "C/C=C/" * 60 + "C",
        ".".join(["C"] * 200),
        "N=C(N)" * 60,
        "c1ccc2c(c1)" * 20,
        "CN(=O)=O." * 40 + "C",
    ],
)
def test_the_largest_structures_are_classified(smiles: str) -> None:
    found = classify(smiles)
    assert found.molar_mass == pytest.approx(Descriptors.MolWt(Chem.MolFromSmiles(smiles)), rel=1e-3)


def test_without_rdkit_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "rdkit", None)
    with pytest.raises(MissingDependencyError, match=r"labgym-nav\[chem\]"):
        classify("CCCCCCCCCCCO")


def test_no_reagent_is_listed_twice_among_the_disagreements() -> None:
    seen = Counter((item["set"], item["name"], item["label"]) for item in DISAGREEMENTS)
    assert max(seen.values()) == 1


def test_the_command_prints_groups_with_reasons(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["assets", "infer", "CCOC(=O)C=[N+]=[N-]"]) == 0
    printed = capsys.readouterr().out
    assert re.search(r"flag +explosive +diazo compound", printed)
    assert re.search(r"group +ester ", printed)
    assert "not measured" in printed


def test_the_command_prints_the_agreement(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["assets", "infer", "--agreement"]) == 0
    printed = capsys.readouterr().out
    found = compare(SETS["catalogue"])
    assert f"{len(REAGENTS)} reagents: all groups of {found.exact['groups']}" in printed
    assert f"{len(found.disagreements)} disagreements" in printed


@pytest.mark.parametrize("arguments", [[], ["CCO", "--agreement"], ["C1CC"]])
def test_the_command_refuses_in_one_line(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["assets", "infer", *arguments]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_compat_infers_what_the_catalogue_lacks_and_says_so(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["assets", "compat", "OS(=O)(=O)C(F)(F)F", "sodium hydroxide"]) == 0
    printed = capsys.readouterr().out
    assert "strong acid" in printed
    assert "groups inferred from structure" in printed


def test_compat_takes_no_abbreviation_for_a_structure(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["assets", "compat", "NCS", "acetone"]) == 2
    assert "not found" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("smiles", "flags"),
    [
        ("F", {"acid", "volatile_or_toxic"}),
        ("[C-]#[O+]", {"flammable", "volatile_or_toxic"}),
        ("ClC(Cl)=O", {"volatile_or_toxic", "water_reactive"}),
        ("C#N", {"volatile_or_toxic"}),
        ("N=[N+]=[N-]", {"explosive", "volatile_or_toxic"}),
        ("C=[N+]=[N-]", {"explosive", "volatile_or_toxic"}),
        ("C[Hg]C", {"volatile_or_toxic"}),
        ("COS(=O)(=O)OC", {"volatile_or_toxic"}),
        ("CC1(C)OOC(C)(C)OOC(C)(C)OO1", {"explosive", "oxidizer"}),
        ("C1N(CN(CN1[N+](=O)[O-])[N+](=O)[O-])[N+](=O)[O-]", {"explosive"}),
        ("[Li]C(C)(C)C", {"flammable", "water_reactive", "base"}),
        ("P", {"flammable", "volatile_or_toxic"}),
        ("[Na+].[O-]Cl(=O)=O", {"oxidizer"}),
        ("[Ca+2].[C-]#[C-]", {"water_reactive"}),
    ],
)
def test_notorious_substances_carry_their_hazards(smiles: str, flags: set[str]) -> None:
    assert flags <= classify(smiles).flags.keys()


@pytest.mark.parametrize(
    ("smiles", "group"),
    [
        ("CN=C=O", "isocyanate"),
        ("O=[N+]([O-])OCC(O[N+](=O)[O-])CO[N+](=O)[O-]", "nitro"),
        ("C#CCO", "alkene"),
        ("COS(=O)(=O)OC", "ester"),
        ("S=C=S", "organic_sulfide"),
        ("c1ccsc1", "organic_sulfide"),
    ],
)
def test_substances_that_react_have_a_group(smiles: str, group: str) -> None:
    assert group in classify(smiles).groups


@pytest.mark.parametrize("smiles", ["CC[Zn]CC", "[Li]C(C)(C)C", "C[Al](C)C"])
def test_the_storage_of_what_ignites_in_air_says_so(smiles: str) -> None:
    inference = classify(smiles)
    assert inference.storage_class == "WaterReactive"
    assert "may ignite in air" in inference.storage_reason


@pytest.mark.parametrize(
    "smiles", ["Oc1c([N+](=O)[O-])cc([N+](=O)[O-])cc1[N+](=O)[O-]", "O=[N+]([O-])OCCO[N+](=O)[O-]", "[CH2]=[N+]=[N-]"]
)
def test_explosives_are_not_stored_like_anything_else_without_a_word(smiles: str) -> None:
    assert "may explode: no ordinary cabinet suffices" in classify(smiles).storage_reason


@pytest.mark.parametrize(
    ("smiles", "is_base"),
    [
        ("OC(=O)CN(CCN(CC(O)=O)CC(O)=O)CC(O)=O", False),  # EDTA: pH 2.5 in water
        ("NCC(=O)O", False),  # glycine: isoelectric at pH 6.0
        ("NCCS(=O)(=O)O", False),  # taurine
        ("OC(=O)c1cccnc1", False),  # nicotinic acid
        ("NCCCCC(N)C(=O)O", True),  # lysine: isoelectric at pH 9.7
        ("NC(N)=NCCCC(N)C(=O)O", True),  # arginine: isoelectric at pH 10.8
        ("CCN(CC)CC", True),
    ],
)
def test_an_amino_acid_is_a_base_only_with_more_amines_than_acids(smiles, is_base):
    inference = classify(smiles)
    assert ("base" in inference.flags) is is_base
    assert (inference.storage_class == "Base") is (is_base and "flammable" not in inference.flags)
    if "acid" in inference.flags:
        assert inference.state == "solid", "a zwitterion is a crystal of ions"
