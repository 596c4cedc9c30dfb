"""Quantities in texts, against values that were worked out by hand from the definitions of the units."""

from __future__ import annotations

import subprocess
import sys

import pytest
from hypothesis import given
from hypothesis import strategies as st

from labgym.quantities import (
    amounts,
    duration,
    durations,
    pressure,
    pressures,
    strength,
    temperature,
    temperatures,
    value_of,
)
from labgym.units import BASE, SYMBOLS, UNITS, convert


@pytest.mark.parametrize(
    "text, grams_or_millilitres",
    [
        ("60 cc methanol", 60.0),
        ("200 c.c. of water", 200.0),
        ("1/2 oz", 14.17476),
        ("1 1/2 oz", 42.52428),
        ("2½ lb", 1133.981),
        ("0.1 lb sodium carbonate", 45.35924),
        ("2 fl oz", 59.14706),
        ("1 gal", 3785.412),
        ("3 drops", 0.15),
        ("1,500 mL", 1500.0),
        ("0,5 g", 0.5),
        ("1-2 g", 1.5),
        ("20毫升", 20.0),
        ("5克", 5.0),
        ("2 公斤", 2000.0),
        ("250 µL", 0.25),
        ("0.2 dm3", 200.0),
    ],
)
def test_an_amount_is_read_in_its_unit(text: str, grams_or_millilitres: float) -> None:
    (quantity,) = amounts(text)
    assert quantity.base == pytest.approx(grams_or_millilitres, rel=1e-6)


@pytest.mark.parametrize("text, moles", [("50 mmol", 0.05), ("0.2 mol", 0.2), ("36 毫摩尔", 0.036), ("5 µmol", 5e-6)])
def test_amounts_of_substance_are_in_moles(text: str, moles: float) -> None:
    assert [quantity.base for quantity in amounts(text)] == pytest.approx([moles])


@pytest.mark.parametrize(
    "text, expected",
    [
        ("8.55 g (5.9 mL), 50 mmol", ["8.55 g", "5.9 mL", "50 mmol"]),
        ("2.40 g", ["2.40 g"]),
        ("1/2 oz", ["0.5 oz"]),
        ("5 g/50 mmol", ["5 g", "50 mmol"]),
        ("1.5 equiv, 5 mol% and 10 wt%", ["1.5 equiv", "5 mol%", "10 wt%"]),
        ("1.2当量", ["1.2 equiv"]),
        ("2 x 40 mL", ["2 x 40 mL"]),
        ("(30 mL × 3)", ["3 x 30 mL"]),
        ("3 times 20 mL", ["3 x 20 mL"]),
        ("a drop of concentrated HCl", ["1 drop"]),
        ("加入几滴盐酸", ["3 drops"]),
        ("5 滴", ["5 drops"]),
    ],
)
def test_amounts_are_written_with_the_usual_symbol(text: str, expected: list[str]) -> None:
    assert [quantity.text for quantity in amounts(text)] == expected


@pytest.mark.parametrize("text", ["2 mL/min", "5 g/L", "4-bromoanisole", "C10 g", "3 scoops", "滴加", "2 M", "500 rpm"])
def test_what_is_no_amount_is_left_out(text: str) -> None:
    assert amounts(text) == ()


def test_positions_are_those_of_the_text() -> None:
    text = "Dissolve 2.07 g of it in 20 mL, then 3 h at 60 °C and 200 mbar"
    assert [text[item.start : item.end] for item in amounts(text)] == ["2.07 g", "20 mL"]
    for found, written in ((durations(text), "3 h"), (temperatures(text), "60 °C"), (pressures(text), "200 mbar")):
        assert [text[item.start : item.end] for item in found] == [written]


@pytest.mark.parametrize(
    "text, celsius",
    [
        ("-78 °C", -78.0),
        ("353.15 K", 80.0),
        ("212 °F", 100.0),
        ("32 F", 0.0),
        ("80 degrees", 80.0),
        ("30 摄氏度", 30.0),
    ],
)
def test_temperatures_are_in_degrees_celsius(text: str, celsius: float) -> None:
    assert temperature(f"stir at {text}.") == pytest.approx(celsius)


@pytest.mark.parametrize(
    "text, bar",
    [
        ("200 bar", 200.0),
        ("20 mbar", 0.02),
        ("760 torr", 1.01325),
        ("760 mmHg", 1.01325),
        ("760 mm Hg", 1.01325),
        ("2 atm", 2.0265),
        ("100 psi", 6.894757),
        ("100 psig", 7.908007),
        ("3 barg", 4.01325),
        ("50 kPa", 0.5),
        ("1 MPa", 10.0),
        ("1013 hPa", 1.013),
        ("5个大气压", 5.06625),
    ],
)
def test_pressures_are_absolute_and_in_bar(text: str, bar: float) -> None:
    assert pressure(f"hydrogenate at {text}, then vent") == pytest.approx(bar, rel=1e-5)


@pytest.mark.parametrize("text, minutes", [("90 s", 1.5), ("2 h", 120.0), ("3 days", 4320.0), ("2周", 20160.0)])
def test_durations_are_in_minutes(text: str, minutes: float) -> None:
    assert duration(text) == pytest.approx(minutes)


@pytest.mark.parametrize("text", ["5 furlongs", "12 quux", "fast", "", "3 kg m"])
def test_an_unknown_unit_is_none_and_never_a_guess(text: str) -> None:
    assert value_of(text, "time", default="second") is None
    assert value_of(text, "pressure", default="millibar") is None


def test_a_number_alone_has_the_unit_that_the_caller_says() -> None:
    assert value_of("90", "time", default="second") == 1.5
    assert value_of("500", "pressure", default="millibar") == 0.5
    assert value_of("5", "mass") is None


@pytest.mark.parametrize(
    "text, expected",
    [("10 % NaOH", "10 %"), ("2 M NaOH", "2 M"), ("NaOH (1 mol/L)", "1 M"), ("NaOH", "")],
)
def test_the_strength_of_a_solution_is_read_before_or_after_its_name(text: str, expected: str) -> None:
    start = text.index("NaOH")
    assert strength(text, start, start + 4) == expected


@pytest.mark.parametrize("dimension", BASE)
def test_every_unit_converts_to_its_base_unit_and_back(dimension: str) -> None:
    for unit in UNITS[dimension]:  # type: ignore[index]
        there = convert(7.0, unit, BASE[dimension])  # type: ignore[index]
        assert convert(there, BASE[dimension], unit) == pytest.approx(7.0)  # type: ignore[index]


@given(st.sampled_from(sorted(SYMBOLS)), st.integers(1, 9999))
def test_an_amount_survives_being_written(unit: str, number: int) -> None:
    (quantity,) = amounts(f"{number} {SYMBOLS[unit]}")
    assert (quantity.unit, quantity.value) == (unit, number)


def test_importing_labgym_does_not_pay_for_the_registry_of_units() -> None:
    code = "import sys, labgym.protocols, labgym.protocols.amounts; sys.exit('pint' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
