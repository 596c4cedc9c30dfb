"""Stools, chairs and trolleys of other product ranges."""

from __future__ import annotations

import math
from collections.abc import Iterator

from labgym.assets.model import Asset
from labgym.assets.shapes.fixtures import castors
from labgym.assets.shapes.materials import coating
from labgym.assets.shapes.parts import Part, block, column, rod, rounded
from labgym.assets.shapes.registry import count, extents, flag, shape, text
from labgym.errors import UnknownNameError

BASES = ("star", "legs", "sled")
WHEEL = 0.11
"""Height of the castors of a trolley, meters."""
TRAYS = {"steel": "stainless", "wood": "oak"}
"""Materials of trays that are no color."""


@shape("modular_stool")
def modular_stool(asset: Asset) -> Iterator[Part]:
    """A stool or a laboratory chair.

    Parameters: `colour` of the seat; `base`: star (on castors), legs or sled (two runners); `back`, with a backrest;
    `round`, a round seat in place of a square one. `seat`, the height of the seat as a share of the total height.
    """
    width, depth, height = extents(asset)
    hw, hd = width / 2.0, depth / 2.0
    seat, base = coating(text(asset, "colour", "blue")), text(asset, "base", "star")
    if base not in BASES:
        raise UnknownNameError("base of a stool", base, BASES)
    back = flag(asset, "back")
    level = 0.62 * height if back else height
    if flag(asset, "round"):
        yield column(seat, 1.7 * hw, 0.0, 0.0, (level - 0.06, level))
    else:
        yield rounded(seat, (-0.86 * hw, 0.86 * hw), (-0.86 * hd, 0.86 * hd), (level - 0.06, level), 0.06)
    if back:
        yield block("powder_dark", (-0.03, 0.03), (-hd + 0.02, -hd + 0.05), (level - 0.05, 0.86 * height))
        yield rounded(seat, (-0.75 * hw, 0.75 * hw), (-hd, -hd + 0.06), (0.74 * height, height), 0.03)
    yield from _star(min(hw, hd), level) if base == "star" else _legs(base, hw, hd, level)


def _star(radius: float, level: float) -> Iterator[Part]:
    yield column("chrome", 0.05, 0.0, 0.0, (0.06, level - 0.06))
    for k in range(4):
        angle = k * math.pi / 2.0
        x, y = (radius - 0.025) * math.cos(angle), (radius - 0.025) * math.sin(angle)
        yield rod("aluminium", 0.036, (0.0, 0.0, 0.08), (x, y, 0.06))
        yield column("rubber", 0.05, x, y, (0.0, 0.05))


def _legs(base: str, hw: float, hd: float, level: float) -> Iterator[Part]:
    """Four upright tubes with a foot rest, on the floor or on two runners."""
    thick = 0.026
    for sx in (-1.0, 1.0):
        x = sx * (hw - thick / 2.0)
        for sy in (-1.0, 1.0):
            yield column("chrome", thick, x, sy * (hd - thick / 2.0), (0.0, level - 0.05))
        if base == "sled":
            yield block("chrome", (x - thick / 2.0, x + thick / 2.0), (-hd, hd), (0.0, thick))
        yield block("chrome", (x - thick / 2.0, x + thick / 2.0), (-hd, hd), (level - 0.08, level - 0.06))
    for y in (-0.4 * hd, 0.4 * hd):
        yield block("chrome", (-hw + thick, hw - thick), (y - 0.01, y + 0.01), (level - 0.08, level - 0.06))
    yield block("chrome", (-hw, hw), (hd - thick, hd), (0.32 * level, 0.32 * level + 0.02))


@shape("modular_trolley")
def modular_trolley(asset: Asset) -> Iterator[Part]:
    """A trolley with trays between corner posts.

    Parameters: `trays`; `tray`: steel, wood or a color; `frame`, a color; `closed`, with panels on three sides;
    `handle`, a bar at one end.
    """
    width, depth, height = extents(asset)
    hw, hd = width / 2.0, depth / 2.0
    word = text(asset, "tray", "steel")
    tray = TRAYS[word] if word in TRAYS else coating(word)
    frame, post = coating(text(asset, "frame", "grey")), 0.03
    reach = hw - (0.06 if flag(asset, "handle") else 0.0)
    middle = reach - hw
    yield from castors(reach - 0.06, hd - 0.06, WHEEL)
    for sx in (-hw, 2.0 * reach - hw - post):
        for sy in (-hd, hd - post):
            yield block(frame, (sx, sx + post), (sy, sy + post), (WHEEL, height))
    trays, x = count(asset, "trays", 2), (-hw + post / 2.0, 2.0 * reach - hw - post / 2.0)
    for k in range(trays):
        low = WHEEL + k * (height - 0.04 - WHEEL) / max(trays - 1, 1)
        yield block(tray, (x[0] + 0.003, x[1] - 0.003), (-hd + post / 2.0, hd - post / 2.0 - 0.002), (low, low + 0.03))
    if flag(asset, "closed"):
        yield block(frame, (x[0], x[0] + 0.01), (-hd + post, hd - post), (WHEEL, height - 0.01))
        yield block(frame, (x[1] - 0.01, x[1]), (-hd + post, hd - post), (WHEEL, height - 0.01))
        yield block(frame, x, (-hd + 0.005, -hd + 0.015), (WHEEL, height - 0.01))
    if flag(asset, "handle"):
        yield block("chrome", (hw - 0.024, hw), (-0.8 * hd, 0.8 * hd), (height - 0.03, height - 0.006))
        for y in (-0.7 * hd, 0.7 * hd):
            yield block(
                "chrome", (hw + 2.0 * middle - 0.002, hw - 0.02), (y - 0.01, y + 0.01), (height - 0.03, height - 0.006)
            )
