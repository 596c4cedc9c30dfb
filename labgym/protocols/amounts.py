"""Amounts as protocols write them, "8.55 g (5.9 mL), 50 mmol" or "2 x 40 mL", as numbers."""

from __future__ import annotations

import re
from dataclasses import dataclass

from labgym.assets import Asset

_NUMBER = r"(?<![\d.,])(\d{1,7}(?:[.,]\d{1,9})?)"
_VOLUME = re.compile(rf"(?:(\d{{1,3}})\s*[x×]\s*)?{_NUMBER}\s*(µl|μl|ul|ml|cl|dl|l|cm3)\b", re.I)
_MASS = re.compile(rf"(?:(\d{{1,3}})\s*[x×]\s*)?{_NUMBER}\s*(µg|μg|ug|mg|g|kg)\b", re.I)
_MOLES = re.compile(rf"{_NUMBER}\s*(nmol|µmol|μmol|umol|mmol|mol)\b", re.I)
_ICE = re.compile(rf"{_NUMBER}\s*g\s+(?:of\s+)?(?:crushed\s+)?ice\b", re.I)
_WATER = re.compile(
    rf"{_NUMBER}\s*(ml|l)\s+(?:of\s+)?(?:(?:ice|iced|cold|warm|hot|boiling|distilled|deioni[sz]ed)[\s-]*)*water\b"
    rf"|\bwater\s*\(\s*{_NUMBER}\s*(ml|l)\s*\)",
    re.I,
)
_MILLILITRES = {"µl": 1e-3, "μl": 1e-3, "ul": 1e-3, "ml": 1.0, "cm3": 1.0, "cl": 10.0, "dl": 100.0, "l": 1000.0}
_MOLE = {**dict.fromkeys(("µmol", "μmol", "umol"), 1e-6), "nmol": 1e-9, "mmol": 1e-3, "mol": 1.0}
_THOUSANDS = re.compile(r"(?<=\d),(?=\d{3}(?!\d))(?<![\d.]0,)(?<!^0,)")
_GRAMS = {"µg": 1e-6, "μg": 1e-6, "ug": 1e-6, "mg": 1e-3, "g": 1.0, "kg": 1000.0}


@dataclass(frozen=True)
class Amount:
    """How much of a reagent a protocol takes.

    Attributes:
        volume: millilitres of one portion; None where it is not stated. mass: grams of one portion.
        moles: of the whole.
        portions: how many there are, 1 unless written as "2 x 40 mL".
        ice: grams of ice that go with it.
    """

    volume: float | None = None
    mass: float | None = None
    moles: float | None = None
    portions: int = 1
    ice: float = 0.0


def read_amount(text: str) -> Amount:
    """Return what a text states; what it does not state is None."""
    text = _THOUSANDS.sub("", text)
    ice = _ICE.search(text)
    rest = _ICE.sub("", text)
    volume, mass, moles = _VOLUME.search(rest), _MASS.search(rest), _MOLES.search(rest)
    counted = volume or mass
    return Amount(
        volume=_number(volume[2]) * _MILLILITRES[volume[3].lower()] if volume else None,
        mass=_number(mass[2]) * _GRAMS[mass[3].lower()] if mass else None,
        moles=_number(moles[1]) * _MOLE[moles[2].lower()] if moles else None,
        portions=max(1, int(counted[1])) if counted and counted[1] else 1,
        ice=_number(ice[1]) if ice else 0.0,
    )


def volume_of(reagent: Asset, amount: Amount) -> float:
    """Return the millilitres that one portion fills at least.

    A stated volume counts as it is, for a solid as that of its solution; a liquid's mass by its density. Solids that
    are weighed in and gases count nothing: how much a dissolved solid fills is small and seldom known.
    """
    chemistry = reagent.chemistry
    if chemistry is None or chemistry.state == "gas":
        return 0.0
    if amount.volume is not None:
        return amount.volume + amount.ice
    if chemistry.state == "solid" or not chemistry.density:
        return amount.ice
    mass = amount.mass
    if mass is None and amount.moles is not None and chemistry.molar_mass is not None:
        mass = amount.moles * chemistry.molar_mass
    return (mass or 0.0) / chemistry.density + amount.ice


def water_in(text: str) -> float:
    """Return the millilitres of water that a step's text adds: "charge water (250 mL)", "with 50 mL of cold water"."""
    total = 0.0
    for found in _WATER.finditer(text):
        number, unit = (found[1], found[2]) if found[1] else (found[3], found[4])
        total += _number(number) * _MILLILITRES[unit.lower()]
    return total


def _number(text: str) -> float:
    return float(text.replace(",", "."))
