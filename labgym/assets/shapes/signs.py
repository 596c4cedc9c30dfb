"""Hazard signs and labels: thin plates on a front that looks along +y."""

from __future__ import annotations

import math
from collections.abc import Iterator

from labgym.assets.shapes.parts import ALONG_Y, Part, block, cylinder, ellipsoid, plate, prism, rod, turned
from labgym.errors import UnknownNameError

SYMBOLS = ("flammable", "corrosive", "oxidizer", "toxic", "water_reactive", "warning", "biohazard")
RELIEF = 0.0008
"""Height of each layer of a sign above the one below, meters."""


def diamond(symbol: str, size: float, x: float, y: float, z: float) -> Iterator[Part]:
    """A hazard diamond of that diagonal, centered at (x, z), on a front at y: it reaches y + 3 * RELIEF.

    Raises:
        UnknownNameError: no symbol has that name.
    """
    if symbol not in SYMBOLS:
        raise UnknownNameError("hazard symbol", symbol, SYMBOLS)
    tip = turned((0.0, 1.0, 0.0), math.pi / 4.0)
    side, blue = size / math.sqrt(2.0), symbol == "water_reactive"
    yield plate("print_red", (side, RELIEF, side), (x, y + 0.5 * RELIEF, z), tip)
    yield plate("signal_blue" if blue else "paper", (side * 0.84, RELIEF, side * 0.84), (x, y + 1.5 * RELIEF, z), tip)
    yield from _symbol(symbol, size, x, y + 2.5 * RELIEF, z)


def _symbol(symbol: str, size: float, x: float, y: float, z: float) -> Iterator[Part]:
    ink, s = "print_black", size
    if symbol in ("flammable", "oxidizer", "water_reactive"):
        up = 0.10 * s if symbol == "oxidizer" else 0.02 * s
        yield ellipsoid(ink, (0.24 * s, RELIEF, 0.26 * s), (x, y, z + up - 0.04 * s))
        lean = turned((0.0, 1.0, 0.0), 0.35)
        yield ellipsoid(ink, (0.12 * s, RELIEF, 0.36 * s), (x + 0.02 * s, y, z + up + 0.08 * s), lean)
        yield block(ink, (x - 0.16 * s, x + 0.16 * s), (y - RELIEF / 2, y + RELIEF / 2), (z - 0.24 * s, z - 0.20 * s))
        if symbol == "oxidizer":
            yield cylinder(ink, 0.22 * s, RELIEF, (x, y, z - 0.10 * s), ALONG_Y)
    elif symbol == "corrosive":
        for side in (-1.0, 1.0):
            yield rod(ink, RELIEF, (x + side * 0.05 * s, y, z + 0.2 * s), (x + side * 0.2 * s, y, z + 0.1 * s))
            yield ellipsoid(ink, (0.06 * s, RELIEF, 0.12 * s), (x + side * 0.12 * s, y, z + 0.02 * s))
            yield block(ink, _span(x + side * 0.13 * s, 0.22 * s), _span(y, RELIEF), _span(z - 0.14 * s, 0.08 * s))
    elif symbol == "toxic":
        yield ellipsoid(ink, (0.28 * s, RELIEF, 0.26 * s), (x, y, z + 0.06 * s))
        yield block(ink, _span(x, 0.14 * s), _span(y, RELIEF), _span(z - 0.08 * s, 0.10 * s))
        for tilt in (-0.5, 0.5):
            yield plate(ink, (0.44 * s, RELIEF, 0.05 * s), (x, y, z - 0.18 * s), turned((0.0, 1.0, 0.0), tilt))
    else:
        yield block(ink, _span(x, 0.07 * s), _span(y, RELIEF), (z - 0.06 * s, z + 0.24 * s))
        yield block(ink, _span(x, 0.07 * s), _span(y, RELIEF), (z - 0.20 * s, z - 0.12 * s))


def triangle(size: float, x: float, y: float, z: float) -> Iterator[Part]:
    """A yellow warning triangle of that height with an exclamation mark; it reaches y + 3 * RELIEF."""
    half = size / math.sqrt(3.0)
    for material, scale, layer in (("print_black", 1.0, 0.5), ("safety_yellow", 0.82, 1.5)):
        # ALONG_Y takes the outline's second axis to +z.
        outline = [
            (-half * scale, -size / 3.0 * scale),
            (half * scale, -size / 3.0 * scale),
            (0.0, size * 2.0 / 3.0 * scale),
        ]
        facing = turned((1.0, 0.0, 0.0), math.pi / 2.0)
        yield prism(material, outline, RELIEF, (x, y + layer * RELIEF, z), facing)
    middle = y + 2.5 * RELIEF
    yield block("print_black", _span(x, 0.07 * size), _span(middle, RELIEF), (z - 0.03 * size, z + 0.30 * size))
    yield block("print_black", _span(x, 0.07 * size), _span(middle, RELIEF), (z - 0.17 * size, z - 0.09 * size))


def lines(width: float, height: float, count: int, x: float, y: float, z: float) -> Iterator[Part]:
    """Lines of print, alternately long and short, left-aligned as seen from the front, centered at (x, z)."""
    pitch = height / count
    for k in range(count):
        length = width * (1.0 if k % 2 == 0 else 0.7)
        top = z + height / 2.0 - k * pitch
        right = x + width / 2.0
        yield block("print_black", (right - length, right), (y, y + RELIEF), (top - 0.45 * pitch, top))


def _span(middle: float, length: float) -> tuple[float, float]:
    return middle - length / 2.0, middle + length / 2.0
