"""Dangerous, impossible and senseless requests are refused; ordinary ones are written."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from labgym.errors import LabgymError
from labgym.protocols import RefusalError
from labgym.protocols.language.vocabulary import unknown_measures
from labgym.protocols.refusals import refuse_wish
from labgym.protocols.synthesis import synthesize

REQUESTS = json.loads((Path(__file__).parent / "requests.json").read_text(encoding="utf-8"))
"""By hand: explosives, weapons and drugs by name, synonym, formula, SMILES or misspelled; pairs that react violently;
wrong products and units; and harmless requests."""


@pytest.mark.parametrize("text", REQUESTS["dangerous"])
def test_a_dangerous_request_is_refused_in_one_line(text: str) -> None:
    with pytest.raises(LabgymError) as refusal:
        synthesize(text, keyword_only=True)
    assert "\n" not in str(refusal.value)


@pytest.mark.cases(30)
@pytest.mark.parametrize("text", REQUESTS["harmless"])
def test_a_harmless_request_is_written(text: str) -> None:
    assert synthesize(text, keyword_only=True).protocol.steps


@pytest.mark.parametrize(
    "name",
    [
        *("T.N.T.", "ΤΝΤ", "nitro glycerin", "n1troglycerin", "nitroglicerin", "nitrogylcerin", "trinitro-toluene"),
        *("nitrо-cellulose", "meth-amphetamine", "amphetamlne", "methamfetamine", "C3H5N3O9", "Pb(N3)2", "COCl2", "GB"),
        *("triacetone triperoxide", "yperite", "hexogen", "梯恩梯", "4-hydroxybutanoic acid"),
    ],
)
def test_a_name_is_recognized_however_it_is_written(name: str) -> None:
    with pytest.raises(RefusalError) as refusal:
        refuse_wish(f"Prepare {name} in a flask.")
    assert refusal.value.reason == "unsafe"


@pytest.mark.parametrize(
    "name",
    [
        *("phenethylamine", "acetophenone", "epinephrine", "nitrobenzene", "HCl", "NaCl", "C6H6", "triglycerides"),
        *(
            "phenylacetate",
            "glycerin",
            "cellulose acetate",
            "trimethyltoluene",
            "acetone, peroxide-free",
            "mustard gloves",
        ),
    ],
)
def test_a_harmless_name_is_not_taken_for_a_dangerous_one(name: str) -> None:
    refuse_wish(f"Use {name} in a flask.")


@pytest.mark.parametrize("text", ["phenol (5 V)", "stir for 3 furlongs.", "acetone (5 lumens)"])
def test_a_unit_that_is_not_known_is_reported(text: str) -> None:
    assert unknown_measures(text)


@pytest.mark.parametrize("text", ["phenol (5 g)", "stir for 3 h.", "NMR (400 MHz)", "water (3 portions)", "HCl (2 M)"])
def test_a_known_unit_is_not_reported(text: str) -> None:
    assert unknown_measures(text) == ()
