"""Colors of pictures and reports by category of object, storage class and policy."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from PIL import ImageFont

from labgym.assets import Asset

INK = "#23282d"
MUTED = "#6b7278"
WALL = "#3d444b"
FLOOR = "#faf9f6"
GRID = "#e9e7e1"
DOOR = "#a9885f"
HEAT = "#d1420f"
FLAME = "#b3001b"
ALARM = "#e0002d"


@dataclass(frozen=True)
class Swatch:
    """A legend entry: label, fill color and edge color."""

    label: str
    fill: str
    edge: str


BENCH = Swatch("bench or table", "#e6d9bf", "#a68f63")
HOOD = Swatch("fume hood, glove box", "#c3dcea", "#5f8fae")
STORAGE = Swatch("storage cabinet", "#dcdfe3", "#7f8891")
COLD = Swatch("cold storage", "#d5ebee", "#6a9ea6")
SAFETY = Swatch("safety equipment", "#cde8c6", "#5f9a52")
WASTE = Swatch("waste", "#e7cfc6", "#a4705d")
OTHER = Swatch("other equipment", "#e2dcec", "#83779b")
INSTRUMENT = Swatch("instrument on a surface", "#ffffff", "#59626b")
GLASS = Swatch("glassware", "#e3f4f7", "#4f96a3")

_BY_CATEGORY = {
    "furniture": BENCH,
    "containment": HOOD,
    "storage": STORAGE,
    "cold_storage": COLD,
    "safety_equipment": SAFETY,
    "waste": WASTE,
}

# The usual colors of safety cabinets; those of hazard diamonds for classes without a usual cabinet color.
STORAGE_COLORS = {
    "Flammable": "#f0b400",
    "Acid": "#2f6fb7",
    "Base": "#7b4fa3",
    "Oxidizer": "#e36c0a",
    "Toxic": "#3f8f46",
    "WaterReactive": "#c2185b",
    "Refrigerator": "#4aa3b5",
    "Gas": "#7a8b99",
    "General": "#8d8d8d",
    "Glassware": "#4f96a3",
    "Waste": "#8a5a44",
}

# Okabe and Ito's palette, distinguishable with any color vision.
_POLICY_COLORS = ("#0072b2", "#d55e00", "#7d8790", "#cc79a7", "#009e73", "#e69f00", "#56b4e9")


def swatch(asset: Asset) -> Swatch:
    """Return the swatch that an object is drawn with."""
    if asset.fume_hood:
        return HOOD
    if asset.kind == "instrument":
        return GLASS if asset.hazards.glass_container else INSTRUMENT
    return _BY_CATEGORY.get(asset.category, OTHER)


def policy_colors(policies: Sequence[str]) -> dict[str, str]:
    """Return a color for each policy, by its index in the sequence."""
    return {policy: _POLICY_COLORS[index % len(_POLICY_COLORS)] for index, policy in enumerate(policies)}


@cache
def font(size: int, bold: bool = False) -> ImageFont.FreeTypeFont:
    """Return DejaVu Sans in a size, pixels."""
    from matplotlib import get_data_path

    name = "DejaVuSans-Bold.ttf" if bold else "DejaVuSans.ttf"
    return ImageFont.truetype(str(Path(get_data_path()) / "fonts" / "ttf" / name), size)


def rgb(color: str) -> tuple[int, int, int]:
    """Return the parts of a color such as #0f6fb5, 0 to 255."""
    red, green, blue = (int(color[k : k + 2], 16) for k in (1, 3, 5))
    return red, green, blue
