"""Amounts of reagents as protocols write them: "8.55 g (5.9 mL), 50 mmol" or "2 x 40 mL"."""

from __future__ import annotations

import re
from dataclasses import dataclass

from labgym.assets import Asset
from labgym.quantities import amounts

_ICE = re.compile(r"\s*(?:of\s+)?(?:crushed\s+)?ice\b", re.IGNORECASE)
_WATER = re.compile(
    r"\s*(?:of\s+)?(?:(?:ice|iced|cold|warm|hot|boiling|distilled|deioni[sz]ed)[\s-]*)*water\b", re.IGNORECASE
)
_WATER_BEFORE, _CLOSED = re.compile(r"\bwater\s*\(\s*$", re.IGNORECASE), re.compile(r"\s*\)")
_NUMBERED = re.compile(r"(?<![\w.,%/-])\d[\d.,]*\s*([^\W\d_]{2,})(?![\w-])")
_MOLARITY = re.compile(r"\bof (\d+(?:\.\d+)?) [MN]\b")
_NO_UNITS = frozenset(
    (
        *("in", "of", "aq", "and", "or", "to", "from", "with", "mM", "molar", "normal", "mesh", "nm", "wt", "vol"),
        *("portion", "portions", "times", "piece", "pieces", "sheet", "sheets", "pellet", "pellets"),
    )
)
"""Words after a number that are not units of an amount."""


@dataclass(frozen=True)
class Amount:
    """How much of a reagent a protocol takes.

    Attributes:
        volume: mL of one portion; None if it is not stated.
        mass: grams of one portion; None if it is not stated.
        moles: of all portions; None if they are not stated.
        portions: number of portions, 1 unless written as "2 x 40 mL".
        ice: grams of ice in addition.
        unread: numbers with a unit that is not known, as written.
    """

    volume: float | None = None
    mass: float | None = None
    moles: float | None = None
    portions: int = 1
    ice: float = 0.0
    unread: tuple[str, ...] = ()


def read_amount(text: str) -> Amount:
    """Return the amount that a text states; a value that it does not state is None."""
    quantities = amounts(text)
    ice = [item for item in quantities if item.dimension == "mass" and _ICE.match(text, item.end)]
    others = [item for item in quantities if item not in ice]
    volume = next((item for item in others if item.dimension == "volume"), None)
    mass = next((item for item in others if item.dimension == "mass"), None)
    moles = next((item for item in others if item.dimension == "substance"), None)
    portioned = volume or mass
    rest = text
    for item in quantities:
        rest = rest[: item.start] + " " * (item.end - item.start) + rest[item.end :]
    return Amount(
        volume=volume.base if volume else None,
        mass=mass.base if mass else None,
        moles=moles.base if moles else None,
        portions=portioned.portions if portioned else 1,
        ice=ice[0].base if ice else 0.0,
        unread=tuple(match[0] for match in _NUMBERED.finditer(rest) if match[1] not in _NO_UNITS),
    )


def volume_of(reagent: Asset, amount: Amount) -> float:
    """Return the smallest volume in mL that one portion can fill.

    A stated volume counts as it is (for a solid, that of its solution), a liquid's mass by its density. Gases and
    solids that are weighed in count as zero, because the volume of a dissolved solid is small and seldom known.
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


def moles_of(asset: Asset, amount: str) -> float | None:
    """Return the moles in an amount of a reagent, or None if they cannot be known."""
    stated, chemistry = read_amount(amount), asset.chemistry
    if stated.moles is not None:
        return stated.moles
    molarity = _MOLARITY.search(amount)
    if molarity is not None and stated.volume is not None:
        return stated.volume * stated.portions * float(molarity[1]) / 1000.0
    if chemistry is None or not chemistry.molar_mass:
        return None
    if stated.mass is not None:
        return stated.mass / chemistry.molar_mass
    if stated.volume is None or chemistry.state != "liquid" or chemistry.density is None:
        return None
    return stated.volume * chemistry.density / chemistry.molar_mass


def water_in(text: str) -> float:
    """Return the mL of water that a step's text adds: "charge water (250 mL)", "with 50 mL of cold water"."""
    return sum(
        item.base
        for item in amounts(text, "volume")
        if _WATER.match(text, item.end) or (_WATER_BEFORE.search(text[: item.start]) and _CLOSED.match(text, item.end))
    )
