"""The product that a text states is one that the reaction gives of its reagents."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from labgym.protocols import RefusalError
from labgym.protocols.synthesis import synthesize

STATEMENTS = json.loads((Path(__file__).parent / "stated_products.json").read_text(encoding="utf-8"))
"""Texts by hand: those whose product is not what the reagents give, and those whose product is, with its name."""


@pytest.mark.cases(20)
@pytest.mark.parametrize("text", STATEMENTS["wrong"])
def test_a_product_that_the_reagents_do_not_give_is_refused(text: str) -> None:
    with pytest.raises(RefusalError) as refusal:
        synthesize(text, keyword_only=True)
    assert refusal.value.reason == "no-reaction"


@pytest.mark.cases(20)
@pytest.mark.parametrize(("text", "product"), STATEMENTS["right"])
def test_a_product_that_the_reagents_give_keeps_its_name(text: str, product: str) -> None:
    assert synthesize(text, keyword_only=True).protocol.product == product


def test_a_reagent_that_the_reaction_uses_up_is_not_the_product() -> None:
    text = (
        "Prepare the Grignard reagent from magnesium (0.6 g) and bromobenzene (3.9 g) in diethyl ether (30 mL), then "
        "add benzophenone (4.5 g) and reflux for 1 h"
    )
    assert synthesize(text, keyword_only=True).protocol.product == "the tertiary alcohol"
