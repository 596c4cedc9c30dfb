"""Amounts, temperatures and durations as people write them in English and Chinese."""

from __future__ import annotations

import re
from dataclasses import dataclass

ROOM_TEMPERATURE = 22.0
"""Meaning of "room temperature" in a text, degrees Celsius."""
ROOM_RANGE = (15.0, 30.0)
"""Temperatures, degrees Celsius, that need neither heating nor cooling."""
OVERNIGHT = 960.0

_N = r"(?<![A-Za-z0-9.])(\d{1,6}(?:[.,]\d{1,4})?)"
_UNITS = {
    **dict.fromkeys(("g", "gram", "grams", "克"), "g"),
    **dict.fromkeys(("mg", "毫克"), "mg"),
    **dict.fromkeys(("kg", "千克", "公斤"), "kg"),
    **dict.fromkeys(("ml", "毫升"), "mL"),
    **dict.fromkeys(("l", "litre", "liter", "litres", "liters", "升"), "L"),
    **dict.fromkeys(("µl", "μl", "ul", "微升"), "µL"),
    **dict.fromkeys(("mmol", "毫摩尔", "毫摩"), "mmol"),
    **dict.fromkeys(("mol", "摩尔"), "mol"),
    **dict.fromkeys(("equiv", "equivalents", "equivalent", "eq", "当量"), "equiv"),
    **dict.fromkeys(("drops", "drop", "滴"), "drops"),
}
_AMOUNT = re.compile(
    rf"{_N}\s*(?:x\s*(\d{{1,4}})\s*)?({'|'.join(sorted(_UNITS, key=len, reverse=True))})(?![a-z])\.?", re.IGNORECASE
)
_RANGE = r"(?:\s*(?:-|–|—|~|to|到|至)\s*(-?\d{1,4}(?:\.\d+)?))?"
_TEMPERATURE = re.compile(
    rf"(?<![A-Za-z0-9.])([-−–]?\d{{1,4}}(?:\.\d+)?){_RANGE}\s*(°\s*c|℃|°\s*f|℉|deg(?:rees?)?(?:\s*(?:c|celsius))?\b|c\b|k\b|°|摄氏度|度)",
    re.IGNORECASE,
)
_WORDS = r"(?:an?|one|two|three|four|five|six|eight|ten|twelve|half an?)(?=\s)|[半一二两三四五六七八九十]{1,8}个?半?"
_TIMES = r"hours?\b|hrs?\b|h\b|minutes?\b|mins?\b|seconds?\b|secs?\b|s\b|days?\b|d\b|个?小时|分钟|秒钟|秒|天"
_DURATION = re.compile(rf"(?<![A-Za-z0-9.])(\d{{1,4}}(?:\.\d+)?|{_WORDS}){_RANGE}\s*({_TIMES})", re.IGNORECASE)
_NUMBER_WORDS = {
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
_MINUTES = {"h": 60.0, "m": 1.0, "s": 1 / 60, "d": 1440.0, "小": 60.0, "分": 1.0, "秒": 1 / 60, "天": 1440.0}
_NAMED_TEMPERATURES = (
    (re.compile(r"room temp|ambient|\br\.?t\.?\b|室温|常温", re.IGNORECASE), ROOM_TEMPERATURE),
    (re.compile(r"ice[ -]salt|冰盐浴", re.IGNORECASE), -10.0),
    (re.compile(r"dry[ -]ice|干冰", re.IGNORECASE), -78.0),
    (re.compile(r"\bice\b|ice[ -](?:cold|cool|bath|water)|冰水?浴|冰水|冰冷", re.IGNORECASE), 0.0),
)
_OVERNIGHT = re.compile(r"overnight|过夜", re.IGNORECASE)


@dataclass(frozen=True)
class Quantity:
    """An amount with its place in the text, as "2.07 g"."""

    start: int
    end: int
    text: str


def amounts(text: str) -> tuple[Quantity, ...]:
    """Return the amounts in a text in order, units written alike."""
    found = []
    for match in _AMOUNT.finditer(text):
        portions = f"{match[1]} x {match[2]}" if match[2] else match[1].replace(",", ".")
        found.append(Quantity(match.start(), match.end(), f"{portions} {_UNITS[match[3].lower()]}"))
    return tuple(found)


def temperature(text: str) -> float | None:
    """Return the first temperature in degrees Celsius, the middle of a range, or None; named ones only if no number."""
    match = _TEMPERATURE.search(text)
    if match is None:
        return next((value for pattern, value in _NAMED_TEMPERATURES if pattern.search(text)), None)
    low = float(match[1].replace("−", "-").replace("–", "-"))
    value = (low + float(match[2])) / 2.0 if match[2] else low
    unit = match[3].lower().replace(" ", "")
    if unit in ("°f", "℉"):
        value = (value - 32.0) / 1.8
    elif unit == "k":
        value -= 273.15
    return round(value, 1)


def duration(text: str) -> float | None:
    """Return the first duration in minutes, the middle of a range, or None."""
    match = _DURATION.search(text)
    if match is None:
        return OVERNIGHT if _OVERNIGHT.search(text) else None
    value = _number(match[1])
    if match[2]:
        value = (value + float(match[2])) / 2.0
    unit = match[3].lower().removeprefix("个")
    return round(value * _MINUTES[unit[0]], 2)


def _number(text: str) -> float:
    word = text.lower().replace("个", "")
    if word in _NUMBER_WORDS:
        return _NUMBER_WORDS[word]
    if word[0].isdigit():
        return float(word)
    whole, _, half = word.partition("半")
    tens, ten, ones = whole.rpartition("十")
    value = (_NUMBER_WORDS.get(tens, 1) * 10 if ten else 0) + _NUMBER_WORDS.get(ones, 0)
    return value + (0.5 if "半" in word and not half else 0.0)
