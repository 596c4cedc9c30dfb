"""Amounts as they are written, and what is in the vessels step by step."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from labgym.assets import Catalog
from labgym.protocols import get, protocols
from labgym.protocols.amounts import read_amount, volume_of, water_in
from labgym.protocols.contents import situations

CATALOG = Catalog.load()


@pytest.mark.parametrize(
    ("text", "reagent", "millilitres", "portions"),
    [
        ("60 mL", "Dichloromethane", 60.0, 1),
        ("8.55 g (5.9 mL), 50 mmol", "BenzylBromide", 5.9, 1),
        ("2 x 40 mL", "DiethylEther", 40.0, 2),
        ("3 × 0,5 L", "Ethanol", 500.0, 3),
        ("500 µL", "Ethanol", 0.5, 1),
        ("10 g in 100 mL water", "SodiumHydroxide", 100.0, 1),
        ("30 mL sat. aq.", "SodiumChloride", 30.0, 1),
        ("15 mL on 100 g ice", "HydrochloricAcid", 115.0, 1),
        ("80 mL + recrystallisation", "Ethanol", 80.0, 1),
        ("9.81 g, 100 mmol", "Cyclohexanone", 9.81 / 0.948, 1),
        ("100 mmol", "Toluene", 0.1 * 92.14 / 0.867, 1),
        ("10.4 g, 75 mmol", "PotassiumCarbonate", 0.0, 1),
        ("about 1.5 L", "Hydrogen", 0.0, 1),
        ("a spatula tip", "Ethanol", 0.0, 1),
        ("", "Ethanol", 0.0, 1),
    ],
)
def test_amounts_are_read_as_a_chemist_reads_them(text, reagent, millilitres, portions):
    amount = read_amount(text)
    assert volume_of(CATALOG.get(reagent), amount) == pytest.approx(millilitres, rel=1e-3)
    assert amount.portions == portions


def test_masses_and_moles_are_read_beside_each_other():
    amount = read_amount("0.57 g, 15 mmol")
    assert (amount.mass, amount.moles, amount.volume) == (0.57, 0.015, None)
    assert read_amount("0.25 mol").moles == 0.25
    assert read_amount("20 mg").mass == pytest.approx(0.02)


@pytest.mark.parametrize(
    ("text", "millilitres"),
    [
        ("Charge water (250 mL), toluene and part of the permanganate.", 250.0),
        ("Dilute with 50 mL of cold water and 20 mL deionised water.", 70.0),
        ("Wash with water until neutral.", 0.0),
        ("Keep the water bath of 2 L warm.", 0.0),
        ("Distil off 30 mL of toluene.", 0.0),
    ],
)
def test_water_that_a_text_adds_is_counted(text, millilitres):
    assert water_in(text) == millilitres


@given(st.text(max_size=300))
def test_any_text_is_read_without_failing(text):
    amount = read_amount(text)
    assert amount.portions >= 1
    assert volume_of(CATALOG.get("Ethanol"), amount) >= 0.0
    assert water_in(text) >= 0.0


def volumes(name: str) -> dict[int, tuple[str | None, float]]:
    return {
        each.step.index: (each.vessel.name if each.vessel else None, round(each.volume, 1))
        for each in situations(get(name), CATALOG)
    }


def test_a_batch_is_followed_from_flask_to_funnel_to_rotary_evaporator():
    # Charged by hand: 60 mL of dichloromethane, 3.9 mL of acetyl chloride, 5.4 g of anisole at 0.995 g/mL; quenched on
    # 115 mL of acid and ice; one wash at a time; the water layers are gone before the solvent is.
    followed = volumes("alk_02")
    assert followed[3] == ("ThreeNeckFlask", 60.0)
    assert followed[5] == ("ThreeNeckFlask", 69.3)
    assert followed[6] == ("LargeBeaker", 184.3)
    assert followed[7] == ("SeparatoryFunnel", 60.0 + 5.4 + 115.0 + 30.0)
    assert followed[8][1] == 65.4


def test_portions_of_a_solvent_are_in_the_funnel_one_by_one_and_in_the_flask_together():
    followed = volumes("alk_04")
    assert followed[6] == ("SeparatoryFunnel", pytest.approx(40.0 + 7.6, abs=0.1))
    assert followed[7] == ("ErlenmeyerFlask", 80.0)


def test_a_weighed_reagent_is_in_no_vessel_before_it_is_added():
    for protocol in protocols().values():
        first = situations(protocol, CATALOG)[0]
        assert first.volume <= 25.0, protocol.id
