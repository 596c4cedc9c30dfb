"""What a text says beside a name: amounts and sizes, concentrations, grades; and which asset has the size."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from labgym.assets.model import Asset

SAME = 0.05
"""Sizes count as the same within this share: a 5 ft hood is 1.5 m wide."""
AQUEOUS = frozenset(
    {"AmmoniumHydroxide", "DeionizedWater", "HydrazineHydrate", "HydrobromicAcid", "HydrochloricAcid", "NitricAcid"}
    | {"HydrogenPeroxide", "PerchloricAcid", "PhosphoricAcid", "SodiumHypochlorite", "TertButylHydroperoxide"}
)
"""Reagents that are solutions in water; without the water each is another substance with other hazards."""
HYDRATES = frozenset({"CopperIISulfate", "PToluenesulfonicAcid", "TinIIChloride"})

Dimension = Literal["volume", "length", "frequency"]

_BEFORE, _AFTER = r"(?<![A-Za-z0-9.,-])", r"(?![A-Za-z0-9-])"
_NUMBER = r"(\d{1,6}(?:[.,]\d{1,4})?)"
_VOLUMES = {"ul": 1e-3, "ml": 1.0, "cc": 1.0, "cm3": 1.0, "cl": 10.0, "dl": 100.0, "l": 1e3}
_VOLUMES |= {"millilitre": 1.0, "milliliter": 1.0, "litre": 1e3, "liter": 1e3, "毫升": 1.0, "升": 1e3}
_LENGTHS = {"mm": 1e-3, "cm": 1e-2, "m": 1.0, "metre": 1.0, "meter": 1.0, "ft": 0.3048, "foot": 0.3048, "feet": 0.3048}
_LENGTHS |= {"in": 0.0254, "inch": 0.0254, "毫米": 1e-3, "厘米": 1e-2, "米": 1.0}
_DIMENSIONS: tuple[tuple[Dimension, dict[str, float]], ...] = (
    ("volume", _VOLUMES),
    ("length", _LENGTHS),
    ("frequency", {"mhz": 1.0}),
)
_UNIT = "|".join(sorted({"cm³", *(unit for _, units in _DIMENSIONS for unit in units)}, key=len, reverse=True))
_SIZE = re.compile(rf"{_BEFORE}{_NUMBER}[ -]?({_UNIT})(s?){_AFTER}", re.IGNORECASE)
_STRENGTH = re.compile(
    rf"{_BEFORE}{_NUMBER}(?:\s*-\s*{_NUMBER})?\s*(?:(?:wt|vol|w/w|w/v|v/v)?\.?\s*%(?:\s*(?:w/w|w/v|v/v|wt|vol))?"
    r"|(?:m?mol/l|mm|m|n|kg|mg|ug|g|m?mol|equiv\.?|eq\.?|Å|克|毫克|千克)(?![A-Za-z0-9-]))",
    re.IGNORECASE,
)
_DRY = r"anhydrous|anhyd|anh|dry|dried"
_FORM = r"powdered|powder|pellets?|crystals?|granules|granular|flakes|gas"
_QUALITY = re.compile(
    r"(?<![A-Za-z0-9-])(?:(?:hplc|lc-?ms|acs|gc|ar|reagent|analytical|technical|laboratory|lab|spectroscopic|synthesis|usp)"
    rf"[ -]grade|{_DRY}|concentrated|concd|conc|diluted?|dil|saturated|satd|sat'd|sat|aqueous|aq|solution|soln|absolute"
    r"|abs|pure|purified|distilled|degassed|ice-cold|cold|technical|tech|glass-distilled|activated|cp|gr|ar|of)(?![A-Za-z0-9-])\.?"
    rf"|(?<![A-Za-z0-9-])(?:{_FORM})(?![A-Za-z0-9-])|\((?:aq|s|l|g|hplc|ar|cp)\)|\(?\d{{2,4}}(?:-\d{{2,4}})?\s*(?:mesh|目)\)?",
    re.IGNORECASE,
)
_QUALITY_ZH = re.compile(
    r"^(?:无水|干燥的|饱和|浓|稀|分析纯|化学纯|色谱纯|优级纯)+|(?:水溶液|溶液|[(\uff08]?(?:分析纯|化学纯|色谱纯|优级纯)[)\uff09]?)+$"
)
_MEDIUM = re.compile(
    r"\s+in\s+(?:mineral oil|oil|water|hexanes?|heptanes?|toluene|thf|(?:1,4-)?dioxane|(?:diethyl )?ether|et2o|dcm|meoh"
    r"|methanol|etoh|ethanol|acetonitrile|mecn)\)?\s*$",
    re.IGNORECASE,
)
_ANY = re.compile(
    r"\b(?:lab|laboratory|instrument|machine|device|unit|equipment|pyrex|duran|ika|b(?:ü|u|ue)chi)\b|\(\s*\)",
    re.IGNORECASE,
)
_CAS = re.compile(r"^\s*cas(?:[ -]?(?:no|nr|rn|number))?[.:#\s]*(?=\d{2,7}-\d{2}-\d\s*$)", re.IGNORECASE)
_WITHOUT_WATER = re.compile(rf"^(?:{_DRY}|{_FORM})\b|^\([sg]\)|无水|干燥|^in (?!water)", re.IGNORECASE)


@dataclass(frozen=True)
class Measure:
    """A size that a text gives.

    Attributes:
        written: as in the text. value: in mL, metres or MHz.
    """

    written: str
    dimension: Dimension
    value: float


@dataclass(frozen=True)
class Reading:
    """A text without what it says beside a name.

    Attributes:
        rest: what is left for the name. aside: what was set aside, as written.
    """

    rest: str
    aside: tuple[str, ...]

    @property
    def without_water(self) -> bool:
        """Whether it asks for a substance dry, or dissolved in something other than water."""
        return any(_WITHOUT_WATER.search(words) for words in self.aside)


def measure(text: str) -> tuple[Measure | None, str]:
    """Return the first size that a text gives, and the text without any."""
    found = _SIZE.search(text)
    if found is None:
        return None, text
    number, unit = float(found[1].replace(",", ".")), unicodedata.normalize("NFKD", found[2]).lower()
    dimension, units = next(pair for pair in _DIMENSIONS if unit in pair[1])
    return Measure(found[0].strip(), dimension, number * units[unit]), _SIZE.sub(" ", text)


def of_substance(text: str) -> tuple[Reading, Reading]:
    """Set aside the amounts and concentrations that a text gives of a substance, and then its grade too."""
    aside: list[str] = []

    def put(found: re.Match[str]) -> str:
        aside.append(found[0].strip())
        return " "

    rest = _CAS.sub("", text)
    for pattern in (_STRENGTH, _SIZE):
        rest = pattern.sub(put, rest)
    if aside:
        rest = _MEDIUM.sub(put, rest)
    amounts = Reading(rest, tuple(aside))
    for pattern in (_QUALITY, _QUALITY_ZH):
        rest = pattern.sub(put, rest.strip())
    return amounts, Reading(rest, tuple(aside))


def of_equipment(text: str) -> str:
    """Set aside the words that may stand beside the name of any equipment."""
    return _ANY.sub(" ", text)


def held(asset: Asset, dimension: Dimension) -> float | None:
    """Return what the catalogue says of an asset's size: what it holds in mL, its width or diameter in metres, MHz."""
    specs = asset.specs
    if dimension == "volume":
        litres = specs.chamber_L or specs.storage_L
        return specs.capacity_mL or (None if litres is None else 1000.0 * litres)
    if dimension == "frequency":
        return specs.proton_MHz
    if asset.kind == "facility":
        return asset.size.width
    millimetres = specs.diameter_mm or specs.jacket_mm
    return None if millimetres is None else millimetres / 1000.0


def of_size(family: Sequence[Asset], wanted: Measure) -> Asset:
    """Return the asset of a wanted size: the same within 5 %, else the smallest that is larger, else the largest.

    Where no size is known, the first.
    """
    sized = [(value, asset) for asset in family if (value := held(asset, wanted.dimension)) is not None]
    sized.sort(key=lambda pair: (pair[0], pair[1].name))
    same = [asset for value, asset in sized if _same(value, wanted.value)]
    larger = [asset for value, asset in sized if value > wanted.value]
    return (same or larger or [asset for _, asset in sized[-1:]] or list(family))[0]


def difference(asset: Asset, wanted: Measure) -> str:
    """Return in what an asset differs from a wanted size, "" where it does not."""
    value = held(asset, wanted.dimension)
    if value is None:
        return f"the catalogue gives it no size to compare with {wanted.written}"
    if _same(value, wanted.value):
        return ""
    if wanted.dimension == "frequency":
        return f"the catalogue's one has {value:g} MHz, not {wanted.written}"
    if wanted.dimension == "length":
        return f"the catalogue's one measures {_length(value)}, not {wanted.written}"
    return f"the catalogue's one holds {_volume(value)}, not {wanted.written}"


def _same(one: float, other: float) -> bool:
    return abs(one - other) <= SAME * other


def _volume(value: float) -> str:
    return f"{value / 1000.0:g} L" if value >= 1000.0 else f"{value:g} mL"


def _length(value: float) -> str:
    return f"{value:g} m" if value >= 0.5 else f"{1000.0 * value:g} mm"
