"""Bottles, jars and vials with hazard labels, waste canisters; racks, trays, packets and boxes."""

from __future__ import annotations

import math
from collections.abc import Iterator

from labgym.assets.model import Asset
from labgym.assets.shapes.materials import coating
from labgym.assets.shapes.parts import (
    ALONG_X,
    ALONG_Y,
    Part,
    Point,
    band,
    block,
    column,
    cylinder,
    ellipsoid,
    plate,
    prism,
    revolved,
    rod,
    rounded,
    span,
    turned,
)
from labgym.assets.shapes.registry import choice, count, extents, flag, shape, text

WALLS = {"amber": "amber_glass", "clear": "borosilicate", "plastic": "polyethylene"}
BANDS = {
    "Flammable": "safety_red",
    "Acid": "safety_yellow",
    "Base": "safety_yellow",
    "Oxidizer": "safety_orange",
    "Toxic": "signal_blue",
    "WaterReactive": "poison_purple",
    "General": "signal_green",
    "Refrigerator": "edge_teal",
}
"""Color of the band on a label by storage class, as suppliers print a storage code."""
CAPS = {
    "Flammable": "abs_red",
    "Acid": "abs_blue",
    "Base": "plastic_white",
    "Oxidizer": "safety_yellow",
    "Toxic": "plastic_black",
}


def wall(asset: Asset) -> str:
    """Return the material of a bottle's wall.

    Raises:
        UnknownNameError: the shape names a glass that does not exist.
    """
    return WALLS[choice(asset, "glass", "clear", WALLS, "glass")]


def label(asset: Asset, radius: float, low: float, high: float) -> Iterator[Part]:
    """A label round a bottle between two heights; a hazardous reagent's has a color band and a diamond."""
    storage = asset.chemistry.storage_class if asset.chemistry else None
    yield band("paper", 2.0 * radius, (low, high))
    if storage is None:
        return
    tall = high - low
    yield band(BANDS.get(storage, "signal_green"), 2.0 * radius + 0.0004, (high - 0.24 * tall, high - 0.04 * tall))
    line = radius * 0.75
    for k, share in enumerate((0.62, 0.52, 0.42)):
        z = low + share * tall
        length = line * (1.0 - 0.25 * k)
        yield block("print_black", (line / 2.0 - length, line / 2.0), (radius - 0.0018, radius), span(0.025 * tall, z))
    if storage != "General":
        side = min(0.20 * tall, 0.5 * radius)
        tip = turned((0.0, 1.0, 0.0), math.pi / 4.0)
        yield plate("print_red", (side, 0.0024, side), (0.0, radius - 0.0012, low + 0.18 * tall), tip)
        yield plate("paper", (side * 0.72, 0.0024, side * 0.72), (0.0, radius - 0.0010, low + 0.18 * tall), tip)


def shouldered(radius: float, neck: float, low: float, high: float) -> list[Point]:
    """Outline of a bottle: straight up to `low`, a round shoulder, a neck from `high`."""
    steps = [(math.pi / 2.0) * k / 4.0 for k in range(5)]
    shoulder = [(neck + (radius - neck) * math.cos(a), low + (high - low) * math.sin(a)) for a in steps]
    return [(0.0, 0.0), (radius * 0.94, 0.0), (radius, radius * 0.06), *shoulder]


@shape("bottle")
def bottle(asset: Asset) -> Iterator[Part]:
    """A narrow-necked bottle; `winchester`, `dropper`, `wash` (gas wash bottle) and `spout` vary it."""
    width, depth, height, *_ = extents(asset)
    if flag(asset, "wash"):
        yield from _gas_wash_bottle(width, depth, height)
        return
    if flag(asset, "spout"):
        yield from _squeeze_bottle(width / 2.0, height)
        return
    radius = width / 2.0 - 0.0006
    shoulder, neck_low = (0.62, 0.80) if flag(asset, "winchester") else (0.66, 0.82)
    neck, cap = radius * (0.30 if flag(asset, "winchester") else 0.36), height * (0.90 if height > 0.12 else 0.86)
    yield revolved(wall(asset), [*shouldered(radius, neck, height * shoulder, height * neck_low), (neck, cap)])
    yield from label(asset, width / 2.0 - 0.0002, height * 0.14, height * (shoulder - 0.06))
    storage = asset.chemistry.storage_class if asset.chemistry else "General"
    if flag(asset, "dropper"):
        yield column("plastic_black", 2.6 * neck, 0.0, 0.0, (neck_low * height, cap))
        yield revolved("rubber", [(neck * 0.9, cap), (neck, height - neck), (neck * 0.4, height)])
        return
    yield column(CAPS.get(storage, "plastic_black"), 2.5 * neck, 0.0, 0.0, (cap - 0.06 * height, height))
    yield column("plastic_dark", 2.6 * neck, 0.0, 0.0, (cap - 0.07 * height, cap - 0.055 * height))
    if flag(asset, "winchester"):
        yield cylinder("amber_glass", 0.016, 1.5 * neck, (1.5 * neck, 0.0, 0.83 * height), turned((0.0, 1.0, 0.0), 0.5))


def _gas_wash_bottle(width: float, depth: float, height: float) -> Iterator[Part]:
    radius, top = depth / 2.0, height * 0.74
    yield revolved(
        "borosilicate",
        [*shouldered(radius, 0.016, top * 0.86, top), (0.016, height * 0.82), (0.008, height * 0.88), (0.008, height)],
    )
    yield column("blue_liquid", depth - 0.004, 0.0, 0.0, (0.002, height * 0.36))
    for side, z in ((-1.0, 0.95), (1.0, 0.87)):
        yield cylinder(
            "borosilicate", 0.008, width / 2.0 - 0.001, (side * (width / 4.0 - 0.0005), 0.0, height * z), ALONG_X
        )
        yield cylinder("rubber_orange", 0.012, 0.012, (side * (width / 2.0 - 0.006), 0.0, height * z), ALONG_X)


def _squeeze_bottle(radius: float, height: float) -> Iterator[Part]:
    shoulder = height * 0.66
    yield revolved(
        "polyethylene",
        [*shouldered(radius - 0.0004, radius * 0.42, shoulder * 0.86, shoulder), (radius * 0.42, height * 0.7)],
    )
    yield band("signal_green", 2.0 * radius, (height * 0.18, height * 0.42))
    yield column("abs_red", radius * 1.1, 0.0, 0.0, (height * 0.67, height * 0.78))
    bend, tip = height - 0.004, radius * 0.85
    yield rod("abs_red", 0.007, (0.0, 0.0, height * 0.76), (0.0, 0.0, bend + 0.004))
    yield rod("abs_red", 0.006, (0.0, 0.0, bend - 0.001), (0.0, tip, bend - 0.028))


@shape("jar")
def jar(asset: Asset) -> Iterator[Part]:
    """A wide-mouthed jar for solids with a screw cap."""
    width, _, height, *_ = extents(asset)
    radius, cap = width / 2.0 - 0.0006, height * 0.80
    neck = radius * 0.80
    plastic = text(asset, "glass", "plastic") == "plastic"
    yield revolved(
        "plastic_white" if plastic else wall(asset),
        [*shouldered(radius, neck, height * 0.70, cap), (neck, height * 0.9)],
    )
    yield from label(asset, width / 2.0 - 0.0002, height * 0.12, height * 0.66)
    storage = asset.chemistry.storage_class if asset.chemistry else "General"
    color = CAPS.get(storage, "plastic_black")
    yield column("abs_blue" if plastic and color == "plastic_white" else color, 2.12 * neck, 0.0, 0.0, (cap, height))


@shape("vial")
def vial(asset: Asset) -> Iterator[Part]:
    """A small sample vial with a screw cap."""
    width, _, height, *_ = extents(asset)
    radius, shoulder = width / 2.0, height * 0.74
    yield revolved(
        "borosilicate", [*shouldered(radius, radius * 0.7, shoulder, shoulder + 0.006), (radius * 0.7, height * 0.85)]
    )
    yield column("yellow_liquid", 1.86 * radius, 0.0, 0.0, (0.0015, height * 0.4))
    yield column("plastic_black", 1.74 * radius, 0.0, 0.0, (height * 0.80, height))


@shape("drum")
def waste_canister(asset: Asset) -> Iterator[Part]:
    """A plastic canister with a handle, a label and a screw cap."""
    _, _, height, hw, hd = extents(asset)
    top, body = height * 0.84, coating(text(asset, "colour", "blue"))
    yield rounded(body, span(hw), (-hd, hd - 0.004), (0.0, top), 0.04)
    yield rounded(body, span(hw * 0.86), span(hd * 0.86), (top, height * 0.89), 0.04)
    yield block("paper", span(hw * 0.6), (hd - 0.005, hd - 0.003), (height * 0.25, height * 0.62))
    tip = turned((0.0, 1.0, 0.0), math.pi / 4.0)
    yield plate("print_red", (0.055, 0.002, 0.055), (-hw * 0.22, hd - 0.0012, height * 0.48), tip)
    yield plate("paper", (0.042, 0.002, 0.042), (-hw * 0.22, hd - 0.0010, height * 0.48), tip)
    for k in range(3):
        yield block(
            "print_black",
            (0.0 + hw * 0.05, hw * 0.5),
            (hd - 0.002, hd),
            (height * (0.52 - 0.06 * k), height * (0.535 - 0.06 * k)),
        )
    yield column("plastic_black", 0.07, hw * 0.5, 0.0, (height * 0.88, height))
    for x in (-hw * 0.65, 0.0):
        yield block(body, span(0.012, x), span(0.015), (height * 0.88, height * 0.96))
    yield block(body, (-hw * 0.65 - 0.012, 0.012), span(0.015), (height * 0.955, height))


@shape("rack")
def rack(asset: Asset) -> Iterator[Part]:
    """A rack: for test tubes by default, with `bottles` for reagent bottles, with `pegs` a drying rack for a wall."""
    width, depth, height, *_ = extents(asset)
    if "pegs" in asset.shape.parameters:
        yield from _peg_board(width, depth, height, count(asset, "pegs", 48))
    elif flag(asset, "bottles"):
        yield from _bottle_tray(width, depth, height)
    else:
        yield from _tube_rack(width, depth, height, count(asset, "rows", 3), count(asset, "columns", 8))


def _tube_rack(width: float, depth: float, height: float, rows: int, columns: int) -> Iterator[Part]:
    hw, hd = width / 2.0, depth / 2.0
    for low in (0.0, height * 0.45, height - 0.0065):
        yield block("cabinet_blue", span(hw), span(hd), (low, low + 0.006))
    for side in (-1.0, 1.0):
        edge = side * hw
        yield block("cabinet_blue", (edge, edge - side * 0.006), span(hd), (0.0, height - 0.0005))
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
    yield block("plastic_light", span(hw - 0.002), span(hd - 0.002), (0.0, 0.008))
    for side in (-1.0, 1.0):
        edge = side * hw
        yield block("stainless", (edge, edge - side * 0.006), span(hd), (0.0, height * 0.5))
    for y in (-hd + 0.003, hd - 0.003):
        yield block("stainless", span(hw), span(0.003, y), (height * 0.34, height * 0.40))
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
    yield block("plastic_white", span(hw), (-hd, -hd + 0.012), (0.05, height))
    yield block("stainless", span(hw), span(hd), (0.0, 0.012))
    yield block("stainless", span(hw), (hd - 0.004, hd), (0.0, 0.05))
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
    width, depth, height, hw, hd = extents(asset)
    body = coating(text(asset, "colour", "white"))
    if flag(asset, "keyboard"):
        yield from _keyboard(hw, hd, height)
    elif "sockets" in asset.shape.parameters:
        yield rounded(body, span(hw), (-hd, hd - 0.004), (0.0, height), 0.008)
        total = count(asset, "sockets", 4)
        for k in range(total):
            x = (k + 0.5) / total * (width - 0.03) - hw + 0.015
            yield cylinder("plastic_light", height * 0.68, 0.007, (x, hd - 0.0045, height / 2.0), ALONG_Y)
            for side in (-1.0, 1.0):
                yield cylinder("print_black", 0.006, 0.002, (x + side * 0.010, hd - 0.001, height / 2.0), ALONG_Y)
    elif flag(asset, "dispenser"):
        yield rounded(body, span(hw), (-hd, hd - 0.003), (0.0, height - 0.003), 0.02)
        if height > width:
            yield block("print_black", span(hw * 0.7), (hd - 0.03, hd - 0.002), (0.0, 0.012))
            yield block("paper", span(hw * 0.6), (hd - 0.02, hd - 0.017), (0.0, 0.03))
            yield block("plastic_dark", span(hw * 0.1), (hd - 0.004, hd), (height * 0.45, height * 0.7))
        else:
            yield ellipsoid("glove", (width * 0.5, depth * 0.4, 0.006), (0.0, 0.0, height - 0.003))
            yield block("paper", span(hw * 0.8), (hd - 0.002, hd), (height * 0.25, height * 0.75))
    elif height < 0.04:
        yield block(body, span(hw), span(hd), (0.0, height * 0.85))
        yield column("paper", min(width, depth) * 0.94, 0.0, 0.0, (height * 0.8, height))
    else:
        yield block("foam", span(hw), (-hd, hd - 0.002), (0.0, height * 0.82))
        yield block(body, span(hw * 0.96), span(hd * 0.96), (height * 0.82, height))
        yield block("signal_blue", span(hw * 0.6), (hd - 0.003, hd), (height * 0.25, height * 0.6))


def _keyboard(hw: float, hd: float, height: float) -> Iterator[Part]:
    yield rounded("plastic_black", span(hw), span(hd), (0.0, height * 0.6), 0.01)
    rows, pitch = 5, (2.0 * hd - 0.02) / 5.0
    for row in range(rows):
        y = -hd + 0.010 + (row + 0.5) * pitch
        for low, high in ((-hw + 0.01, hw * 0.42), (hw * 0.48, hw - 0.01)):
            yield block("plastic_dark", (low, high), span(pitch * 0.4, y), (height * 0.6, height))
