"""The texture of a material: an image that repeats, whose mean is the material's color."""

from __future__ import annotations

import io
import zlib
from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from labgym.assets.shapes.materials import MATERIALS
from labgym.assets.textures.noise import Field
from labgym.assets.textures.patterns import Pattern
from labgym.assets.textures.recipes import RECIPES

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
        Image.fromarray(self.pixels).save(stream, "png", compress_level=9)
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
