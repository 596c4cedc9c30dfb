"""Which materials have a texture: pattern, period and size of the image."""

from __future__ import annotations

from dataclasses import dataclass

from labgym.assets.shapes.materials import ACCENT_PAINTS, WALL_PAINTS
from labgym.assets.textures import patterns
from labgym.assets.textures.patterns import Pattern


@dataclass(frozen=True)
class Recipe:
    """How the texture of a material is made.

    Attributes:
        pattern: of brightness and tint.
        period: side of the square that repeats, meters. size: of the image, pixels.
        contrast: strength of the pattern.
        upright: whether the pattern's rows run upwards on upright surfaces.
    """

    pattern: Pattern
    period: float
    size: int = 256
    contrast: float = 1.0
    upright: bool = False


_WOOD = Recipe(patterns.wood, 1.0, 512, upright=True)
_STEEL = Recipe(patterns.brushed_metal, 0.5)
_RESIN, _DARK = Recipe(patterns.worktop_resin, 0.5), Recipe(patterns.dark_resin, 0.5)
_LAMINATE = Recipe(patterns.laminate, 0.5, 128)

RECIPES: dict[str, Recipe] = {
    "floor_vinyl": Recipe(patterns.sheet_vinyl, 0.8),
    "floor_epoxy": Recipe(patterns.cast_resin, 2.0),
    "floor_tile": Recipe(patterns.ceramic_tiles, 1.2, 512),
    "floor_terrazzo": Recipe(patterns.terrazzo, 1.0, 512),
    "floor_concrete": Recipe(patterns.concrete, 3.0, 512),
    "ceiling": Recipe(patterns.ceiling_tiles, 1.2, 512),
    **dict.fromkeys((*WALL_PAINTS, *ACCENT_PAINTS), Recipe(patterns.painted_plaster, 1.0)),
    "epoxy_white": _RESIN,
    "worktop_gray": _RESIN,
    "worktop_sand": _RESIN,
    "epoxy_black": _DARK,
    "phenolic_black": _DARK,
    "worktop_slate": _DARK,
    "granite": Recipe(patterns.granite, 0.5, contrast=0.6),
    "oak": _WOOD,
    "front_oak": _WOOD,
    "front_walnut": _WOOD,
    "door_oak": _WOOD,
    "door_walnut": _WOOD,
    "laminate_grey": _LAMINATE,
    "laminate_white": _LAMINATE,
    "front_blue": _LAMINATE,
    "front_gray": _LAMINATE,
    "front_mint": _LAMINATE,
    "stainless": _STEEL,
    "aluminium": _STEEL,
    "cardboard": Recipe(patterns.cardboard, 0.5),
}
"""Recipes by material; other materials have an even color."""
