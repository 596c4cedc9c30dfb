"""Conversion of colors between sRGB (catalog materials, OBJ) and linear light (USD, glTF)."""

from __future__ import annotations

from collections.abc import Sequence

from labgym.assets.meshes.model import Rgba


def to_linear(value: float) -> float:
    """Return a channel of sRGB as linear light (IEC 61966-2-1), both in [0, 1]."""
    return value / 12.92 if value <= 0.04045 else float(((value + 0.055) / 1.055) ** 2.4)


def to_srgb(value: float) -> float:
    """Return a channel of linear light as sRGB (IEC 61966-2-1), both in [0, 1]."""
    value = min(max(value, 0.0), 1.0)
    return 12.92 * value if value <= 0.0031308 else float(1.055 * value ** (1.0 / 2.4) - 0.055)


def rgba_from_linear(color: Sequence[float], opacity: float) -> Rgba:
    """Return linear red, green, blue and an opacity as sRGB with opacity; values beyond [0, 1] are clipped."""
    red, green, blue = (to_srgb(float(channel)) for channel in color[:3])
    return red, green, blue, min(max(float(opacity), 0.0), 1.0)
