"""Sizes in a text: volumes, lengths and frequencies, and which asset of a family has such a size."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, get_args

from labgym.assets.model import Asset
from labgym.quantities import value_of
from labgym.units import spellings

SIZE_TOLERANCE_SHARE = 0.05
"""Relative difference up to which two sizes count as the same: a 5 ft hood is 1.5 m wide."""

Dimension = Literal["volume", "length", "frequency"]

BEFORE, _AFTER = r"(?<![A-Za-z0-9.,-])", r"(?![A-Za-z0-9-])"
NUMBER = r"(\d{1,6}(?:[.,]\d{1,4})?)"
SIZE = re.compile(rf"{BEFORE}{NUMBER}[ -]?({spellings(*get_args(Dimension))})(s?){_AFTER}", re.IGNORECASE)
_FOOT_MARK = re.compile(r"(?<=\d)\s*['\u2032](?=\s|$)")
_INCH_MARK = re.compile(r"(?<=\d)\s*[\"\u2033](?=\s|$)")


@dataclass(frozen=True)
class StatedSize:
    """A size in a text.

    Attributes:
        written: as in the text. value: in mL, meters or MHz.
    """

    written: str
    dimension: Dimension
    value: float


def first_size(text: str) -> tuple[StatedSize | None, str]:
    """Return the first size in a text, and the text without sizes."""
    text = _INCH_MARK.sub(" in", _FOOT_MARK.sub(" ft", text))
    match = SIZE.search(text)
    if match is None:
        return None, text
    for dimension in get_args(Dimension):
        value = value_of(f"{match[1].replace(',', '.')} {match[2]}", dimension)
        if value is not None:
            return StatedSize(match[0].strip(), dimension, value), SIZE.sub(" ", text)
    return None, text


def nominal_size(asset: Asset, dimension: Dimension) -> float | None:
    """Return the size of an asset in the catalog: capacity (mL), width or diameter (m), or frequency (MHz)."""
    specs = asset.specs
    if dimension == "volume":
        liters = specs.chamber_L or specs.storage_L
        return specs.capacity_mL or (None if liters is None else 1000.0 * liters)
    if dimension == "frequency":
        return specs.proton_MHz
    if asset.kind == "facility":
        return asset.size.width
    millimeters = specs.diameter_mm or specs.jacket_mm
    return None if millimeters is None else millimeters / 1000.0


def of_size(family: Sequence[Asset], size: StatedSize) -> Asset:
    """Return the asset of a size: the same within 5 %, else the smallest that is larger, else the largest.

    If no size is known, the first of the family is returned.
    """
    sized = [(value, asset) for asset in family if (value := nominal_size(asset, size.dimension)) is not None]
    sized.sort(key=lambda pair: (pair[0], pair[1].name))
    same = [asset for value, asset in sized if _is_same(value, size.value)]
    larger = [asset for value, asset in sized if value > size.value]
    return (same or larger or [asset for _, asset in sized[-1:]] or list(family))[0]


def size_note(asset: Asset, size: StatedSize) -> str:
    """Return how an asset differs from a requested size, "" if it does not."""
    value = nominal_size(asset, size.dimension)
    if value is None:
        return f"the catalog states no size to compare with {size.written}"
    if _is_same(value, size.value):
        return ""
    if size.dimension == "frequency":
        return f"the catalog's has {value:g} MHz, not {size.written}"
    if size.dimension == "length":
        return f"the catalog's measures {_length(value)}, not {size.written}"
    return f"the catalog's holds {_volume(value)}, not {size.written}"


def _is_same(one: float, other: float) -> bool:
    return abs(one - other) <= SIZE_TOLERANCE_SHARE * other


def _volume(value: float) -> str:
    return f"{value / 1000.0:g} L" if value >= 1000.0 else f"{value:g} mL"


def _length(value: float) -> str:
    return f"{value:g} m" if value >= 0.5 else f"{1000.0 * value:g} mm"
