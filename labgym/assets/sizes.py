"""Plausible sizes of classes of assets, and the unit error that explains a size outside them."""

from __future__ import annotations

from dataclasses import dataclass

from labgym.assets.model import Asset, Kind, Placing


@dataclass(frozen=True)
class Bounds:
    """Least and greatest side of a bounding box, meters."""

    least: float
    greatest: float


GLASSWARE = Bounds(0.005, 0.90)
BENCH_TOP = Bounds(0.004, 1.60)
CONTAINER = Bounds(0.03, 0.50)
CYLINDER = Bounds(0.05, 1.80)
FLOOR_STANDING = Bounds(0.15, 3.50)
ON_WALL = Bounds(0.01, 3.50)
PLACED_ON_FLOOR = 5.0
"""Greatest side of an object on the floor whose size the layout states, meters: a row of units may be one object."""

GLASS_CATEGORIES = ("glassware", "ceramic")
_SLIPS = {
    1000.0: "meters divided by 1000",
    100.0: "meters divided by 100",
    10.0: "meters divided by 10",
    0.0254: "inches",
    0.01: "centimeters",
    0.001: "millimeters",
}
"""Factor that corrects the size, and the unit that was then used instead of meters."""


def bounds(asset: Asset) -> Bounds:
    """Return the permitted side lengths of an asset of this kind, category and placing."""
    return bounds_of(asset.kind, asset.category, asset.placing, asset.phase == "gas")


def bounds_of(kind: Kind, category: str, placing: Placing, gas: bool = False) -> Bounds:
    """Return the permitted side lengths of an asset; `gas` applies to reagents only."""
    if kind == "reagent":
        return CYLINDER if gas else CONTAINER
    if placing == "floor":
        return FLOOR_STANDING
    if placing == "wall":
        return ON_WALL
    return GLASSWARE if category in GLASS_CATEGORIES else BENCH_TOP


def size_problem(asset: Asset, on_floor: bool = False) -> str | None:
    """Return why an asset's size is implausible, with the likely unit; None if it is plausible.

    Args:
        on_floor: whether it is the size of an object that a layout places on the floor.
    """
    allowed = bounds(asset)
    if on_floor:
        allowed = Bounds(allowed.least, PLACED_ON_FLOOR)
    sides = (asset.size.width, asset.size.depth, asset.size.height)
    if all(allowed.least <= side <= allowed.greatest for side in sides):
        return None
    measured = " x ".join(f"{side:g}" for side in sides)
    what = f"{asset.placing} {asset.kind} of category {asset.category!r}"
    slips = _likely_slips(sides, allowed)
    remedy = f"likely given in {' or '.join(slips)}" if slips else "give width, depth and height in meters"
    expected = f"outside {allowed.least:g} to {allowed.greatest:g} m for a {what}"
    return f"size {measured} m of {asset.name!r} is {expected}; {remedy}"


def _likely_slips(sides: tuple[float, ...], allowed: Bounds) -> list[str]:
    """Return the unit errors whose correction brings every side into bounds."""
    return [
        name
        for factor, name in _SLIPS.items()
        if all(allowed.least <= side * factor <= allowed.greatest for side in sides)
    ]
