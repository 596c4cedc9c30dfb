"""Assets, classes and languages in free text."""

from __future__ import annotations

import pytest

from labgym.assets import Catalog
from labgym.assets.search import normalize
from labgym.protocols.language import concepts, gloss, language_of, mentions
from labgym.protocols.language.folding import Folded

CATALOG = Catalog.load()


def names(text: str) -> list[str]:
    return [mention.name for mention in mentions(text, CATALOG)]


@pytest.mark.parametrize(
    "text, expected",
    [
        ("Stir in DCM, then add TFA.", ["Dichloromethane", "TrifluoroaceticAcid"]),
        ("溶于二氯甲烷，滴加三氟乙酸", ["Dichloromethane", "TrifluoroaceticAcid"]),
        ("wash with sat. sodium hydrogen carbonate and brine", ["SodiumBicarbonate", "SodiumChloride"]),
        ("sulphuric acid, H₂SO₄ and 浓硫酸", ["SulfuricAcid"] * 3),
        ("palladium on carbon (10%) under hydrogen", ["PalladiumOnCarbon", "Hydrogen"]),
        ("cleave a tert-butyl ester", ["tert-butyl ester"]),
        ("two ketones and an amine", ["ketone", "amine"]),
        ("benzoic acid, not benzoic anhydride", ["BenzoicAcid"]),
    ],
)
def test_what_a_text_names_is_found_in_both_languages(text: str, expected: list[str]) -> None:
    assert [name for name in names(text) if name != "acid anhydride"] == expected


def test_a_longer_name_is_not_read_as_a_shorter_one_inside_it() -> None:
    assert names("hydrogen peroxide") == ["HydrogenPeroxide"]
    assert names("sodium azide") == ["SodiumAzide"]
    assert names("ethyl acetoacetate") == ["EthylAcetoacetate"]


@pytest.mark.parametrize(
    "text", ["on a 5 mmol scale", "in a window of the door", "leave the alcohol", "MeTHFoo and ketonesque"]
)
def test_everyday_words_and_parts_of_words_are_no_assets(text: str) -> None:
    assert all(mention.kind == "class" for mention in mentions(text, CATALOG)), names(text)


def test_every_reagent_is_found_by_its_first_english_and_chinese_name() -> None:
    catalog = Catalog.load()
    forms = [(a.name, form) for a in catalog.of_kind("reagent") for form in (*a.synonyms_en[:1], *a.synonyms_zh[:1])]
    own = [(name, form) for name, form in forms if catalog.find(form).name == name]
    assert [(name, form) for name, form in own if name not in names(f"({form})")] == []


def test_places_of_mentions_are_places_in_the_text() -> None:
    text = "Add 5 mL of sulphuric acid to acetone/乙醇"
    assert [text[mention.start : mention.end] for mention in mentions(text, CATALOG)] == [
        "sulphuric acid",
        "acetone",
        "乙醇",
    ]


def test_folding_agrees_with_the_catalogue_and_keeps_places() -> None:
    for text in ("Büchner funnel", "H₂SO₄ (sulphuric)", "β-keto ester", "N,N-二甲基甲酰胺", ""):
        folded = Folded.of(text)
        assert folded.plain == normalize(text)
        assert len(folded.places) == len(folded.plain)


@pytest.mark.parametrize(
    "text, language",
    [
        ("Deprotect the ester with TFA", "en"),
        ("TFA, DCM, 2 h", "en"),
        ("用TFA脱去Boc", "zh"),
        ("Réduire la cétone avec le borohydrure", "unknown"),
        ("Das Keton mit NaBH4 in Methanol reduzieren", "unknown"),
        ("Reducir la benzofenona con NaBH4 en metanol", "unknown"),
        ("ケトンを還元する", "unknown"),
        ("케톤을 환원한다", "unknown"),
        ("Восстановить кетон", "unknown"),
        ("12 34 !?", "unknown"),
    ],
)
def test_languages_are_told_apart(text: str, language: str) -> None:
    assert language_of(text) == language


def test_the_same_operation_has_the_same_concept_in_other_words_and_in_chinese() -> None:
    for text in ("strip off the solvent", "rotovap it down", "evaporate", "减压旋蒸", "浓缩"):
        assert "concentrate" in concepts(text), text
    for text in ("take off the Boc group", "deprotection", "脱除Boc"):
        assert "deprotection" in concepts(text), text
    assert "reduction" in gloss("还原酮")
