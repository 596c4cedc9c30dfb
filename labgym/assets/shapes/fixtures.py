"""Details that many shapes share: feet, knobs, screens, handles, vents, castors, keypads, hazard signs and labels."""

from __future__ import annotations

import math
from collections.abc import Iterator

from labgym.assets.shapes.parts import (
    ALONG_X,
    ALONG_Y,
    Part,
    Point,
    block,
    column,
    cylinder,
    ellipsoid,
    plate,
    prism,
    rod,
    span,
    turned,
)
from labgym.errors import check_name


def feet(x: float, y: float, height: float, diameter: float = 0.022) -> Iterator[Part]:
    """Four rubber feet at (+-x, +-y)."""
    for sx in (-1.0, 1.0):
        for sy in (-1.0, 1.0):
            yield column("rubber", diameter, sx * x, sy * y, (0.0, height))


def castors(x: float, y: float, height: float) -> Iterator[Part]:
    """Four castor wheels at (+-x, +-y), `height` tall."""
    wheel = height * 0.75
    for sx in (-1.0, 1.0):
        for sy in (-1.0, 1.0):
            yield cylinder("rubber", wheel, 0.025, (sx * x, sy * y, wheel / 2.0), ALONG_X)
            yield column("galvanised", 0.03, sx * x, sy * y, (wheel, height))


def frame(material: str, x: Point, y: Point, z: Point, rail: float) -> Iterator[Part]:
    """A rectangular frame: two stiles of the full height, and two rails between them."""
    for stile in ((x[0], x[0] + rail), (x[1] - rail, x[1])):
        yield block(material, stile, y, z)
    for level in ((z[0], z[0] + rail), (z[1] - rail, z[1])):
        yield block(material, (x[0] + rail, x[1] - rail), y, level)


def knob(material: str, diameter: float, x: float, y: float, front: float, z: float) -> Iterator[Part]:
    """A round knob on a front at y, reaching `front`, with a pointer."""
    middle = y + 0.8 * (front - y)
    yield cylinder(material, diameter, middle - y, (x, (y + middle) / 2.0, z), ALONG_Y)
    yield block("print_black", span(0.0015, x), (middle - 0.001, front), (z, z + diameter * 0.45))


def panel_screen(material: str, x: Point, y: float, z: Point) -> Iterator[Part]:
    """A display with a dark bezel on a front at y; it stands 3 mm proud."""
    edge = 0.004
    yield block("screen_dark", (x[0] - edge, x[1] + edge), (y - 0.001, y + 0.002), (z[0] - edge, z[1] + edge))
    yield block(material, x, (y, y + 0.003), z)


def curve_screen(x: Point, y: float, z: Point) -> Iterator[Part]:
    """A large display that shows a measured curve as a row of bars; it stands 4 mm proud."""
    yield from panel_screen("screen_dark", x, y, z)
    width, height = x[1] - x[0], z[1] - z[0]
    peaks = (0.10, 0.12, 0.55, 0.16, 0.12, 0.82, 0.30, 0.14, 0.42, 0.12, 0.10)
    pitch = 0.9 * width / len(peaks)
    for k, peak in enumerate(peaks):
        # The front is seen with +x to its left, so the first bar sits at the right end.
        left = x[1] - 0.05 * width - (k + 1) * pitch
        yield block(
            "screen",
            (left, left + 0.7 * pitch),
            (y + 0.003, y + 0.004),
            (z[0] + 0.1 * height, z[0] + height * (0.1 + 0.8 * peak)),
        )


def keypad(x: Point, y: float, z: Point, columns: int = 3, rows: int = 4) -> Iterator[Part]:
    """A pad of keys on a front at y; it stands 3 mm proud."""
    pitch_x, pitch_z = (x[1] - x[0]) / columns, (z[1] - z[0]) / rows
    for i in range(columns):
        for j in range(rows):
            left, low = x[0] + i * pitch_x, z[0] + j * pitch_z
            color = "abs_green" if (i, j) == (0, 0) else "plastic_dark"
            yield block(
                color,
                (left + 0.15 * pitch_x, left + 0.85 * pitch_x),
                (y, y + 0.003),
                (low + 0.15 * pitch_z, low + 0.85 * pitch_z),
            )


def bar_handle(x: float, y: float, front: float, z: Point, material: str = "stainless") -> Iterator[Part]:
    """An upright bar handle on a door at y, its outside at `front`."""
    thick = min(0.014, (front - y) * 0.7)
    yield rod(material, thick, (x, front - thick / 2.0, z[0]), (x, front - thick / 2.0, z[1]))
    for height in (z[0] + 0.02, z[1] - 0.02):
        yield block(material, span(thick * 0.35, x), (y, front - thick / 2.0), span(0.006, height))


def drawer_handle(x: Point, y: float, front: float, z: float, material: str = "stainless") -> Iterator[Part]:
    """A level bar handle on a drawer front at y, its outside at `front`."""
    thick = min(0.012, (front - y) * 0.6)
    yield block(material, x, (front - thick, front), span(thick / 2.0, z))
    for end in (x[0] + 0.01, x[1] - 0.01):
        yield block(material, span(0.004, end), (y, front - thick), span(0.004, z))


def louvres(x: Point, y: float, z: Point, count: int) -> Iterator[Part]:
    """Dark ventilation slots on a front at y; they stand 1 mm proud."""
    pitch = (z[1] - z[0]) / count
    for k in range(count):
        low = z[0] + (k + 0.3) * pitch
        yield block("plastic_black", x, span(0.001, y), (low, low + 0.4 * pitch))


def gauge(x: float, y: float, front: float, z: float, diameter: float) -> Iterator[Part]:
    """A dial gauge on a front at y, its glass at `front`."""
    yield cylinder("chrome", diameter, front - y - 0.001, (x, (y + front - 0.001) / 2.0, z), ALONG_Y)
    yield cylinder("paper", diameter * 0.84, front - y - 0.0005, (x, (y + front - 0.0005) / 2.0, z), ALONG_Y)
    yield block("print_red", span(0.001, x), (front - 0.002, front + 0.0), (z, z + diameter * 0.36))


SYMBOLS = ("flammable", "corrosive", "oxidizer", "toxic", "water_reactive", "warning", "biohazard")
RELIEF_M = 0.0008
"""Height of each layer of a sign above the one below, meters."""


def diamond(symbol: str, size: float, x: float, y: float, z: float) -> Iterator[Part]:
    """A hazard diamond of that diagonal, centered at (x, z), on a front at y: it reaches y + 3 * RELIEF_M.

    Raises:
        UnknownNameError: no symbol has that name.
    """
    check_name("hazard symbol", symbol, SYMBOLS)
    tip = turned((0.0, 1.0, 0.0), math.pi / 4.0)
    side, blue = size / math.sqrt(2.0), symbol == "water_reactive"
    yield plate("print_red", (side, RELIEF_M, side), (x, y + 0.5 * RELIEF_M, z), tip)
    yield plate(
        "signal_blue" if blue else "paper", (side * 0.84, RELIEF_M, side * 0.84), (x, y + 1.5 * RELIEF_M, z), tip
    )
    yield from _symbol(symbol, size, x, y + 2.5 * RELIEF_M, z)


def _symbol(symbol: str, size: float, x: float, y: float, z: float) -> Iterator[Part]:
    ink, s = "print_black", size
    if symbol in ("flammable", "oxidizer", "water_reactive"):
        up = 0.10 * s if symbol == "oxidizer" else 0.02 * s
        yield ellipsoid(ink, (0.24 * s, RELIEF_M, 0.26 * s), (x, y, z + up - 0.04 * s))
        lean = turned((0.0, 1.0, 0.0), 0.35)
        yield ellipsoid(ink, (0.12 * s, RELIEF_M, 0.36 * s), (x + 0.02 * s, y, z + up + 0.08 * s), lean)
        yield block(ink, span(0.16 * s, x), span(RELIEF_M / 2, y), (z - 0.24 * s, z - 0.20 * s))
        if symbol == "oxidizer":
            yield cylinder(ink, 0.22 * s, RELIEF_M, (x, y, z - 0.10 * s), ALONG_Y)
    elif symbol == "corrosive":
        for side in (-1.0, 1.0):
            yield rod(ink, RELIEF_M, (x + side * 0.05 * s, y, z + 0.2 * s), (x + side * 0.2 * s, y, z + 0.1 * s))
            yield ellipsoid(ink, (0.06 * s, RELIEF_M, 0.12 * s), (x + side * 0.12 * s, y, z + 0.02 * s))
            yield block(
                ink,
                span(0.22 * s / 2.0, x + side * 0.13 * s),
                span(RELIEF_M / 2.0, y),
                span(0.08 * s / 2.0, z - 0.14 * s),
            )
    elif symbol == "toxic":
        yield ellipsoid(ink, (0.28 * s, RELIEF_M, 0.26 * s), (x, y, z + 0.06 * s))
        yield block(ink, span(0.14 * s / 2.0, x), span(RELIEF_M / 2.0, y), span(0.10 * s / 2.0, z - 0.08 * s))
        for tilt in (-0.5, 0.5):
            yield plate(ink, (0.44 * s, RELIEF_M, 0.05 * s), (x, y, z - 0.18 * s), turned((0.0, 1.0, 0.0), tilt))
    else:
        yield block(ink, span(0.07 * s / 2.0, x), span(RELIEF_M / 2.0, y), (z - 0.06 * s, z + 0.24 * s))
        yield block(ink, span(0.07 * s / 2.0, x), span(RELIEF_M / 2.0, y), (z - 0.20 * s, z - 0.12 * s))


def triangle(size: float, x: float, y: float, z: float) -> Iterator[Part]:
    """A yellow warning triangle of that height with an exclamation mark; it reaches y + 3 * RELIEF_M."""
    half = size / math.sqrt(3.0)
    for material, scale, layer in (("print_black", 1.0, 0.5), ("safety_yellow", 0.82, 1.5)):
        # ALONG_Y takes the outline's second axis to +z.
        outline = [
            (-half * scale, -size / 3.0 * scale),
            (half * scale, -size / 3.0 * scale),
            (0.0, size * 2.0 / 3.0 * scale),
        ]
        facing = turned((1.0, 0.0, 0.0), math.pi / 2.0)
        yield prism(material, outline, RELIEF_M, (x, y + layer * RELIEF_M, z), facing)
    middle = y + 2.5 * RELIEF_M
    yield block(
        "print_black", span(0.07 * size / 2.0, x), span(RELIEF_M / 2.0, middle), (z - 0.03 * size, z + 0.30 * size)
    )
    yield block(
        "print_black", span(0.07 * size / 2.0, x), span(RELIEF_M / 2.0, middle), (z - 0.17 * size, z - 0.09 * size)
    )


def lines(width: float, height: float, count: int, x: float, y: float, z: float) -> Iterator[Part]:
    """Lines of print, alternately long and short, left-aligned as seen from the front, centered at (x, z)."""
    pitch = height / count
    for k in range(count):
        length = width * (1.0 if k % 2 == 0 else 0.7)
        top = z + height / 2.0 - k * pitch
        right = x + width / 2.0
        yield block("print_black", (right - length, right), (y, y + RELIEF_M), (top - 0.45 * pitch, top))
