"""Amounts of reagents: read as protocols write them, "2 x 40 mL", scaled to a batch, and written as measured."""

from __future__ import annotations

import re
from dataclasses import dataclass
from decimal import Decimal

from labgym.assets import Asset
from labgym.protocols.errors import RefusalError
from labgym.quantities import amounts

_ICE = re.compile(r"\s*(?:of\s+)?(?:crushed\s+)?ice\b", re.IGNORECASE)
_WATER = re.compile(
    r"\s*(?:of\s+)?(?:(?:ice|iced|cold|warm|hot|boiling|distilled|deioni[sz]ed)[\s-]*)*water\b", re.IGNORECASE
)
_WATER_BEFORE, _CLOSED = re.compile(r"\bwater\s*\(\s*$", re.IGNORECASE), re.compile(r"\s*\)")
_NUMBERED = re.compile(r"(?<![\w.,%/-])\d[\d.,]*\s*([^\W\d_]{2,})(?![\w-])")
_CONCENTRATION = re.compile(r"\bof (\d{1,6}(?:\.\d{1,6})?) ?(M\b|N\b|%)")
EQUIVALENTS = {"equivalent": 1.0, "mole_percent": 0.01}
"""Equivalents in a unit of ratio."""
_NO_UNITS = frozenset(
    (
        *("in", "of", "aq", "and", "or", "to", "from", "with", "mM", "molar", "normal", "mesh", "nm", "wt", "vol"),
        *("portion", "portions", "times", "piece", "pieces", "sheet", "sheets", "pellet", "pellets"),
    )
)
"""Words after a number that are not units of an amount."""
METAL_SHARE, PALLADIUM = 0.1, 106.42
"""Share of metal in palladium on carbon; molar mass of palladium, g/mol."""
AIDS = {"adsorbent": "5 g", "drying_agent": "5 g"}
"""Amounts of aids that take no part in the reaction, by category."""
_MOLAR, _SHARE = re.compile(r"\((\d+(?:\.\d+)?) M\b"), re.compile(r"\((?:[<=]*\d+-)?(\d+)\s?%")
_ROUNDED = re.compile(r"(?<!\d)(\d+(?:\.\d+)?)(\s*mL\b)")
_SCALABLE = re.compile(r"(?<!\d)(\d+(?:\.\d+)?)(\s*(?:kg|mg|g|mmol|mol|mL|L)\b)")


@dataclass(frozen=True)
class Amount:
    """The amount of a reagent in a protocol.

    Attributes:
        volume: mL of one portion; None if it is not stated.
        mass: grams of one portion; None if it is not stated.
        moles: of all portions; None if they are not stated.
        portions: number of portions, 1 unless written as "2 x 40 mL".
        ice: grams of ice in addition.
        equivalents: moles per mole of the limiting reagent, of all portions; "5 mol%" is 0.05.
        molarity: mol/L of a solution; normality counts as molarity.
        percent: mass percent of a solution.
        unread: numbers with a unit that is not known, as written.
    """

    volume: float | None = None
    mass: float | None = None
    moles: float | None = None
    portions: int = 1
    ice: float = 0.0
    equivalents: float | None = None
    molarity: float | None = None
    percent: float | None = None
    unread: tuple[str, ...] = ()


def read_amount(text: str) -> Amount:
    """Return the amount that a text states; a value that it does not state is None."""
    quantities = amounts(text)
    ice = [item for item in quantities if item.dimension == "mass" and _ICE.match(text, item.end)]
    others = [item for item in quantities if item not in ice]
    volume = next((item for item in others if item.dimension == "volume"), None)
    mass = next((item for item in others if item.dimension == "mass"), None)
    moles = next((item for item in others if item.dimension == "substance"), None)
    ratio = next((item for item in others if item.unit in EQUIVALENTS), None)
    concentration = _CONCENTRATION.search(text)
    strong = float(concentration[1]) if concentration else None
    share = concentration is not None and concentration[2] == "%"
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
        equivalents=ratio.value * EQUIVALENTS[ratio.unit] if ratio else None,
        molarity=None if share else strong,
        percent=strong if share else None,
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
    if stated.molarity is not None and stated.volume is not None:
        return stated.volume * stated.portions * stated.molarity / 1000.0
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


def scaled(amount: str, factor: float) -> str:
    """Return an amount times a factor, rounded to three significant figures."""

    def times(match: re.Match[str]) -> str:
        return f"{figure(float(match[1]) * factor)}{match[2]}"

    return _ROUNDED.sub(rounded_volume, _SCALABLE.sub(times, amount)) if factor != 1.0 else amount


def rounded_volume(match: re.Match[str]) -> str:
    """Return a volume rounded as it is measured: to 5 mL from 20 mL on, by 1 mL from 5 mL on."""
    value = float(match[1])
    step = 5.0 if value >= 20.0 else 1.0 if value >= 5.0 else 0.5 if value >= 1.0 else 0.0
    return f"{plain(round(value / step) * step) if step else figure(value, 2)}{match[2]}"


def together(first: str, second: str) -> str:
    """Return two amounts of one reagent as one: "30 mL" and "40 mL" as "70 mL (30 mL + 40 mL)"."""
    if not first or not second or first == second:
        return first or second
    a, b = read_amount(first), read_amount(second)
    if a.volume is not None and b.volume is not None and a.portions == b.portions == 1:
        return f"{figure(a.volume + b.volume)} mL ({first} + {second})"
    if a.mass is not None and b.mass is not None and a.portions == b.portions == 1:
        return f"{figure(a.mass + b.mass)} g ({first} + {second})"
    return f"{first}, {second}"


def of_strength(amount: str, strength: str) -> str:
    """Return an amount of a solution with the strength that the text gives: "40 mL" as "40 mL of 2 M"."""
    if not strength:
        return amount
    stated = read_amount(amount)
    number, unit = strength.split()[:2]
    if unit == "M" and stated.moles is not None:
        return f"{figure(1000.0 * stated.moles / float(number))} mL of {strength}, {figure(1000.0 * stated.moles)} mmol"
    volume = re.search(r"(?<!\d)\d+(?:\.\d+)?\s*mL", amount)
    return f"{volume[0]} of {strength}" if volume is not None else f"{amount} of {strength}"


def equimolar(asset: Asset, amount: str, usual: Asset) -> str:
    """Return the amount of a reagent with as many moles as an amount of the usual one.

    Raises:
        RefusalError: the moles of the usual one are unknown, and the reagent is not one of its volume.
    """
    moles, chemistry = moles_of(usual, amount), asset.chemistry
    if asset.category in AIDS:
        return AIDS[asset.category]
    if moles is None and chemistry is not None and chemistry.state == "solid":
        raise RefusalError("unaccounted", f"the text gives no amount of {asset.name}, and none is usual: give it")
    if moles is None or chemistry is None or not chemistry.molar_mass or chemistry.state == "gas":
        return amount
    return measured(asset, moles)


def measured(asset: Asset, moles: float) -> str:
    """Return an amount in moles as mass or volume and millimoles; palladium on carbon is weighed with its support."""
    chemistry = asset.chemistry
    if chemistry is None or not chemistry.molar_mass:
        return f"{figure(moles * 1000)} mmol"
    if asset.name == "PalladiumOnCarbon":
        return f"{figure(moles * PALLADIUM / METAL_SHARE)} g, {figure(moles * 1000)} mmol Pd"
    grams = moles * chemistry.molar_mass
    millimoles = f"{figure(moles * 1000)} mmol"
    molar, share = _strength(asset)
    if molar:
        return f"{figure(1000.0 * moles / molar)} mL of {molar:g} M, {millimoles}"
    if chemistry.state == "liquid" and chemistry.density:
        return f"{figure(grams / share / chemistry.density)} mL, {millimoles}"
    return f"{figure(grams)} g, {millimoles}"


def figure(value: float, digits: int = 3) -> str:
    """Return a number with some significant figures, without trailing zeros and without an exponent."""
    return plain(float(f"{value:.{digits}g}"))


def plain(value: float) -> str:
    """Return a number without an exponent, which amounts do not have: 54900000, not 5.49e+07."""
    text = f"{value:g}"
    return format(Decimal(text), "f") if "e" in text else text


def _strength(asset: Asset) -> tuple[float | None, float]:
    """Return mol/L and the mass fraction of a reagent that is a solution, from its name: "(1 M in THF)", "(37%)"."""
    name = asset.synonyms_en[0] if asset.synonyms_en else ""
    molar, share = _MOLAR.search(name), _SHARE.search(name)
    return (float(molar[1]) if molar else None), (float(share[1]) / 100.0 if share else 1.0)
