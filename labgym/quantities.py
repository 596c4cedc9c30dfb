"""Quantities with units, as texts in English and Chinese write them: amounts, temperatures, pressures and durations.

`labgym.units` lists the units that are understood. A function that reads one quantity returns None if the unit is not
known; one that returns all quantities of a text also returns their positions, so that the caller sees which numbers are
left over. Values are in the base units of `labgym.units`.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache

from labgym.units import BASE, SYMBOLS, UNITS_BY_SPELLING, Dimension, compact, convert, spellings, unit_of

ROOM_TEMPERATURE = 22.0
"""Meaning of "room temperature" in a text, degrees Celsius."""
ROOM_RANGE = (18.0, 30.0)
"""Temperatures, degrees Celsius, that need neither heating nor cooling."""
OVERNIGHT_MIN = 960.0
"""Meaning of "overnight" in a text, minutes."""
ATMOSPHERE_BAR = 1.01325
"""Standard atmosphere, bar; gauge pressures are above it."""

AMOUNTS: tuple[Dimension, ...] = ("mass", "volume", "substance", "ratio")
"""Dimensions that say how much of a substance is taken."""
_GAUGE = frozenset({"barg", "psig"})

_N = r"\d{1,3}(?:,\d{3})+(?:\.\d{1,9})?|\d{1,7}(?:[.,]\d{1,9})?(?:\s?[½¼¾]|\s\d/\d{1,2})?|[½¼¾]"
_NUMBER = rf"(?<![A-Za-z0-9.,-])(?:(\d{{1,2}})\s*/\s*(\d{{1,2}})(?=\s*[^\W\d])|({_N}))"
_PORTIONS = r"(?:(?<![A-Za-z0-9.,])(\d{1,3})\s*(?:[x×*]|times)\s*)?"
_AFTER_PORTIONS = r"(?:\s*[x×]\s*(\d{1,2})(?![\d.,]|\s*[A-Za-z%]))?"
_RANGE = r"(?:\s*(?:-|–|—|~|～|to|到|至)\s*(-?\d{1,4}(?:\.\d+)?))?"
_NOT_A_RATE = r"(?!\s*/\s*(?:[µμ]?l|ml|l|min|h|s|g|kg|mol|mmol)\b)"
_DROPS = re.compile(
    r"\b(a few|few|several|an?|one|two|three|four|five|six|eight|ten)\s+drops?\b"
    r"|([几数一两二三四五六七八九十])\s*滴(?!加)",
    re.IGNORECASE,
)
_STRENGTH = r"(\d{1,3}(?:\.\d+)?)\s*(%|wt\s?%|[mµμu]?M|N|m?mol/L)"
_SMALLER = {"mM": 1e-3, "µM": 1e-6, "μM": 1e-6, "uM": 1e-6}
"""Molarities in mol/L."""
_STRENGTH_BEFORE = re.compile(
    rf"(?<![A-Za-z0-9.]){_STRENGTH}\s*(?:\(?(?:aq\.?|aqueous|w/w|w/v|v/v)\)?\s*|的)?(?:dilute |cold |ice-cold )?$"
)
_STRENGTH_AFTER = re.compile(
    rf"\s*+(?:(?:solution|溶液)\s*+)?[(（]\s*+(?:[^()（）]{{0,80}}?,\s*+)?{_STRENGTH}(?![a-z])"
)
_SINGLE = re.compile(r"^\s*+(?:~|ca\.?\s*+)?([-−–+]?\d{1,9}(?:\.\d{1,9})?(?:e[-+]?\d{1,2})?)(.*)$", re.IGNORECASE)
_PLAIN = re.compile(r"\d+(?:\.\d+|,(?!\d{3}$)\d+)?|0,\d+")
_FRACTIONS = {"½": 0.5, "¼": 0.25, "¾": 0.75}
_WORDS = {
    "a": 1,
    "an": 1,
    "one": 1,
    "two": 2,
    "three": 3,
    "four": 4,
    "five": 5,
    "six": 6,
    "eight": 8,
    "ten": 10,
    "twelve": 12,
    "half a": 0.5,
    "half an": 0.5,
    "a few": 3,
    "few": 3,
    "several": 4,
    "数": 3,
    "几": 3,
    "半": 0.5,
    "一": 1,
    "二": 2,
    "两": 2,
    "三": 3,
    "四": 4,
    "五": 5,
    "六": 6,
    "七": 7,
    "八": 8,
    "九": 9,
    "十": 10,
}
_WORD = r"(?:an?|one|two|three|four|five|six|eight|ten|twelve|half an?)(?=\s)|[半一二两三四五六七八九十]{1,8}个?半?"
_NAMED_TEMPERATURES = (
    (re.compile(r"room temp|ambient|\br\.?t\.?\b|室温|常温", re.IGNORECASE), ROOM_TEMPERATURE),
    (re.compile(r"ice[ -]salt|冰盐浴", re.IGNORECASE), -10.0),
    (re.compile(r"dry[ -]ice|干冰", re.IGNORECASE), -78.0),
    (re.compile(r"\bice\b|ice[ -](?:cold|cool|bath|water)|冰水?浴|冰水|冰冷", re.IGNORECASE), 0.0),
)
_OVERNIGHT = re.compile(r"overnight|过夜", re.IGNORECASE)


@dataclass(frozen=True)
class Quantity:
    """A number with a unit, and its position in a text.

    Attributes:
        start, end: the span in the text.
        value: in the unit; of one portion.
        unit: name of the unit in `labgym.units.UNITS`.
        dimension: what the unit measures.
        portions: number of portions, 1 unless written as "2 x 40 mL".
        number: the value as written, with a decimal point; "" if it was computed, as for "1/2".
    """

    start: int
    end: int
    value: float
    unit: str
    dimension: Dimension
    portions: int = 1
    number: str = ""

    @property
    def text(self) -> str:
        """The quantity with the usual symbol of its unit, as "2 x 40 mL"."""
        number = self.number or f"{self.value:.10g}"
        symbol = "drop" if self.unit == "drop" and self.value == 1.0 else SYMBOLS[self.unit]
        return f"{self.portions} x {number} {symbol}" if self.portions > 1 else f"{number} {symbol}"

    @property
    def base(self) -> float:
        """The value of one portion in the base unit of its dimension; a ratio as it is."""
        return self.value if self.dimension == "ratio" else convert(self.value, self.unit, BASE[self.dimension])


@dataclass(frozen=True)
class StatedCondition:
    """A temperature, duration or pressure, and its position in a text.

    Attributes:
        start, end: the span in the text.
        text: as written.
        value: degrees Celsius, minutes or bar (absolute); the mean of a range.
    """

    start: int
    end: int
    text: str
    value: float


def amounts(text: str, *dimensions: Dimension) -> tuple[Quantity, ...]:
    """Return the amounts of some dimensions in a text, in order; other units are left out.

    A range counts as its mean.

    Args:
        dimensions: of `AMOUNTS`; all of them by default.
    """
    kinds = dimensions or AMOUNTS
    quantities = [*_numbered(text, kinds), *(_dropwise(text) if "volume" in kinds else ())]
    return tuple(sorted(quantities, key=lambda quantity: quantity.start))


def value_of(text: str, dimension: Dimension, default: str = "") -> float | None:
    """Return the value of a text that is one quantity, in the base unit, or None if it is not or its unit is unknown.

    Args:
        text: such as "60 mins", "10°C" or "93 mbar".
        dimension: what it measures.
        default: the unit of a number alone; without it, a number alone is not a quantity.
    """
    match = _SINGLE.match(text)
    if match is None:
        return None
    spelling = compact(match[2]).removesuffix(".")
    unit: str | None = default
    if spelling:
        unit = UNITS_BY_SPELLING[dimension].get(spelling) or _SINGLE_SPELLINGS.get((dimension, spelling))
    if not unit:
        return None
    value = float(match[1].replace("−", "-").replace("–", "-"))
    return round(_absolute(convert(value, unit, BASE[dimension]), spelling), 9)


def strength(text: str, start: int, end: int) -> str:
    """Return the concentration that a text gives the substance at a span, as "10 %" or "2 M", or ""."""
    match = _STRENGTH_BEFORE.search(text, 0, start) or _STRENGTH_AFTER.match(text, end)
    if match is None:
        return ""
    unit = match[2].replace("wt", "").replace("mol/L", "M").strip()
    if unit in _SMALLER:
        return f"{float(match[1]) * _SMALLER[unit]:g} M"
    return f"{match[1]} {unit}"


def temperatures(text: str) -> tuple[StatedCondition, ...]:
    """Return the temperatures that a text states as numbers, in degrees Celsius."""
    return tuple(_conditions(_temperature_pattern(), "temperature", text, 1))


def pressures(text: str) -> tuple[StatedCondition, ...]:
    """Return the pressures that a text states, in bar (absolute)."""
    return tuple(_conditions(_pressure_pattern(), "pressure", text, 9))


def durations(text: str) -> tuple[StatedCondition, ...]:
    """Return the durations that a text states as numbers, in minutes."""
    return tuple(_conditions(_duration_pattern(), "time", text, 2))


def temperature(text: str) -> float | None:
    """Return the first temperature of a text in degrees Celsius, or None.

    Words such as "ice bath" and "room temperature" count only if the text has no temperature as a number.
    """
    first = next(_conditions(_temperature_pattern(), "temperature", text, 1), None)
    if first is not None:
        return first.value
    return next((value for pattern, value in _NAMED_TEMPERATURES if pattern.search(text)), None)


def pressure(text: str) -> float | None:
    """Return the first pressure of a text in bar (absolute), or None."""
    first = next(_conditions(_pressure_pattern(), "pressure", text, 9), None)
    return None if first is None else first.value


def duration(text: str) -> float | None:
    """Return the first duration of a text in minutes, or None; "overnight" counts only without a number."""
    first = next(_conditions(_duration_pattern(), "time", text, 2), None)
    if first is not None:
        return first.value
    return OVERNIGHT_MIN if _OVERNIGHT.search(text) else None


def _conditions(pattern: re.Pattern[str], dimension: Dimension, text: str, digits: int) -> Iterator[StatedCondition]:
    for match in pattern.finditer(text):
        value = _spoken_number(match[1])
        if match[2]:
            value = (value + float(match[2])) / 2.0
        spelling = " ".join(match[3].lower().split())
        value = _absolute(convert(value, UNITS_BY_SPELLING[dimension][compact(spelling)], BASE[dimension]), spelling)
        yield StatedCondition(match.start(), match.end(), match[0].strip(), round(value, digits))


def _numbered(text: str, kinds: tuple[Dimension, ...]) -> Iterator[Quantity]:
    for match in _amount_pattern(kinds).finditer(text):
        before, numerator, denominator, number, upper, spelling, after = match.groups()
        unit = unit_of(spelling, *kinds)
        if unit is None:
            continue
        if numerator:
            if int(denominator) == 0:
                continue
            value = int(numerator) / int(denominator)
        else:
            value = _written_number(number)
        if upper:
            value = (value + float(upper)) / 2.0
        written = "" if upper or numerator or not _PLAIN.fullmatch(number) else number.replace(",", ".")
        portions = max(1, int(before or after or 1))
        yield Quantity(match.start(), match.end(), value, unit[1], unit[0], portions, written)


def _dropwise(text: str) -> Iterator[Quantity]:
    for match in _DROPS.finditer(text):
        word = (match[1] or match[2]).lower()
        yield Quantity(match.start(), match.end(), float(_WORDS[word]), "drop", "volume")


def _written_number(text: str) -> float:
    """Return a number: "1,500" is 1500, "0,5" and "2,25" have a decimal comma, "1 1/2" and "2½" are sums."""
    whole, _, fraction = text.strip().partition(" ")
    part = 0.0
    if fraction and "/" in fraction:
        numerator, denominator = fraction.split("/")
        part = int(numerator) / int(denominator) if int(denominator) else 0.0
    for sign, share in _FRACTIONS.items():
        if sign in text:
            part, whole = share, text.replace(sign, "").strip()
    if re.fullmatch(r"[1-9]\d{0,2}(?:,\d{3})+(?:\.\d+)?", whole):
        whole = whole.replace(",", "")
    return (float(whole.replace(",", ".")) if whole else 0.0) + part


def _spoken_number(text: str) -> float:
    word = text.lower().replace("个", "").replace("−", "-").replace("–", "-")
    if word in _WORDS:
        return _WORDS[word]
    if word[-1].isdigit():
        return float(word)
    whole, _, half = word.partition("半")
    tens, ten, ones = whole.rpartition("十")
    value = (_WORDS.get(tens, 1) * 10 if ten else 0) + _WORDS.get(ones, 0)
    return value + (0.5 if "半" in word and not half else 0.0)


def _absolute(bar: float, spelling: str) -> float:
    return round(bar + ATMOSPHERE_BAR, 9) if spelling in _GAUGE else bar


_SINGLE_SPELLINGS: Mapping[tuple[Dimension, str], str] = {
    ("time", "m"): "minute",
    ("pressure", "mm"): "mmHg",
}
"""Spellings that are clear in a field of one dimension only."""


@lru_cache(maxsize=32)
def _amount_pattern(kinds: tuple[Dimension, ...]) -> re.Pattern[str]:
    unit = rf"{_RANGE}\s*+(?:-\s*+)?({spellings(*kinds)})(?![A-Za-z]){_NOT_A_RATE}"
    return re.compile(rf"{_PORTIONS}{_NUMBER}{unit}{_AFTER_PORTIONS}", re.IGNORECASE)


@lru_cache(maxsize=1)
def _temperature_pattern() -> re.Pattern[str]:
    units = rf"({spellings('temperature')})(?![A-Za-z])"
    return re.compile(rf"(?<![A-Za-z0-9.])([-−–]?\d{{1,4}}(?:\.\d+)?){_RANGE}\s*{units}", re.IGNORECASE)


@lru_cache(maxsize=1)
def _pressure_pattern() -> re.Pattern[str]:
    units = rf"({spellings('pressure')})(?![A-Za-z])"
    return re.compile(rf"(?<![A-Za-z0-9.,-])(\d{{1,7}}(?:\.\d+)?){_RANGE}\s*{units}", re.IGNORECASE)


@lru_cache(maxsize=1)
def _duration_pattern() -> re.Pattern[str]:
    units = rf"({spellings('time')})(?![A-Za-z])"
    return re.compile(rf"(?<![A-Za-z0-9.])(\d{{1,4}}(?:\.\d+)?|{_WORD}){_RANGE}\s*{units}", re.IGNORECASE)


def plain_number(value: float) -> str:
    """Return a number without an exponent."""
    return f"{value:.9f}".rstrip("0").rstrip(".")
