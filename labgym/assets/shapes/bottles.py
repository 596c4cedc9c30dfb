"""Bottles, jars and vials, with hazard labels, and waste canisters."""

from __future__ import annotations

import math
from collections.abc import Iterator

from labgym.assets.model import Asset
from labgym.assets.shapes.materials import coating
from labgym.assets.shapes.parts import (
    ALONG_X,
    Part,
    Point,
    band,
    block,
    column,
    cylinder,
    plate,
    revolved,
    rod,
    rounded,
    turned,
)
from labgym.assets.shapes.registry import extents, flag, shape, text
from labgym.errors import UnknownNameError

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
    kind = text(asset, "glass", "clear")
    if kind not in WALLS:
        raise UnknownNameError("glass", kind, WALLS)
    return WALLS[kind]


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
        yield block(
            "print_black",
            (line / 2.0 - length, line / 2.0),
            (radius - 0.0018, radius),
            (z - 0.025 * tall, z + 0.025 * tall),
        )
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
    width, depth, height = extents(asset)
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
    width, _, height = extents(asset)
    radius, cap = width / 2.0 - 0.0006, height * 0.80
    neck = radius * 0.80
    plastic = text(asset, "glass", "plastic") == "plastic"
    yield revolved(
        "plastic_white" if plastic else wall(asset),
        [*shouldered(radius, neck, height * 0.70, cap), (neck, height * 0.9)],
    )
    yield from label(asset, width / 2.0 - 0.0002, height * 0.12, height * 0.66)
    storage = asset.chemistry.storage_class if asset.chemistry else "General"
    colour = CAPS.get(storage, "plastic_black")
    yield column("abs_blue" if plastic and colour == "plastic_white" else colour, 2.12 * neck, 0.0, 0.0, (cap, height))


@shape("vial")
def vial(asset: Asset) -> Iterator[Part]:
    """A small sample vial with a screw cap."""
    width, _, height = extents(asset)
    radius, shoulder = width / 2.0, height * 0.74
    yield revolved(
        "borosilicate", [*shouldered(radius, radius * 0.7, shoulder, shoulder + 0.006), (radius * 0.7, height * 0.85)]
    )
    yield column("yellow_liquid", 1.86 * radius, 0.0, 0.0, (0.0015, height * 0.4))
    yield column("plastic_black", 1.74 * radius, 0.0, 0.0, (height * 0.80, height))


@shape("drum")
def waste_canister(asset: Asset) -> Iterator[Part]:
    """A plastic canister with a handle, a label and a screw cap."""
    width, depth, height = extents(asset)
    hw, hd, top, body = width / 2.0, depth / 2.0, height * 0.84, coating(text(asset, "colour", "blue"))
    yield rounded(body, (-hw, hw), (-hd, hd - 0.004), (0.0, top), 0.04)
    yield rounded(body, (-hw * 0.86, hw * 0.86), (-hd * 0.86, hd * 0.86), (top, height * 0.89), 0.04)
    yield block("paper", (-hw * 0.6, hw * 0.6), (hd - 0.005, hd - 0.003), (height * 0.25, height * 0.62))
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
        yield block(body, (x - 0.012, x + 0.012), (-0.015, 0.015), (height * 0.88, height * 0.96))
    yield block(body, (-hw * 0.65 - 0.012, 0.012), (-0.015, 0.015), (height * 0.955, height))
