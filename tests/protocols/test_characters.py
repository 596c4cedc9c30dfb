"""Look-alike characters: one spelling each, before the language is judged."""

from __future__ import annotations

import pytest

from labgym.protocols.language import unified
from labgym.protocols.synthesis import synthesize
from labgym.protocols.synthesis.reading import read

PLAIN = "Add 500 μL of acetic acid in acetone, heat at 50 °C for 2-3 h, cool to -10 °C"


DEGREES = ("50 ºC", "50˚C", "50 ∘C", "50⁰C", "50 ℃", "50\u202f°C", "５０ °C", "50 oC", "50 °С")


@pytest.mark.parametrize("degree", DEGREES)
def test_a_temperature_is_read_however_its_degree_sign_is_typed(degree: str) -> None:
    text = PLAIN.replace("50 °C", degree)
    assert read(text).language == "en"
    assert 50.0 in [clause.temperature for clause in read(text).clauses]


@pytest.mark.parametrize("minus", ["−", "–", "‑", "﹣", "－"])
def test_a_minus_is_a_minus_however_it_is_typed(minus: str) -> None:
    text = PLAIN.replace("-10", f"{minus}10").replace("2-3 h", f"2{minus}3 h")
    clauses = read(text).clauses
    assert -10.0 in [clause.temperature for clause in clauses]
    assert 150.0 in [clause.duration for clause in clauses]


@pytest.mark.parametrize("micro", ["µL", "μL", "uL", "µＬ"])
def test_a_microliter_is_read_with_every_micro_sign(micro: str) -> None:
    description = read(PLAIN.replace("μL", micro))
    assert description.language == "en"
    amounts = [amount for clause in description.clauses for amount in clause.amounts.values()]
    assert amounts == ["500 µL"]


def test_ligatures_spaces_quotes_and_look_alike_letters_are_unified() -> None:
    odd = "ﬁlter the 3′‑amine,\u00a0wash\u2009with ТHF and H₂O; add\u200b 5 ㎎ of ＮａＯＨ"
    assert unified(odd) == "filter the 3'-amine, wash with THF and H2O; add 5 mg of NaOH"


def test_unifying_twice_changes_nothing_and_chinese_punctuation_stays() -> None:
    for text in ("苯酚（5 g），在80℃反应；过滤。", "10⁻³ mbar, 1—2 h — then stir", PLAIN):
        assert unified(unified(text)) == unified(text)
    assert unified("苯酚（5 g），过滤。") == "苯酚（5 g），过滤。"


def test_a_protocol_is_the_same_for_every_spelling_of_its_signs() -> None:
    text = "Acetylate salicylic acid (5 g) with acetic anhydride (10 mL) and 200 μL sulfuric acid at 60 °C for 15 min"
    odd = text.replace("μ", "µ").replace("°", "º").replace(" 15", "\u00a015")
    assert synthesize(odd, keyword_only=True).protocol == synthesize(text, keyword_only=True).protocol
