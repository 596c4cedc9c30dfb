"""Quantities as files write them, "60 mins", "10°C", "93 mbar", in the units of experiments."""

from __future__ import annotations

import re

_QUANTITY = re.compile(r"^\s*(?:~|ca\.?\s*)?([-−+]?\d{1,9}(?:\.\d{1,9})?(?:e[-+]?\d{1,2})?)\s*([^\d\s]*)\s*$", re.I)
_MINUTES = {
    **dict.fromkeys(("s", "sec", "secs", "second", "seconds"), 1.0 / 60.0),
    **dict.fromkeys(("m", "min", "mins", "minute", "minutes"), 1.0),
    **dict.fromkeys(("h", "hr", "hrs", "hour", "hours"), 60.0),
    **dict.fromkeys(("d", "day", "days"), 1440.0),
}
_BAR = {
    **dict.fromkeys(("torr", "mmhg", "mm"), 1.01325 / 760.0),
    "mbar": 1e-3,
    "bar": 1.0,
    "kpa": 0.01,
    "pa": 1e-5,
    "atm": 1.01325,
    "psi": 0.0689476,
    "kpsi": 68.9476,
}


def minutes(text: str, plain: float = 1.0 / 60.0) -> float | None:
    """Return a duration in minutes, or None where it is none; a number alone counts `plain` minutes, one second."""
    return _scaled(text, _MINUTES, plain)


def bar(text: str, plain: float = 1e-3) -> float | None:
    """Return a pressure in bar, or None where it is none; a number alone counts `plain` bar, one mbar."""
    return _scaled(text, _BAR, plain)


def celsius(text: str) -> float | None:
    """Return a temperature in degrees Celsius, or None where it is none; a number alone is in degrees Celsius."""
    found = _QUANTITY.match(text)
    if found is None:
        return None
    value, unit = _number(found[1]), found[2].lower().replace("°", "").replace("º", "").replace("℃", "c")
    if unit in ("", "c"):
        return value
    if unit == "k":
        return round(value - 273.15, 6)
    return round((value - 32.0) / 1.8, 6) if unit == "f" else None


def _scaled(text: str, units: dict[str, float], plain: float) -> float | None:
    found = _QUANTITY.match(text)
    if found is None:
        return None
    factor = units.get(found[2].lower()) if found[2] else plain
    return None if factor is None else round(_number(found[1]) * factor, 9)


def _number(text: str) -> float:
    return float(text.replace("−", "-"))
