"""The matrix of reactive groups: complete, symmetric, with sources, and right about textbook pairs."""

from __future__ import annotations

import sys
from itertools import combinations, combinations_with_replacement, islice

import pytest

from labgym.artefacts import artefacts
from labgym.assets import Catalog, incompatible
from labgym.assets.compatibility import rulebook, rules
from labgym.assets.reactivity import (
    _MADE_OF,
    SEVERITIES,
    TRAITS,
    Reactivity,
    cell,
    products,
    reactions,
    reactivity,
    to_avoid,
)
from labgym.cli import main
from labgym.cli.describe import compatibility_details
from labgym.documents import read_json
from labgym.errors import DocumentError, UnknownNameError

CATALOG = Catalog.published()
REAGENTS = CATALOG.of_kind("reagent")
GROUPS = tuple(rulebook().groups)

# Written from textbooks and safety summaries by reagent, not by group; the word is what must be told.
TOXIC_FIRE_OR_EXPLOSION = [
    ("sodium cyanide", "hydrochloric acid", "hydrogen cyanide"),
    ("sodium cyanide", "acetic acid", "hydrogen cyanide"),
    ("sodium cyanide", "sulfuric acid", "hydrogen cyanide"),
    ("sodium cyanide", "bleach", "cyanogen chloride"),
    ("sodium sulfide", "hydrochloric acid", "hydrogen sulfide"),
    ("sodium sulfide", "citric acid", "hydrogen sulfide"),
    ("sodium sulfite", "sulfuric acid", "sulfur dioxide"),
    ("sodium bisulfite", "hydrochloric acid", "sulfur dioxide"),
    ("sodium dithionite", "hydrochloric acid", "sulfur dioxide"),
    ("sodium thiosulfate", "hydrochloric acid", "sulfur dioxide"),
    ("sodium azide", "hydrochloric acid", "hydrazoic"),
    ("sodium azide", "dichloromethane", "diazidomethane"),
    ("sodium azide", "bromine", "halogen azides"),
    ("sodium azide", "copper(II) sulfate", "azide"),
    ("sodium azide", "silver nitrate", "silver azide"),
    ("sodium nitrite", "hydrochloric acid", "nitrogen oxides"),
    ("sodium nitrite", "ammonium chloride", "explodes"),
    ("sodium nitrite", "sodium cyanide", "explode"),
    ("bleach", "hydrochloric acid", "chlorine"),
    ("bleach", "acetic acid", "chlorine"),
    ("bleach", "aqueous ammonia", "chloramine"),
    ("bleach", "methanol", "hypochlorite"),
    ("bleach", "piperidine", "chloramine"),
    ("bleach", "ammonium chloride", "chloramine"),
    ("potassium permanganate", "glycerol", "ignite"),
    ("potassium permanganate", "sulfuric acid", "heptoxide"),
    ("potassium permanganate", "hydrochloric acid", "chlorine"),
    ("potassium dichromate", "hydrochloric acid", "chlorine"),
    ("chromium trioxide", "ethanol", "ignite"),
    ("chromium trioxide", "acetone", "ignite"),
    ("chromium trioxide", "DMF", "violent"),
    ("chromium trioxide", "acetic anhydride", "explode"),
    ("hydrogen peroxide", "acetone", "peroxides"),
    ("hydrogen peroxide", "diethyl ether", "peroxides"),
    ("hydrogen peroxide", "hydrazine hydrate", "ignite"),
    ("hydrogen peroxide", "sulfuric acid", "peroxysulfuric"),
    ("nitric acid", "acetone", "explosive"),
    ("nitric acid", "ethanol", "runs away"),
    ("nitric acid", "acetic anhydride", "explode"),
    ("nitric acid", "aniline", "ignite"),
    ("nitric acid", "toluene", "nitration"),
    ("nitric acid", "hydrochloric acid", "nitrosyl"),
    ("nitric acid", "nitrobenzene", "detonate"),
    ("nitric acid", "zinc powder", "nitrogen oxides"),
    ("perchloric acid", "DMSO", "explodes"),
    ("perchloric acid", "acetic anhydride", "explode"),
    ("perchloric acid", "ethanol", "perchlorate"),
    ("sulfuric acid", "formic acid", "carbon monoxide"),
    ("iodine", "aqueous ammonia", "explosive"),
    ("bromine", "aqueous ammonia", "explosive"),
    ("silver nitrate", "aqueous ammonia", "fulminating"),
    ("sodium", "water", "hydrogen"),
    ("potassium", "water", "hydrogen"),
    ("lithium aluminium hydride", "water", "hydrogen"),
    ("sodium hydride", "water", "hydrogen"),
    ("n-butyllithium", "water", "ignite"),
    ("sodium", "methanol", "hydrogen"),
    ("sodium", "chloroform", "shock"),
    ("potassium", "dichloromethane", "shock"),
    ("magnesium", "chloroform", "detonate"),
    ("zinc powder", "hydrochloric acid", "hydrogen"),
    ("iron powder", "hydrochloric acid", "hydrogen"),
    ("sodium borohydride", "hydrochloric acid", "hydrogen"),
    ("sodium borohydride", "boron trifluoride etherate", "diborane"),
    ("sodium hydride", "DMF", "runs away"),
    ("sodium hydride", "DMSO", "explode"),
    ("lithium aluminium hydride", "chloroform", "explode"),
    ("lithium aluminium hydride", "nitrobenzene", "explode"),
    ("acetyl chloride", "DMSO", "explode"),
    ("thionyl chloride", "DMSO", "explode"),
    ("acetyl chloride", "water", "hydrogen halide"),
    ("acetyl chloride", "methanol", "hydrogen chloride"),
    ("trimethylsilyl chloride", "water", "hydrogen chloride"),
    ("chloroform", "potassium tert-butoxide", "ignite"),
    ("chloroform", "sodium hydroxide", "explodes"),
    ("benzoyl peroxide", "aniline", "explode"),
    ("benzoyl peroxide", "styrene", "polymerisation"),
    ("styrene", "sulfuric acid", "polymerisation"),
    ("styrene", "aluminium chloride", "polymerisation"),
    ("palladium on carbon", "hydrogen", "ignites"),
    ("TBAF", "sulfuric acid", "hydrogen fluoride"),
    ("NBS", "aniline", "violent"),
]  # fmt: skip
MUCH_HEAT_OR_FUMES = [
    ("hydrochloric acid", "sodium hydroxide"),
    ("sulfuric acid", "aqueous ammonia"),
    ("acetic acid", "sodium hydroxide"),
    ("hydrochloric acid", "sodium bicarbonate"),
    ("sulfuric acid", "water"),
    ("titanium tetrachloride", "water"),
    ("acetic anhydride", "water"),
    ("phosphorus oxychloride", "water"),
    ("thionyl chloride", "DMF"),
    ("acetic anhydride", "triethylamine"),
    ("acetyl chloride", "triethylamine"),
    ("lithium aluminium hydride", "ethyl acetate"),
    ("n-butyllithium", "acetone"),
    ("bromine", "acetone"),
    ("bromine", "THF"),
    ("bleach", "urea"),
    ("bleach", "acetone"),
    ("palladium on carbon", "methanol"),
    ("aluminium chloride", "nitrobenzene"),
    ("aniline", "acetyl chloride"),
    ("iodine", "ethanol"),
    ("potassium permanganate", "activated charcoal"),
    ("DIAD", "triphenylphosphine"),
    ("zinc powder", "sodium hydroxide"),
    ("sodium hydroxide", "ammonium chloride"),
]  # fmt: skip
HARMLESS = [
    ("acetone", "ethanol"),
    ("acetone", "water"),
    ("ethanol", "water"),
    ("methanol", "dichloromethane"),
    ("ethyl acetate", "n-hexane"),
    ("ethyl acetate", "petroleum ether"),
    ("ethyl acetate", "water"),
    ("ethyl acetate", "methanol"),
    ("diethyl ether", "water"),
    ("diethyl ether", "n-pentane"),
    ("dichloromethane", "water"),
    ("dichloromethane", "ethyl acetate"),
    ("dichloromethane", "n-heptane"),
    ("chloroform", "methanol"),
    ("toluene", "THF"),
    ("toluene", "water"),
    ("acetonitrile", "water"),
    ("acetonitrile", "methanol"),
    ("DMF", "water"),
    ("DMF", "ethanol"),
    ("DMSO", "water"),
    ("1,4-dioxane", "water"),
    ("cyclohexane", "isopropanol"),
    ("benzene", "acetone"),
    ("sodium chloride", "water"),
    ("sodium chloride", "hydrochloric acid"),
    ("sodium chloride", "sodium bicarbonate"),
    ("magnesium sulfate", "ethyl acetate"),
    ("sodium sulfate", "dichloromethane"),
    ("silica gel", "ethyl acetate"),
    ("silica gel", "dichloromethane"),
    ("celite", "methanol"),
    ("molecular sieves", "THF"),
    ("activated charcoal", "ethanol"),
    ("sodium bicarbonate", "water"),
    ("sodium bicarbonate", "ethyl acetate"),
    ("potassium carbonate", "acetone"),
    ("potassium carbonate", "DMF"),
    ("potassium carbonate", "sodium hydroxide"),
    ("potassium permanganate", "water"),
    ("sodium hydroxide", "sodium chloride"),
    ("nitrogen", "hydrogen"),
    ("nitrogen", "lithium aluminium hydride"),
    ("argon", "n-butyllithium"),
    ("acetic acid", "water"),
    ("acetic acid", "toluene"),
    ("citric acid", "water"),
    ("citric acid", "acetic acid"),
    ("imidazole", "water"),
    ("triethylamine", "toluene"),
    ("pyridine", "ethanol"),
    ("aqueous ammonia", "ethanol"),
    ("sodium sulfite", "water"),
    ("sodium hydride", "n-hexane"),
    ("sodium", "toluene"),
    ("glycerol", "water"),
    ("urea", "water"),
    ("hydrazine hydrate", "water"),
    ("hydrazine hydrate", "ethanol"),
]  # fmt: skip


def asset(name):
    return CATALOG.find(name)


def worst(a, b):
    return reactions(asset(a), asset(b))[0].cell


@pytest.mark.parametrize(("a", "b", "told"), TOXIC_FIRE_OR_EXPLOSION)
def test_what_gasses_burns_or_explodes_is_dangerous_and_says_so(a, b, told):
    for first, second in ((a, b), (b, a)):
        found = reactions(asset(first), asset(second))
        dangers = [r.cell for r in found if r.cell.severity == "dangerous"]
        assert found[0].cell.severity == "dangerous"
        assert any(told in " ".join((danger.hazard, *danger.products)) for danger in dangers)


@pytest.mark.parametrize(("a", "b"), MUCH_HEAT_OR_FUMES)
def test_what_runs_hot_or_fumes_is_at_least_incompatible(a, b):
    assert worst(a, b).severity in ("incompatible", "dangerous")
    assert worst(b, a) == worst(a, b)


@pytest.mark.parametrize(("a", "b"), HARMLESS)
def test_what_is_mixed_every_day_is_compatible(a, b):
    assert worst(a, b).severity == "compatible"
    assert worst(b, a) == worst(a, b)


def test_the_textbook_lists_name_distinct_pairs():
    lists = [[pair[:2] for pair in TOXIC_FIRE_OR_EXPLOSION], MUCH_HEAT_OR_FUMES, HARMLESS]
    named = [frozenset((asset(a).name, asset(b).name)) for pairs in lists for a, b in pairs]
    assert len(named) == len(set(named))
    assert all(len(pair) == 2 for pair in named)


def test_every_pair_of_groups_has_an_answer_with_hazard_and_source_whatever_the_order():
    for a, b in combinations_with_replacement(GROUPS, 2):
        answer = cell(a, b)
        assert answer.severity in SEVERITIES
        assert len(answer.hazard) > 10
        assert len(answer.source) > 10
        assert cell(b, a) == answer


def test_the_matrix_numbers_every_group_in_the_charts_and_no_other():
    assert set(reactivity().groups) == set(GROUPS)
    assert all("cameo" in numbers for numbers in reactivity().groups.values())


def test_entries_that_cite_a_chart_have_groups_with_numbers_in_it():
    for entry in reactivity().entries:
        for a, b in entry.pairs():
            for chart in entry.charts:
                assert {a, b}.isdisjoint(TRAITS)
                assert chart in reactivity().groups[a], f"{entry.hazard}: {a} has no number in {chart}"
                assert chart in reactivity().groups[b], f"{entry.hazard}: {b} has no number in {chart}"


@pytest.mark.parametrize("trait", TRAITS)
def test_every_trait_of_the_matrix_makes_some_pair_react(trait):
    pairs = combinations_with_replacement(REAGENTS, 2)
    assert any(trait in (r.first.group, r.second.group) for a, b in pairs for r in reactions(a, b))


@pytest.mark.parametrize("every", [6, pytest.param(1, marks=pytest.mark.slow)])
def test_any_two_reagents_have_one_answer_in_both_orders_worst_first(every):
    for a, b in islice(combinations_with_replacement(REAGENTS, 2), None, None, every):
        found = reactions(a, b)
        assert found == reactions(b, a)
        ranks = [SEVERITIES.index(reaction.cell.severity) for reaction in found]
        assert ranks == sorted(ranks, reverse=True)
        assert found
        assert found[0].first.asset <= found[0].second.asset


def test_reactions_name_groups_or_flags_that_the_reagents_have():
    for a, b in combinations(REAGENTS[::4], 2):
        for reaction in reactions(a, b):
            for side in (reaction.first, reaction.second):
                held = CATALOG.get(side.asset)
                assert side.group in held.chemistry.groups or side.group in TRAITS


def test_whatever_layouts_keep_apart_is_incompatible_in_the_matrix():
    for a, b in combinations(REAGENTS, 2):
        rule = incompatible(a, b)
        if rule is not None:
            assert reactions(a, b)[0].cell.severity in ("incompatible", "dangerous"), f"{a.name}, {b.name}: {rule.kind}"


def test_each_segregation_rule_is_incompatible_group_by_group():
    for rule in rules("segregation"):
        for a in rule.a & set(GROUPS):
            for b in rule.b & set(GROUPS):
                assert cell(a, b).severity in ("incompatible", "dangerous"), f"{rule.kind}: {a}, {b}"


def test_mixtures_that_requests_are_refused_for_are_incompatible_at_least():
    refused = read_json(artefacts("assets") / "synthesis" / "refusals.json")["mixtures"]
    pairs = [(a, b) for mixture in refused if "c" not in mixture for a in mixture["a"] for b in mixture["b"]]
    assert len(pairs) > 80
    for a, b in pairs:
        assert worst(a, b).severity in ("incompatible", "dangerous"), f"{a}, {b}"


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("styrene", "polymerises"),
        ("THF", "peroxides"),
        ("diethyl ether", "peroxides"),
        ("benzoyl peroxide", "decomposes"),
        ("AIBN", "decomposes"),
        ("HOBt", "dry"),
        ("bleach", "pressure"),
    ],
)
def test_what_spoils_by_itself_says_so_with_itself(name, told):
    found = reactions(asset(name), asset(name))
    assert found[0].cell.severity == "caution"
    assert any(told in reaction.cell.hazard for reaction in found)
    assert all(reaction.first == reaction.second for reaction in found)


def test_the_groups_of_one_reagent_do_not_react_with_each_other():
    assert cell("strong_reducer", "aqueous").severity == "caution"
    assert reactions(asset("hydrazine hydrate"), asset("hydrazine hydrate"))[0].cell.severity == "compatible"


def test_where_a_narrower_group_has_an_answer_the_wider_one_is_silent():
    found = reactions(asset("bleach"), asset("aqueous ammonia"))
    assert [(r.first.group, r.second.group) for r in found if r.rank] == [("ammonia", "hypochlorite")]
    assert cell("strong_oxidizer", "ammonia").severity == "dangerous"
    assert cell("strong_oxidizer", "weak_base").severity == "dangerous"


def test_equipment_reacts_with_nothing():
    assert reactions(asset("Beaker"), asset("sulfuric acid")) == ()


def test_what_to_avoid_is_worst_first_and_agrees_with_the_pairs():
    acid = asset("nitric acid")
    avoided = to_avoid(acid, CATALOG)
    names = [name for name, _ in avoided]
    assert {"Acetone", "Ethanol", "Aniline", "SodiumCyanide", "ZincPowder"} <= set(names)
    assert set(names).isdisjoint({"NitricAcid", "DeionizedWater", "NitrogenGas", "SilicaGel", "Beaker"})
    ranks = [reaction.rank for _, reaction in avoided]
    assert ranks == sorted(ranks, reverse=True)
    assert set(names) == {b.name for b in REAGENTS if worst("nitric acid", b.name).severity in SEVERITIES[2:]}


def test_an_unknown_group_names_the_nearest():
    with pytest.raises(UnknownNameError, match="strong_acid"):
        cell("strong_acids", "amine")


@pytest.fixture
def compat(capsys):
    """Run `labgym assets compat`; returns exit code, standard output and standard error."""

    def run(*names: str) -> tuple[int, str, str]:
        code = main(["assets", "compat", *names])
        said = capsys.readouterr()
        return code, said.out, said.err

    return run


@pytest.mark.parametrize(("a", "b"), [("nitric acid", "acetone"), ("丙酮", "硝酸"), ("67-64-1", "7697-37-2")])
def test_a_pair_is_answered_by_any_name_in_any_order(compat, a, b):
    code, out, _ = compat(a, b)
    assert code == 0
    assert out.startswith("Acetone and NitricAcid: dangerous\n")
    for told in (
        "ketone (Acetone) with oxidizing acid (NitricAcid)",
        "Bretherick",
        "groups 2 and 19",
        "nitrogen oxides",
    ):
        assert told in out
    assert "keep them apart (rule oxidizer_with_organic_fuel)" in out
    assert compat(b, a)[1] == out


def test_a_harmless_pair_is_answered_with_its_source_too(compat):
    code, out, _ = compat("acetone", "ethanol")
    assert code == 0
    assert out.startswith("Acetone and Ethanol: compatible\n")
    assert "NOAA CAMEO" in out
    assert "may place them together" in out
    assert compat("celite", "molecular sieves")[1].startswith("Celite and MolecularSieves: compatible\n")


def test_a_reagent_with_itself_is_answered(compat):
    code, out, _ = compat("styrene", "苯乙烯")
    assert code == 0
    assert out.startswith("Styrene with itself: caution\n")
    assert "layouts" not in out


def test_a_reagent_alone_lists_what_it_must_not_meet(compat):
    code, out, _ = compat("THF")
    lines = [line for line in out.splitlines() if line.startswith(SEVERITIES)]
    assert code == 0
    assert f"Tetrahydrofuran must not be mixed with {len(lines)} reagents" in out
    assert len(lines) == len(to_avoid(asset("THF"), REAGENTS)) > 15
    assert [line.split()[0] for line in lines] == sorted(
        (line.split()[0] for line in lines), key=("dangerous incompatible").index
    )
    assert "With itself: caution: forms explosive peroxides" in out
    assert compat("argon")[:2] == (0, "ArgonGas must not be mixed with 0 reagents\n")


def test_a_structure_is_answered_as_the_reagent_that_it_is(compat):
    pytest.importorskip("rdkit")
    code, out, _ = compat("CC(=O)Cl", "OC")
    assert code == 0
    assert out == compat("acetyl chloride", "methanol")[1]
    assert out.startswith("AcetylChloride and Methanol: dangerous\n")


def test_a_structure_that_the_catalogue_lacks_is_answered_by_its_inferred_groups(compat):
    pytest.importorskip("rdkit")
    code, out, _ = compat("CCC(=O)Cl", "methanol")
    assert code == 0
    assert out.startswith("C3H5ClO and Methanol: dangerous\n")
    assert "C3H5ClO is CCC(=O)Cl, its groups inferred from structure: acyl halide" in out
    assert "acyl halide (C3H5ClO) with alcohol (Methanol)" in out
    assert compat("methanol", "ClC(=O)CC")[1] == out
    assert "inferred" not in compat("acetyl chloride", "methanol")[1]
    listed = compat("CCC(=O)Cl")[1]
    assert "groups inferred from structure" in listed
    assert "AmmoniumHydroxide" in listed


def test_isomers_are_two_reagents_and_one_structure_is_one(compat):
    pytest.importorskip("rdkit")
    code, out, _ = compat("CCC(N)", "C(NC)C")
    assert code == 0
    assert out.startswith("C3H9NIsomer1 and C3H9NIsomer2: ")
    assert "C3H9NIsomer1 is CCCN" in out
    assert "C3H9NIsomer2 is CCNC" in out
    assert compat("C(C)NC", "C(N)CC")[1] == out
    assert compat("CCC(N)", "C(N)CC")[1].startswith("C3H9N with itself: ")


def test_without_rdkit_a_structure_is_refused_with_the_extra_and_a_wrong_name_as_ever(compat, monkeypatch):
    monkeypatch.setitem(sys.modules, "rdkit", None)
    code, _, err = compat("methanol", "ClC(=O)C")
    assert code == 2
    assert "labgym-nav[chem]" in err
    code, _, err = compat("methanol", "unobtainium")
    assert code == 2
    assert "'unobtainium' not found" in err


@pytest.mark.parametrize(
    ("names", "told"),
    [
        (("nitrik acidd", "acetone"), "nearest: NitricAcid"),
        (("acetone", "unobtainium"), "unobtainium"),
        (("acetone", "beaker"), "Beaker is an asset of kind instrument"),
    ],
)
def test_what_is_no_reagent_is_refused_in_one_line(compat, names, told):
    code, out, err = compat(*names)
    assert (code, out) == (2, "")
    assert told in err
    assert err.count("\n") == 1


def entry(**changes):
    return {"severity": "caution", "hazard": "warms", "source": "a book", "cells": {"amine": ["ether"]}} | changes


def document(*entries):
    groups = {"amine": {"cameo": 7}, "ether": {"cameo": 14}}
    rest = {"hazard": "none known", "source": "a chart"}
    return {
        "schema": "labgym.reactivity/1",
        "charts": {},
        "groups": groups,
        "kinds": {},
        "rest": rest,
        "entries": list(entries),
    }


@pytest.mark.parametrize(
    ("entries", "fault"),
    [
        ([entry(), entry(cells={"ether": ["amine"]})], "two entries"),
        ([entry(cells={"amine": ["nothing"]})], "names an unknown group"),
        ([entry(source="")], "neither charts nor source"),
        ([entry(severity="deadly")], "severity"),
        ([entry(cells={})], "cells"),
        ([entry(cells={"amine": ["amine", "amine"]})], "two entries"),
    ],
)
def test_a_broken_matrix_is_refused_with_what_is_wrong(entries, fault):
    assert Reactivity.parse(document(entry())).entries[0].hazard == "warms"
    with pytest.raises(DocumentError, match=fault):
        Reactivity.parse(document(*entries))


@pytest.mark.parametrize(
    "a, b, absent",
    [
        ("DeionizedWater", "SulfuricAcid", "hydrogen chloride"),
        ("LithiumAluminumHydride", "DeionizedWater", "hydrogen chloride"),
        ("Tetrahydrofuran", "SulfuricAcid", "nitrogen oxides"),
        ("HydrogenPeroxide", "SulfuricAcid", "chlorine dioxide"),
    ],
)
def test_no_product_is_told_that_the_reagents_lack_an_element_for(a: str, b: str, absent: str) -> None:
    first, second = CATALOG.get(a), CATALOG.get(b)
    assert absent not in compatibility_details(first, second)


def test_every_product_of_the_matrix_has_its_elements_written_down() -> None:
    named = {name for entry in reactivity().entries for name in entry.products}
    assert named - set(_MADE_OF) == {"flammable alkane", "nitrosyl halides"}
    hcl = CATALOG.get("HydrochloricAcid")
    bleach = CATALOG.get("SodiumHypochlorite")
    assert any("chlorine" in products(reaction, hcl, bleach) for reaction in reactions(hcl, bleach))


@pytest.mark.parametrize(
    ("a", "b", "severity"),
    [
        ("hydrogen peroxide", "manganese dioxide", "incompatible"),
        ("hydrogen peroxide", "KMnO4", "incompatible"),
        ("bleach", "brine", "compatible"),
        ("bleach", "NaBr", "caution"),
        ("hydrogen peroxide", "sodium iodide", "caution"),
        ("CN=C=O", "water", "incompatible"),
        ("O=C=Nc1ccccc1", "benzylamine", "incompatible"),
        ("S=C=S", "sodium azide", "dangerous"),
        ("C#CCO", "KMnO4", "dangerous"),
    ],
)
def test_pairs_that_handbooks_describe_are_answered_as_they_do(compat, a, b, severity):
    pytest.importorskip("rdkit")
    code, out, _ = compat(a, b)
    assert code == 0
    assert out.splitlines()[0].endswith(f": {severity}")
