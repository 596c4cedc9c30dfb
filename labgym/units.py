"""Units of quantities: their spellings, their symbols, and conversions between them.

`UNITS` lists every unit that is understood, with its spellings; `pint` knows the factors between them.

Base units: gram, milliliter, mole, degree Celsius, bar (absolute), minute, meter, megahertz.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import lru_cache
from types import MappingProxyType
from typing import Any, Literal

DROP_ML = 0.05
"""Volume of a drop, mL (20 drops per mL, the convention of pharmacopoeias)."""

Dimension = Literal["mass", "volume", "substance", "ratio", "temperature", "pressure", "time", "length", "frequency"]

BASE: Mapping[Dimension, str] = MappingProxyType(
    {
        "mass": "gram",
        "volume": "milliliter",
        "substance": "mole",
        "temperature": "degree_Celsius",
        "pressure": "bar",
        "time": "minute",
        "length": "meter",
        "frequency": "megahertz",
    }
)
"""The unit in which values of each dimension are returned; a ratio has none."""

UNITS: Mapping[Dimension, Mapping[str, tuple[str, ...]]] = MappingProxyType(
    {
        "mass": {
            "microgram": ("µg", "μg", "ug", "mcg", "微克"),
            "milligram": ("mg", "milligram", "milligrams", "毫克"),
            "gram": ("g", "gm", "gram", "grams", "gramme", "grammes", "克"),
            "kilogram": ("kg", "kilo", "kilos", "kilogram", "kilograms", "千克", "公斤"),
            "ounce": ("oz", "ounce", "ounces", "盎司"),
            "pound": ("lb", "lbs", "pound", "pounds", "磅"),
        },
        "volume": {
            "nanoliter": ("nl",),
            "microliter": ("µl", "μl", "ul", "微升"),
            "milliliter": (
                *("ml", "cc", "c.c.", "ccm", "cm3", "cm³", "milliliter", "milliliters", "millilitre", "millilitres"),
                "毫升",
            ),
            "centiliter": ("cl",),
            "deciliter": ("dl",),
            "liter": ("l", "dm3", "dm³", "liter", "liters", "litre", "litres", "升", "公升"),
            "fluid_ounce": ("fl oz", "fl. oz", "fl.oz", "fluid ounce", "fluid ounces"),
            "pint": ("pint", "pints"),
            "quart": ("quart", "quarts"),
            "gallon": ("gal", "gallon", "gallons", "加仑"),
            "drop": ("drop", "drops", "滴"),
        },
        "substance": {
            "nanomole": ("nmol",),
            "micromole": ("µmol", "μmol", "umol", "微摩尔"),
            "millimole": ("mmol", "mmols", "mmole", "mmoles", "millimole", "millimoles", "毫摩尔", "毫摩"),
            "mole": ("mol", "mole", "moles", "摩尔"),
        },
        "ratio": {
            "equivalent": ("equiv", "equivs", "equivalent", "equivalents", "eq", "eqs", "当量"),
            "mole_percent": ("mol%", "mol %", "mol-%", "mole percent", "摩尔%"),
            "weight_percent": ("wt%", "wt %", "w%", "wt.%", "wt. %", "% w/w", "%w/w"),
        },
        "temperature": {
            "degree_Celsius": (
                *("°c", "ºc", "° c", "º c", "℃", "°", "c", "deg", "deg c", "degc", "degrees", "degree c", "degrees c"),
                *("celsius", "degrees celsius", "摄氏度", "度"),
            ),
            "degree_Fahrenheit": (
                *("°f", "ºf", "° f", "º f", "℉", "f", "deg f", "degf", "degree f", "degrees f", "fahrenheit"),
                *("degrees fahrenheit", "华氏度"),
            ),
            "kelvin": ("k", "kelvin"),
        },
        "pressure": {
            "pascal": ("pa", "帕"),
            "hectopascal": ("hpa", "百帕"),
            "kilopascal": ("kpa", "千帕"),
            "megapascal": ("mpa", "兆帕"),
            "millibar": ("mbar", "毫巴"),
            "bar": ("bar", "bars", "bara", "barg", "巴"),
            "torr": ("torr", "托"),
            "mmHg": ("mmhg", "mm hg", "mm of mercury", "毫米汞柱"),
            "atmosphere": ("atm", "atmosphere", "atmospheres", "大气压", "个大气压"),
            "psi": ("psi", "psia", "psig"),
            "kpsi": ("kpsi",),
        },
        "time": {
            "second": ("s", "sec", "secs", "second", "seconds", "秒", "秒钟"),
            "minute": ("min", "mins", "minute", "minutes", "分", "分钟"),
            "hour": ("h", "hr", "hrs", "hour", "hours", "小时", "个小时", "钟头", "个钟头"),
            "day": ("d", "day", "days", "天"),
            "week": ("week", "weeks", "周", "星期"),
        },
        "length": {
            "millimeter": ("mm", "毫米"),
            "centimeter": ("cm", "厘米"),
            "meter": ("m", "meter", "meters", "metre", "metres", "米"),
            "inch": ("in", "inch", "inches"),
            "foot": ("ft", "foot", "feet"),
        },
        "frequency": {"megahertz": ("mhz",)},
    }
)
"""Spellings in lower case of each unit, by dimension and the name that `pint` has for the unit."""

SYMBOLS = MappingProxyType(
    {
        "microgram": "µg",
        "milligram": "mg",
        "gram": "g",
        "kilogram": "kg",
        "ounce": "oz",
        "pound": "lb",
        "nanoliter": "nL",
        "microliter": "µL",
        "milliliter": "mL",
        "centiliter": "cL",
        "deciliter": "dL",
        "liter": "L",
        "fluid_ounce": "fl oz",
        "pint": "pint",
        "quart": "quart",
        "gallon": "gal",
        "drop": "drops",
        "nanomole": "nmol",
        "micromole": "µmol",
        "millimole": "mmol",
        "mole": "mol",
        "equivalent": "equiv",
        "mole_percent": "mol%",
        "weight_percent": "wt%",
    }
)
"""How units of amounts are written."""

_SPELLINGS: Mapping[Dimension, Mapping[str, str]] = {
    dimension: {spelling: unit for unit, spellings in units.items() for spelling in spellings}
    for dimension, units in UNITS.items()
}
_SPACE = re.compile(r"\s")
UNITS_BY_SPELLING: Mapping[Dimension, Mapping[str, str]] = {
    dimension: {_SPACE.sub("", spelling): unit for spelling, unit in spellings.items()}
    for dimension, spellings in _SPELLINGS.items()
}
"""Units by dimension and spelling in lower case without spaces; "mm Hg" and "mmHg" are the same."""


def convert(value: float, unit: str, to: str) -> float:
    """Return a value in another unit.

    Args:
        value: in `unit`.
        unit, to: names that `pint` knows, or "drop".

    Raises:
        pint.UndefinedUnitError: a name that is not a unit.
        pint.DimensionalityError: units of different dimensions.
    """
    factor, offset = _conversion(unit, to)
    return float(f"{value * factor + offset:.12g}")


def spellings(*dimensions: Dimension) -> str:
    """Return a pattern that matches the spellings of the units of some dimensions, longest first."""
    words = {spelling for dimension in dimensions for spelling in _SPELLINGS[dimension]}
    return "|".join(re.escape(word).replace(r"\ ", r"\s*") for word in sorted(words, key=lambda s: (-len(s), s)))


def compact(spelling: str) -> str:
    """Return a spelling in lower case without spaces."""
    return _SPACE.sub("", spelling.lower())


def unit_of(spelling: str, *dimensions: Dimension) -> tuple[Dimension, str] | None:
    """Return the first of some dimensions that has a unit of that spelling, and the unit's name, or None."""
    word = compact(spelling)
    return next(((kind, UNITS_BY_SPELLING[kind][word]) for kind in dimensions if word in UNITS_BY_SPELLING[kind]), None)


@lru_cache(maxsize=256)
def _conversion(unit: str, to: str) -> tuple[float, float]:
    """Return factor and offset of a conversion."""
    zero = float(_registry().Quantity(0.0, unit).to(to).magnitude)
    return float(_registry().Quantity(1.0, unit).to(to).magnitude) - zero, zero


@lru_cache(maxsize=1)
def _registry() -> Any:
    # Importing pint and reading its definitions takes half a second, which commands without quantities need not pay.
    import pint

    registry: Any = pint.UnitRegistry(autoconvert_offset_to_baseunit=True)
    registry.define(f"drop = {DROP_ML} * milliliter")
    return registry
