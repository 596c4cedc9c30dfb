"""What is understood of a description: amounts, temperatures, durations, clauses, products, unlisted substances."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from labgym.assets import Catalog
from labgym.protocols import protocols
from labgym.protocols.language import mentions, unified
from labgym.protocols.synthesis import read
from labgym.protocols.synthesis.operations import main_operation
from labgym.protocols.synthesis.unlisted import unlisted
from labgym.quantities import amounts, duration, temperature

CATALOG = Catalog.load()


@pytest.mark.parametrize(
    "text, expected",
    [
        ("at -78 °C", -78.0),
        ("0-5 °C", 2.5),
        ("60–65 ℃", 62.5),
        ("at 80 degrees", 80.0),
        ("353.15 K", 80.0),
        ("212 °F", 100.0),
        ("室温", 22.0),
        ("冷却至0度", 0.0),
        ("in an ice bath", 0.0),
        ("at rt", 22.0),
        ("stir well", None),
        ("2 c portions of 4 mL", None),
    ],
)
def test_temperatures_are_read_in_degrees_celsius(text: str, expected: float | None) -> None:
    if text.startswith("2 c"):
        assert duration(text) is None
    else:
        assert temperature(text) == pytest.approx(expected)


@pytest.mark.parametrize(
    "text, minutes",
    [
        ("for 2 h", 120.0),
        ("1.5 hours", 90.0),
        ("half an hour", 30.0),
        ("for two hours", 120.0),
        ("45 s", 0.75),
        ("1-2 h", 90.0),
        ("3 days", 4320.0),
        ("overnight", 960.0),
        ("两小时", 120.0),
        ("三十分钟", 30.0),
        ("回流3.5小时", 210.0),
        ("半小时", 30.0),
        ("过夜", 960.0),
        ("one and a half", None),
    ],
)
def test_durations_are_read_in_minutes(text: str, minutes: float | None) -> None:
    assert duration(text) == (None if minutes is None else pytest.approx(minutes))


def test_amounts_are_read_with_their_units_in_both_languages() -> None:
    text = "2.07 g, 10 mmol; 3 x 20 mL; 加入5毫升; 1.2当量; 0.5 克; 3 drops; 25 mg"
    assert [item.text for item in amounts(text)] == [
        *("2.07 g", "10 mmol", "3 x 20 mL", "5 mL", "1.2 equiv", "0.5 g", "3 drops", "25 mg")
    ]


def test_amounts_go_to_the_substance_they_stand_at() -> None:
    reading = read("Reduce benzophenone (3.64 g, 20 mmol) with 0.57 g of NaBH4 in 40 mL methanol")
    given = {name: text for clause in reading.clauses for name, text in clause.amounts.items()}
    assert given == {"Benzophenone": "3.64 g, 20 mmol", "SodiumBorohydride": "0.57 g", "Methanol": "40 mL"}
    reading = read("将水杨酸（5克，36 mmol）加入10毫升醋酐")
    given = {name: text for clause in reading.clauses for name, text in clause.amounts.items()}
    assert given == {"SalicylicAcid": "5 g, 36 mmol", "AceticAnhydride": "10 mL"}


def test_what_is_only_taken_away_is_no_reagent() -> None:
    reading = read("Cyclohexanone with glycol in toluene, azeotropic removal of water 5 h")
    assert "DeionizedWater" not in reading.spoken_of


def test_salts_before_a_solvent_are_read_as_two_in_chinese() -> None:
    reading = read("苯乙酮与苯甲醛在氢氧化钠乙醇溶液中反应")
    assert {"SodiumHydroxide", "Ethanol", "Acetophenone", "Benzaldehyde"} <= reading.spoken_of
    assert reading.unlisted == ()


def test_a_cold_addition_and_a_stretch_at_another_temperature_are_two_clauses() -> None:
    reading = read("Couple benzoic acid and benzylamine with EDC in DCM at 0 °C then room temperature overnight")
    assert [(clause.temperature, clause.duration) for clause in reading.clauses] == [(0.0, None), (22.0, 960.0)]


def test_clauses_follow_the_operations() -> None:
    text = "Dissolve phenol in acetone, reflux for 5 h, filter, wash with 2 M NaOH, dry over Na2SO4 and recrystallise"
    actions = [clause.operation.action for clause in read(text).clauses if clause.operation]
    assert actions == ["Dissolve", "Reflux", "Filter", "Wash", "DrySolution", "Recrystallize"]
    text = "溶于二氯甲烷，室温搅拌2小时，碳酸氢钠中和，乙酸乙酯萃取，无水硫酸镁干燥，旋蒸，柱层析，液相检测"
    actions = [clause.operation.action for clause in read(text).clauses if clause.operation]
    assert actions == [
        *("Dissolve", "Stir", "Quench", "Extract", "DrySolution", "Concentrate", "Chromatograph", "Analyze")
    ]


@pytest.mark.parametrize(
    "text, action",
    [
        ("concentrated hydrochloric acid", None),
        ("wash the combined organic extracts", "Wash"),
        ("take the melting point", "Analyze"),
        ("check by gas chromatography", "Analyze"),
        ("pour onto ice", "Quench"),
        ("dry the solid in an oven", "DrySolid"),
        ("boiling point", None),
    ],
)
def test_words_that_look_like_operations_are_told_from_them(text: str, action: str | None) -> None:
    found = main_operation(text)
    assert (found.action if found else None) == action


@pytest.mark.parametrize(
    "text, product",
    [
        ("Prepare benzyl phenyl ether from phenol and benzyl bromide", "benzyl phenyl ether"),
        ("Oxidise cyclohexanol to cyclohexanone with bleach", "cyclohexanone"),
        ("React aniline with benzoyl chloride to give benzanilide", "benzanilide"),
        ("由苯甲酸和氯化亚砜制备苯甲酰氯，蒸馏", "苯甲酰氯"),
        ("Isoamyl acetate (banana oil): reflux isoamyl alcohol with acetic acid", "Isoamyl acetate"),
        ("1-bromobutane to butyl azide with sodium azide", "butyl azide"),
        ("Heat the mixture to 80 C with aniline", ""),
        ("Prepare a solution of phenol in acetone", ""),
    ],
)
def test_the_product_is_no_reagent(text: str, product: str) -> None:
    reading = read(text)
    assert reading.product == product
    assert reading.unlisted == ()
    named = {name for clause in reading.clauses for name in clause.names("reagent")}
    assert "Cyclohexanone" not in named
    assert not product or "BenzoylChloride" not in named or "benzanilide" in product


@pytest.mark.parametrize(
    "text, expected",
    [
        ("acylate 4-bromoaniline", ["4-bromoaniline"]),
        ("add sodium fluoride and allyl bromide", ["sodium fluoride", "allyl bromide"]),
        ("OsO4, vanillin and 4-nitrobenzoic acid", ["OsO4", "vanillin", "4-nitrobenzoic acid"]),
        ("将对溴苯胺与氟化钾反应", ["对溴苯胺", "氟化钾"]),
        ("an amine, a ketone and the organic extracts; determine, separate, combine", []),
        ("SN2 in DMF, then TLC and NMR", []),
    ],
)
def test_substances_that_the_catalogue_lacks_are_found(text: str, expected: list[str]) -> None:
    assert [text[start:end] for start, end in unlisted(text, mentions(text, CATALOG))] == expected


STRANGE = {"carbon dioxide", "copper", "copper chloride", "hydrazine", "peroxide", "silanol", "chlorosilane"}


def test_the_steps_of_published_protocols_name_hardly_any_unlisted_reagent() -> None:
    """The remaining short forms are ambiguous: a description has to say which substance it means."""
    strange: set[str] = set()
    for protocol in protocols().values():
        text = " ".join(step.text for step in protocol.steps)
        strange |= {text[start:end] for start, end in unlisted(text, mentions(text, CATALOG))}
    assert strange <= STRANGE


@settings(max_examples=60, deadline=None)
@given(st.text(max_size=200))
def test_any_text_is_read_without_failing(text: str) -> None:
    reading = read(text)
    assert reading.text == unified(text)
    for clause in reading.clauses:
        for mention in clause.mentions:
            assert reading.text[mention.start : mention.end] == mention.text


@pytest.mark.parametrize(
    ("text", "unlisted"),
    [
        ("Wash with 0.01 M EDTA", "EDTA"),
        ("Wash with 0.5M EDTA", "EDTA"),
        ("Wash with 2 N HATU", "HATU"),
        ("Wash with 5 mmol/L EDTA", "EDTA"),
        ("Heat at 80 C with Pd EDTA", "Pd EDTA"),
    ],
)
def test_a_unit_before_an_unknown_name_is_not_part_of_it(text: str, unlisted: str) -> None:
    assert read(text).unlisted == (unlisted,)


@pytest.mark.parametrize(
    ("text", "concentration"), [("10 mM HCl", "0.01 M"), ("5 mmol/L HCl", "0.005 M"), ("2 M HCl", "2 M")]
)
def test_a_concentration_in_millimoles_per_liter_is_read(text: str, concentration: str) -> None:
    assert read(f"Wash with {text}").clauses[0].strengths == {"HydrochloricAcid": concentration}
