"""Stands that hold glassware in place: base, rods, clamps, rings, and what joins the pieces of an apparatus.

The parameters are lists of numbers in meters, separated by spaces, of several parts separated by semicolons.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from labgym.assets.model import Asset
from labgym.assets.shapes.flasks import GLASS, bulb
from labgym.assets.shapes.parts import ALONG_Y, Part, block, column, cylinder, revolved, rod, rounded, tube
from labgym.assets.shapes.registry import extents, flag, shape, text
from labgym.errors import OptionError

ROD = 0.012
"""Diameter of a rod, meters."""
BASE = 0.010
"""Thickness of a base plate, meters."""
PLATE = 0.006
"""Thickness of the plate below a well, meters."""
PAD = 0.006
"""Thickness of the pads of a clamp, meters."""


@shape("apparatus_stand")
def apparatus_stand(asset: Asset) -> Iterator[Part]:
    """A stand for an apparatus.

    Parameters: `rods` (x, y, top), `clamps` (x, y, z, radius of what they hold, y of their rod), `rings` (the same,
    of steel), `corks` and `wells` for joints (x, y, top, inner and outer radius), `blocks` (x, y, bottom, top,
    radius of the flask), `cones` of rubber (x, y, bottom, top, radii there and of the hole), `bends` of glass (x
    and z of both ends; y), `rack` (plates with holes).
    """
    width, depth, height = extents(asset)
    hw, hd = width / 2.0, depth / 2.0
    if flag(asset, "rack"):
        yield from _rack(asset, hw, hd)
    else:
        yield from _base(asset, hw, hd, height)
    for x, y, top in _rows(asset, "rods", 3):
        yield column("stainless", ROD, x, y, (height, top))
    for x, y, z, radius, back in _rows(asset, "clamps", 5):
        yield from _arm(x, back, y - radius - 0.012, z)
        yield from _jaws(x, y, z, radius)
    for x, y, z, radius, back in _rows(asset, "rings", 5):
        yield from _arm(x, back, y - radius - 0.004, z - 0.004)
        outer = radius + 0.008
        ring = [(radius, z - 0.008), (outer, z - 0.008), (outer, z), (radius, z), (radius, z - 0.008)]
        yield revolved("cast_iron", ring, (x, y, 0.0))
    for x, y, low, high, radius in _rows(asset, "blocks", 5):
        yield _block(x, y, low, high, radius)
    for x, y, low, high, below, above, bore in _rows(asset, "cones", 7):
        yield revolved("rubber", [(bore, low), (below, low), (above, high), (bore, high), (bore, low)], (x, y, 0.0))
    for x0, z0, x1, z1, y in _rows(asset, "bends", 5):
        rise = x1 - x0
        yield from tube(GLASS, 0.020, [(x0, y, z0), (x0 + rise, y, z0 + rise), (x1, y, z1 - 0.012)])
        yield revolved(GLASS, [(0.011, z1 - 0.02), (0.0135, z1 - 0.01), (0.0135, z1)], (x1, y, 0.0))


def _base(asset: Asset, hw: float, hd: float, height: float) -> Iterator[Part]:
    """The base of a stand with rods, or a block or ring of cork."""
    wells, corks = _rows(asset, "wells", 5), _rows(asset, "corks", 5)
    if wells:
        yield rounded("cork", (-hw, hw), (-hd, hd), (0.0, PLATE), 0.008)
    elif not corks:
        yield rounded("cast_iron", (-hw, hw), (-hd, hd), (0.0, height), 0.012)
    elif max(hw, hd) > max(outer for *_, outer in corks) + 1e-6:
        yield rounded("cork", (-hw, hw), (-hd, hd), (0.0, BASE), 0.012)
    for low, rings in ((PLATE, wells), (0.0, corks)):
        for x, y, top, inner, outer in rings:
            ring = [(inner, low), (outer, low), (outer, top), (inner, top), (inner, low)]
            yield revolved("cork", ring, (x, y, 0.0))


def _arm(x: float, back: float, front: float, z: float) -> Iterator[Part]:
    """The boss on a rod at y = `back`, and the arm from it to y = `front`."""
    yield block("cast_iron", (x - 0.014, x + 0.014), (back - 0.014, back + 0.022), (z - 0.010, z + 0.010))
    yield cylinder("chrome", 0.009, front - back, (x, (front + back) / 2.0, z), ALONG_Y)
    yield cylinder("cast_iron", 0.018, 0.006, (x + 0.016, back, z), (math.sqrt(0.5), 0.0, math.sqrt(0.5), 0.0))


def _jaws(x: float, y: float, z: float, radius: float) -> Iterator[Part]:
    """Two jaws whose pads touch a round piece from both sides."""
    root = y - radius - 0.014
    for side in (-1.0, 1.0):
        outer = side * (radius + PAD + 0.004)
        yield rod("cast_iron", 0.009, (x, root, z), (x + outer, root + 0.006, z))
        yield rod("cast_iron", 0.009, (x + outer, root + 0.006, z), (x + outer, y + 0.008, z))
        faces = sorted((x + side * radius, x + side * (radius + PAD)))
        yield block("rubber", (faces[0], faces[1]), (y - 0.007, y + 0.007), (z - 0.008, z + 0.008))


def _block(x: float, y: float, low: float, high: float, radius: float) -> Part:
    """An aluminum heating block with a nest for the lower third of a flask."""
    wall = radius + 0.014
    nest = [(r, low + 0.006 + z) for r, z in bulb(radius + 0.001, radius, 0.0, 1.25, 6)]
    sides = [(0.0, low), (wall, low), (wall, high), (nest[-1][0], high)]
    return revolved("aluminium", [*sides, *reversed(nest)], (x, y, 0.0))


def _rack(asset: Asset, hw: float, hd: float) -> Iterator[Part]:
    """A rack of two posts and two plates; every slot of the asset has a sleeve in the upper one."""
    _, _, height = extents(asset)
    top = max(fitting.z1 for fitting in asset.fittings)
    yield rounded("plastic_white", (-hw, hw), (-hd, hd), (0.0, height), 0.008)
    for side in (-1.0, 1.0):
        yield block("plastic_white", (side * hw, side * (hw - 0.012)), (-hd * 0.5, hd * 0.5), (height, top))
    for z in (top - 0.006, (height + top) / 2.0):
        reach = hd * 0.8
        for surface in asset.surfaces:
            ring = [(surface.width / 2.0, z - 0.002), (surface.width / 2.0 + 0.004, z - 0.002)]
            ring += [(surface.width / 2.0 + 0.004, z + 0.006), (surface.width / 2.0, z + 0.006), ring[0]]
            yield revolved("plastic_light", ring, (surface.x, surface.y, 0.0))
        yield block("plastic_white", (-hw, hw), (-reach, -reach + 0.008), (z - 0.002, z + 0.006))
        yield block("plastic_white", (-hw, hw), (reach - 0.008, reach), (z - 0.002, z + 0.006))


def _rows(asset: Asset, name: str, length: int) -> list[tuple[float, ...]]:
    """Return a parameter's parts, each with that many numbers.

    Raises:
        OptionError: it has another number of numbers, or something else.
    """
    rows = []
    for row in filter(None, (part.strip() for part in text(asset, name, "").split(";"))):
        try:
            numbers = tuple(float(word) for word in row.split())
        except ValueError:
            numbers = ()
        if len(numbers) != length:
            raise OptionError(
                f"shape parameter {name!r} of asset {asset.name!r} must hold {length} numbers a part, got {row!r}"
            )
        rows.append(numbers)
    return rows
