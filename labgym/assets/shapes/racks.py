"""Racks, trays, peg boards, packets and boxes."""

from __future__ import annotations

import math
from collections.abc import Iterator

from labgym.assets.model import Asset
from labgym.assets.shapes.materials import coating
from labgym.assets.shapes.parts import (
    ALONG_Y,
    Part,
    band,
    block,
    column,
    cylinder,
    ellipsoid,
    plate,
    prism,
    revolved,
    rounded,
    turned,
)
from labgym.assets.shapes.registry import count, extents, flag, shape, text


@shape("rack")
def rack(asset: Asset) -> Iterator[Part]:
    """A rack: for test tubes by default, with `bottles` for reagent bottles, with `pegs` a drying rack for a wall."""
    width, depth, height = extents(asset)
    if "pegs" in asset.shape.parameters:
        yield from _peg_board(width, depth, height, count(asset, "pegs", 48))
    elif flag(asset, "bottles"):
        yield from _bottle_tray(width, depth, height)
    else:
        yield from _tube_rack(width, depth, height, count(asset, "rows", 3), count(asset, "columns", 8))


def _tube_rack(width: float, depth: float, height: float, rows: int, columns: int) -> Iterator[Part]:
    hw, hd = width / 2.0, depth / 2.0
    for low in (0.0, height * 0.45, height - 0.0065):
        yield block("cabinet_blue", (-hw, hw), (-hd, hd), (low, low + 0.006))
    for side in (-1.0, 1.0):
        edge = side * hw
        yield block("cabinet_blue", (edge, edge - side * 0.006), (-hd, hd), (0.0, height - 0.0005))
    pitch_x, pitch_y = (width - 0.02) / columns, (depth - 0.01) / rows
    hexagon = [
        (
            0.36 * min(pitch_x, pitch_y) * math.cos(k * math.pi / 3),
            0.36 * min(pitch_x, pitch_y) * math.sin(k * math.pi / 3),
        )
        for k in range(6)
    ]
    for i in range(columns):
        for j in range(rows):
            x, y = (i + 0.5) * pitch_x - hw + 0.01, (j + 0.5) * pitch_y - hd + 0.005
            yield prism("plastic_dark", hexagon, 0.002, (x, y, height - 0.001))


def _bottle_tray(width: float, depth: float, height: float) -> Iterator[Part]:
    hw, hd = width / 2.0, depth / 2.0
    yield block("plastic_light", (-hw + 0.002, hw - 0.002), (-hd + 0.002, hd - 0.002), (0.0, 0.008))
    for side in (-1.0, 1.0):
        edge = side * hw
        yield block("stainless", (edge, edge - side * 0.006), (-hd, hd), (0.0, height * 0.5))
    for y in (-hd + 0.003, hd - 0.003):
        yield block("stainless", (-hw, hw), (y - 0.003, y + 0.003), (height * 0.34, height * 0.40))
    bodies = ("amber_glass", "borosilicate", "amber_glass", "polyethylene", "amber_glass")
    caps = ("abs_red", "abs_blue", "plastic_black", "safety_yellow", "abs_green")
    pitch = (width - 0.02) / 5.0
    radius = min(pitch * 0.46, hd - 0.012)
    for k, (body, cap) in enumerate(zip(bodies, caps, strict=True)):
        x, top = (k + 0.5) * pitch - hw + 0.01, height * (1.0 if k % 2 == 0 else 0.88)
        outline = [(radius, 0.008), (radius, top * 0.62), (radius * 0.36, top * 0.80), (radius * 0.36, top * 0.9)]
        yield revolved(body, outline, (x, 0.0, 0.0))
        yield band("paper", 2.02 * radius, (top * 0.22, top * 0.5), x)
        yield column(cap, radius, x, 0.0, (top * 0.84, top))


def _peg_board(width: float, depth: float, height: float, pegs: int) -> Iterator[Part]:
    hw, hd = width / 2.0, depth / 2.0
    yield block("plastic_white", (-hw, hw), (-hd, -hd + 0.012), (0.05, height))
    yield block("stainless", (-hw, hw), (-hd, hd), (0.0, 0.012))
    yield block("stainless", (-hw, hw), (hd - 0.004, hd), (0.0, 0.05))
    columns = max(1, round(math.sqrt(pegs * width / height)))
    rows = max(1, pegs // columns)
    lean = turned((1.0, 0.0, 0.0), -math.pi / 2.0 + 0.45)
    length = (depth - 0.015) / math.cos(0.45) * 0.9
    for i in range(columns):
        for j in range(rows):
            x, z = (i + 0.5) / columns * (width - 0.03) - hw + 0.015, 0.08 + (j + 0.5) / rows * (height - 0.14)
            middle = (x, -hd + 0.012 + length / 2.0 * math.cos(0.45), z + length / 2.0 * math.sin(0.45) - 0.01)
            yield plate("plastic_light", (0.009, 0.009, length), middle, lean)
    for k, x in enumerate((-hw * 0.6, 0.0, hw * 0.55)):
        at = (x, 0.0, height * (0.72 - 0.2 * k))
        yield revolved("borosilicate", [(0.014, -0.045), (0.026, -0.04), (0.018, 0.02), (0.008, 0.04)], at)


@shape("box")
def plain_box(asset: Asset) -> Iterator[Part]:
    """A box, packet or strip; `keyboard`, `sockets` and `dispenser` vary it."""
    width, depth, height = extents(asset)
    hw, hd = width / 2.0, depth / 2.0
    body = coating(text(asset, "colour", "white"))
    if flag(asset, "keyboard"):
        yield from _keyboard(hw, hd, height)
    elif "sockets" in asset.shape.parameters:
        yield rounded(body, (-hw, hw), (-hd, hd - 0.004), (0.0, height), 0.008)
        total = count(asset, "sockets", 4)
        for k in range(total):
            x = (k + 0.5) / total * (width - 0.03) - hw + 0.015
            yield cylinder("plastic_light", height * 0.68, 0.007, (x, hd - 0.0045, height / 2.0), ALONG_Y)
            for side in (-1.0, 1.0):
                yield cylinder("print_black", 0.006, 0.002, (x + side * 0.010, hd - 0.001, height / 2.0), ALONG_Y)
    elif flag(asset, "dispenser"):
        yield rounded(body, (-hw, hw), (-hd, hd - 0.003), (0.0, height - 0.003), 0.02)
        if height > width:
            yield block("print_black", (-hw * 0.7, hw * 0.7), (hd - 0.03, hd - 0.002), (0.0, 0.012))
            yield block("paper", (-hw * 0.6, hw * 0.6), (hd - 0.02, hd - 0.017), (0.0, 0.03))
            yield block("plastic_dark", (-hw * 0.1, hw * 0.1), (hd - 0.004, hd), (height * 0.45, height * 0.7))
        else:
            yield ellipsoid("glove", (width * 0.5, depth * 0.4, 0.006), (0.0, 0.0, height - 0.003))
            yield block("paper", (-hw * 0.8, hw * 0.8), (hd - 0.002, hd), (height * 0.25, height * 0.75))
    elif height < 0.04:
        yield block(body, (-hw, hw), (-hd, hd), (0.0, height * 0.85))
        yield column("paper", min(width, depth) * 0.94, 0.0, 0.0, (height * 0.8, height))
    else:
        yield block("foam", (-hw, hw), (-hd, hd - 0.002), (0.0, height * 0.82))
        yield block(body, (-hw * 0.96, hw * 0.96), (-hd * 0.96, hd * 0.96), (height * 0.82, height))
        yield block("signal_blue", (-hw * 0.6, hw * 0.6), (hd - 0.003, hd), (height * 0.25, height * 0.6))


def _keyboard(hw: float, hd: float, height: float) -> Iterator[Part]:
    yield rounded("plastic_black", (-hw, hw), (-hd, hd), (0.0, height * 0.6), 0.01)
    rows, pitch = 5, (2.0 * hd - 0.02) / 5.0
    for row in range(rows):
        y = -hd + 0.010 + (row + 0.5) * pitch
        for low, high in ((-hw + 0.01, hw * 0.42), (hw * 0.48, hw - 0.01)):
            yield block("plastic_dark", (low, high), (y - pitch * 0.4, y + pitch * 0.4), (height * 0.6, height))
