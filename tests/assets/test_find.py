"""What people write is found, what the catalogue does not hold is refused, and no slip makes one substance another."""

from __future__ import annotations

import csv
import re
import string
from functools import cache
from pathlib import Path

import pytest
from rapidfuzz.distance import OSA

from labgym.assets import Catalog
from labgym.assets.qualifiers import is_aqueous, is_hydrate
from labgym.assets.search import MAX_QUERY, lookalikes, normalize, surface_forms
from labgym.cli import main

HERE = Path(__file__).parent
CATALOG = Catalog.published()
REAGENTS = CATALOG.of_kind("reagent")


def lines(name: str) -> list[str]:
    return (HERE / name).read_text(encoding="utf-8").splitlines()


def surface() -> list[tuple[str, str]]:
    rows = list(csv.reader(lines("surface_forms.csv")))
    assert rows[0] == ["form", "expected"]
    return [(form, expected) for form, expected in rows[1:]]


@cache
def found(text: str) -> str | None:
    match = CATALOG.match(text)
    return None if match is None else match.name


def test_over_a_thousand_forms_that_people_write_are_found():
    forms = surface()
    chinese = [form for form, _ in forms if re.search("[\u3400-\u9fff]", form)]
    assert len(forms) == len({form for form, _ in forms}) > 1800
    assert len(chinese) > 500
    assert {CATALOG.get(expected).kind for _, expected in forms} == {"reagent", "instrument", "facility"}
    wrong = [f"{form!r} gave {found(form)}, not {expected}" for form, expected in forms if found(form) != expected]
    assert not wrong, "\n".join(wrong)


def test_forms_that_mean_nothing_here_are_refused():
    forms = [*lines("refused_forms.txt"), "", "   ", "acetone " * 100_000, "🧪" * MAX_QUERY, "\x00", "\ud800"]
    assert len(forms) > 200
    wrong = [f"{form[:60]!r} gave {found(form)}" for form in forms if found(form) is not None]
    assert not wrong, "\n".join(wrong)


def test_common_chemicals_that_the_catalogue_does_not_hold_are_refused():
    names = lines("absent_chemicals.txt")
    assert len(names) > 500
    texts = [text for name in names for text in (name, name.upper(), f"anhydrous {name}", f"1 M {name}", f"{name}s")]
    wrong = [f"{text!r} gave {found(text)}" for text in texts if found(text) is not None]
    assert not wrong, "\n".join(wrong)


def slips_of(name: str) -> set[str]:
    cuts = [(name[:i], name[i:]) for i in range(len(name) + 1)]
    out = {a + b[1:] for a, b in cuts if b} | {a + b[1] + b[0] + b[2:] for a, b in cuts if len(b) > 1}
    put = {a + c + b for a, b in cuts for c in string.ascii_lowercase}
    return out | put | {a + c + b[1:] for a, b in cuts if b for c in string.ascii_lowercase}


def forms_of_reagents() -> dict[str, str]:
    return {normalize(form): asset.name for asset in REAGENTS for form in surface_forms(asset)}


def slips_between(one: str, other: str) -> set[str]:
    """Slips of one name that are within one letter of the other; there are none beyond two letters."""
    if len(set(one) ^ set(other)) > 4 or OSA.distance(one, other) > 2:
        return set()
    return {slip for slip in slips_of(one) if OSA.distance(slip, other) <= 1}


def test_no_slip_of_another_substances_name_gives_a_reagent():
    forms = forms_of_reagents()
    others = {normalize(name) for name in (*lines("absent_chemicals.txt"), *lookalikes())} - set(forms)
    tried = {
        (slip, other) for other in others for form in forms if form.isascii() for slip in slips_between(other, form)
    }
    assert len(tried) > 500
    wrong = [
        f"{slip!r}, one letter from {other!r}, gave {found(slip)}"
        for slip, other in sorted(tried)
        if slip not in forms and found(slip) in forms.values()
    ]
    assert not wrong, "\n".join(wrong)


def test_no_slip_of_a_reagents_name_gives_another_reagent():
    forms = forms_of_reagents()
    latin = [form for form in forms if form.isascii()]
    pairs = [(one, other) for one in latin for other in latin if forms[one] != forms[other]]
    tried = {(slip, one) for one, other in pairs for slip in slips_between(one, other)}
    assert len(tried) > 500
    wrong = [
        f"{slip!r}, one letter from {form!r}, gave {found(slip)}"
        for slip, form in sorted(tried)
        if slip not in forms and found(slip) in forms.values() and found(slip) != forms[form]
    ]
    assert not wrong, "\n".join(wrong)


def test_a_lookalike_is_never_a_name_of_the_catalogue():
    forms = {normalize(form) for asset in CATALOG for form in surface_forms(asset)}
    assert [name for name in lookalikes() if normalize(name) in forms] == []


def test_two_assets_share_no_form():
    owners: dict[str, str] = {}
    for asset in CATALOG:
        for form in surface_forms(asset):
            assert owners.setdefault(normalize(form), asset.name) == asset.name, form


@pytest.mark.parametrize(
    ("text", "name", "how"),
    [
        ("round bottom flask", "RoundBottomFlask", "name"),
        ("rotovap", "RotaryEvaporator", "synonym"),
        ("67-64-1", "Acetone", "synonym"),
        ("seperatory funnel", "SeparatoryFunnel", "fuzzy"),
        ("hydrogen peroxyde", "HydrogenPeroxide", "fuzzy"),
    ],
)
def test_a_match_says_how_it_was_found_and_how_sure_it_is(text, name, how):
    match = CATALOG.match(text)
    assert (match.name, match.how) == (name, how)
    assert 0.8 < match.score < 1.0 if how == "fuzzy" else match.score == 1.0


@pytest.mark.parametrize(
    ("text", "name", "note"),
    [
        ("250 mL RBF", "RoundBottomFlask", ""),
        ("0.25 L RBF", "RoundBottomFlask", ""),
        ("250 cm³ round-bottom flask", "RoundBottomFlask", ""),
        ("2 L RBF", "RoundBottomFlask2000", ""),
        ("100ml beaker", "Beaker", "the catalog's holds 250 mL, not 100ml"),
        ("600 mL beaker", "LargeBeaker", "the catalog's holds 1 L, not 600 mL"),
        ("5 L beaker", "Beaker5000", ""),
        ("50 L beaker", "Beaker10000", "the catalog's holds 10 L, not 50 L"),
        ("1000毫升烧杯", "LargeBeaker", ""),
        ("180 cm fume cupboard", "FumeHood1800", ""),
        ("6 foot hood", "FumeHood1800", ""),
        ("2.4 m island bench", "IslandBench2400", ""),
        ("3 m lab bench", "LabBench1800", "the catalog's measures 1.8 m, not 3 m"),
        ("90 mm buchner funnel", "BuchnerFunnel", ""),
        ("500 MHz NMR", "NMRSpectrometer", "the catalog's has 400 MHz, not 500 MHz"),
        ("500 mL thermometer", "Thermometer", "the catalog states no size to compare with 500 mL"),
    ],
)
def test_a_size_chooses_among_assets_and_another_size_is_said(text, name, note):
    match = CATALOG.match(text)
    assert (match.name, match.note) == (name, note)


@pytest.mark.parametrize(
    ("text", "name", "aside"),
    [
        ("1 M HCl", "HydrochloricAcid", ("1 M",)),
        ("5 g of NaCl", "SodiumChloride", ("5 g", "of")),
        ("dry THF", "Tetrahydrofuran", ("dry",)),
        ("TBAF 1 M in THF", "TetrabutylammoniumFluoride", ("1 M", "in THF")),
        ("sat. aq. NaHCO3", "SodiumBicarbonate", ("sat.", "aq.")),
        ("饱和碳酸氢钠溶液", "SodiumBicarbonate", ("饱和", "溶液")),
        ("acetonitrile, HPLC grade", "Acetonitrile", ("HPLC grade",)),
    ],
)
def test_amounts_concentrations_and_grades_are_set_aside(text, name, aside):
    match = CATALOG.match(text)
    assert (match.name, match.aside) == (name, aside)


@pytest.mark.parametrize(
    "text", ["anhydrous HCl", "dry HBr", "无水双氧水", "4 M HCl in dioxane", "HCl gas", "bleach powder", "HBr (g)"]
)
def test_a_solution_in_water_is_not_found_without_its_water(text):
    assert found(text) is None


def test_reagents_that_are_solutions_in_water_are_recognised_from_their_data():
    solutions = {"AmmoniumHydroxide", "DeionizedWater", "HydrazineHydrate", "HydrobromicAcid", "HydrochloricAcid"}
    solutions |= {"HydrogenPeroxide", "NitricAcid", "PerchloricAcid", "PhosphoricAcid", "SodiumHypochlorite"}
    assert {asset.name for asset in REAGENTS if is_aqueous(asset)} == solutions | {"TertButylHydroperoxide"}


def test_salts_with_water_of_crystallisation_are_recognised_from_their_structure():
    hydrates = {"CopperIISulfate", "Hydroxybenzotriazole", "PToluenesulfonicAcid", "TinIIChloride"}
    assert {asset.name for asset in REAGENTS if is_hydrate(asset)} == hydrates


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("IKA RCT hotplate stirrer", "MagneticHotplateStirrer"),
        ("Sartorius analytical balance 0.1 mg", "AnalyticalBalance"),
        ("flask, Erlenmeyer", "ErlenmeyerFlask"),
        ("rotovap with chiller", "RotaryEvaporator"),
        ("DCM (dichloromethane)", "Dichloromethane"),
    ],
)
def test_makers_models_and_second_names_do_not_hide_a_name(text, name):
    assert found(text) == name


@pytest.mark.parametrize(
    "text", ["stirrer controller", "vial holder", "vacuum pump oil", "DCM (chloroform)", "bath oil"]
)
def test_a_word_that_changes_what_is_meant_is_not_set_aside(text):
    assert found(text) is None


def test_a_hydrate_is_found_where_the_dry_salt_is_asked_and_it_says_so():
    match = CATALOG.match("anhydrous copper sulfate")
    assert (match.name, match.note) == ("CopperIISulfate", "the catalog's is a hydrate")
    assert CATALOG.match("copper sulfate").note == ""


def test_candidates_are_ranked_and_bounded():
    candidates = CATALOG.candidates("ethyl acetat", 4)
    assert [match.name for match in candidates][:1] == ["EthylAcetate"]
    assert [match.score for match in candidates] == sorted((match.score for match in candidates), reverse=True)
    assert len({match.name for match in candidates}) == len(candidates) <= 4
    assert CATALOG.candidates("", 4) == ()


@pytest.mark.parametrize("text", ["圆底烧瓶", "rbf 250 ml", "Round-Bottom Flask"])
def test_the_command_prints_the_entry_and_how_it_was_found(text, capsys):
    assert main(["assets", "find", text]) == 0
    shown = capsys.readouterr().out
    assert shown.startswith("RoundBottomFlask (instrument, glassware)\n")
    assert "matched by" in shown
    assert CATALOG.get("RoundBottomFlask").description in shown


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("methanal", "'methanal' not found; nearest: Methanol (0.88)"),
        ("coffee grinder", "'coffee grinder' not found; nearest: "),
        ("🧪", "not found; no name is near"),
        ("", "'' not found; no name is near"),
    ],
)
def test_the_command_says_what_is_nearest_and_ends_with_2(text, said, capsys):
    assert main(["assets", "find", text]) == 2
    shown = capsys.readouterr()
    assert shown.out == ""
    assert shown.err.startswith("labgym: error: ")
    assert said in shown.err
    assert shown.err.count("\n") == 1


def test_the_command_lists_candidates(capsys):
    assert main(["assets", "find", "funnel", "--count", "4"]) == 0
    shown = capsys.readouterr().out
    assert shown.startswith("4 candidates")
    assert "GlassFunnel" in shown
    assert main(["assets", "find", "funnel", "--count", "-1"]) == 2
