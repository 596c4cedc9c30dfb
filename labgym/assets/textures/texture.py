"""The texture of a material: an image that repeats, whose mean is the color; and the recipe of each texture."""

from __future__ import annotations

import io
import zlib
from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from labgym.assets.shapes.materials import ACCENT_PAINTS, MATERIALS, WALL_PAINTS
from labgym.assets.textures import patterns
from labgym.assets.textures.patterns import Field, Pattern


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


COMPRESSION = 6
"""Of PNG files: 9 takes ten times as long for a tenth less."""
ROUNDS = 6
"""Corrections of the mean after clipping to the range of colors."""


@dataclass(frozen=True, eq=False)
class Texture:
    """An image that repeats over a surface.

    Attributes:
        name: material that it belongs to.
        pixels: (size, size, 3) uint8, sRGB; size is a power of two. The first row is at the greatest v.
        period: side of the square that the image covers, meters.
        upright: whether rows of the image run upwards on upright surfaces, as the grain of fronts does.
    """

    name: str
    pixels: NDArray[np.uint8]
    period: float
    upright: bool

    @property
    def linear(self) -> Field:
        """The image in linear light, shape (size, size, 3)."""
        return decoded(self.pixels)

    @cached_property
    def png(self) -> bytes:
        """The image as a PNG file; equal textures give equal bytes."""
        stream = io.BytesIO()
        Image.fromarray(self.pixels).save(stream, "png", compress_level=COMPRESSION)
        return stream.getvalue()


@cache
def texture(material: str) -> Texture | None:
    """Return the texture of a material, or None if its surface has one even color.

    It is drawn from a random generator whose seed is the material's name.
    """
    recipe = RECIPES.get(material)
    if recipe is None:
        return None
    generator = np.random.default_rng(zlib.crc32(material.encode()))
    color = decoded(np.array(MATERIALS[material].rgba[:3]) * 255.0)
    pixels = image(recipe.pattern, generator, recipe.size, color, recipe.contrast)
    return Texture(material, pixels, recipe.period, recipe.upright)


def image(
    pattern: Pattern, generator: np.random.Generator, size: int, color: Field, contrast: float = 1.0
) -> NDArray[np.uint8]:
    """Return a pattern in a color, shape (size, size, 3), sRGB, whose mean in linear light is the color.

    Args:
        color: (3,) linear.
        contrast: strength of the pattern.
    """
    factors = pattern(generator, size)
    if factors.ndim == 2:
        factors = np.repeat(factors[..., None], 3, axis=2)
    shades = 1.0 + contrast * (factors / factors.mean(axis=(0, 1)) - 1.0)
    linear = color * shades
    for _ in range(ROUNDS):
        linear = np.clip(linear, 0.0, 1.0)
        linear = linear * (color / np.maximum(linear.mean(axis=(0, 1)), 1e-9))
    return np.asarray(np.rint(255.0 * encoded(np.clip(linear, 0.0, 1.0))), dtype=np.uint8)


def decoded(values: NDArray[np.generic]) -> Field:
    """Return sRGB values from 0 to 255 as linear light from 0 to 1 (IEC 61966-2-1)."""
    shares = np.asarray(values, dtype=np.float64) / 255.0
    return np.asarray(np.where(shares <= 0.04045, shares / 12.92, ((shares + 0.055) / 1.055) ** 2.4))


def encoded(linear: Field) -> Field:
    """Return linear light as sRGB, both from 0 to 1 (IEC 61966-2-1)."""
    return np.asarray(np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1.0 / 2.4) - 0.055))
