"""Benches of other product ranges: worktop, fronts and support are chosen by parameters."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

from labgym.assets.model import Asset
from labgym.assets.shapes.fixtures import drawer_handle
from labgym.assets.shapes.materials import coating
from labgym.assets.shapes.parts import Part, Point, block
from labgym.assets.shapes.registry import count, extents, flag, shape, text
from labgym.errors import UnknownNameError

TOPS = {
    "white": "epoxy_white",
    "black": "epoxy_black",
    "oak": "oak",
    "steel": "stainless",
    "grey": "laminate_grey",
    "stone": "granite",
}
"""Material of a worktop by the parameter `top`."""
TOP = 0.034
"""Thickness of a worktop, meters."""
SETBACK = 0.03
"""Distance of the fronts from the edge of the worktop, meters: space for their handles."""
FRONT, GAP = 0.018, 0.004
"""Thickness of a front, and gap around it, meters."""
PLINTH = 0.10
CLEAR = 0.14
"""Height of a plinth, and free height below the cupboards of a bench on legs or C-frames, meters."""
POST = 0.05
"""Side of a leg, meters."""
SUPPORTS = ("plinth", "legs", "frame")


@shape("modular_bench")
def modular_bench(asset: Asset) -> Iterator[Part]:
    """A bench from a modular range, for a wall or with `double` an island.

    Parameters: `top`; `front`, a color or oak; `support`: plinth, legs at the corners, or frame (C-shaped feet);
    `doors`, the number of units along each worked side; `double`.
    """
    width, depth, height = extents(asset)
    hw, hd = width / 2.0, depth / 2.0
    top, support = text(asset, "top", "white"), text(asset, "support", "plinth")
    if top not in TOPS:
        raise UnknownNameError("worktop", top, TOPS)
    if support not in SUPPORTS:
        raise UnknownNameError("support of a bench", support, SUPPORTS)
    yield block(TOPS[top], (-hw, hw), (-hd, hd), (height - TOP, height))
    double = flag(asset, "double")
    low = PLINTH if support == "plinth" else CLEAR
    back, front = (-hd + SETBACK + FRONT if double else -hd), hd - SETBACK - FRONT
    edge = hw if support == "plinth" else hw - POST - 0.01
    yield block("laminate_grey", (-edge, edge), (back, front), (low, height - TOP))
    material = "oak" if text(asset, "front", "white") == "oak" else coating(text(asset, "front", "white"))
    for side in (1.0, -1.0) if double else (1.0,):
        at = front if side > 0.0 else back
        yield from _fronts(material, (-edge, edge), at, side, (low, height - TOP), count(asset, "doors", 3))
    if support == "plinth":
        yield block("powder_dark", (-hw + 0.01, hw - 0.01), (back + 0.03, front - 0.05), (0.0, PLINTH))
    else:
        yield from _feet(support, hw, hd, height - TOP)


def _fronts(material: str, x: Point, y: float, side: float, z: Point, units: int) -> Iterator[Part]:
    """Doors with a drawer above them; every second unit is a stack of three drawers."""
    pitch = (x[1] - x[0]) / units
    face = y + side * FRONT
    for k in range(units):
        left, right = x[0] + k * pitch + GAP, x[0] + (k + 1) * pitch - GAP
        shares = (0.0, 0.36, 0.70, 1.0) if k % 2 else (0.0, 0.78, 1.0)
        levels = [z[0] + share * (z[1] - z[0]) for share in shares]
        for bottom, top in pairwise(levels):
            yield block(material, (left, right), (y, face), (bottom + GAP, top - GAP))
            middle, reach = (left + right) / 2.0, min(0.08, pitch * 0.3)
            grip = top - 0.05
            if side > 0.0:
                yield from drawer_handle((middle - reach, middle + reach), face, face + 0.012, grip)
            else:
                yield block(
                    "stainless", (middle - reach, middle + reach), (face, face - 0.012), (grip - 0.005, grip + 0.005)
                )


def _feet(support: str, hw: float, hd: float, top: float) -> Iterator[Part]:
    """Four legs, or two C-shaped frames whose feet lie along the depth."""
    for side in (-1.0, 1.0):
        x = (side * (hw - POST), side * hw)
        if support == "legs":
            for y in ((-hd, -hd + POST), (hd - SETBACK - POST, hd - SETBACK)):
                yield block("powder_dark", x, y, (0.0, top))
        else:
            yield block("powder_white", x, (-hd, hd - SETBACK), (0.0, POST))
            yield block("powder_white", x, (-hd, -hd + 1.6 * POST), (POST, top))
            yield block("powder_white", x, (-hd + 1.6 * POST, hd - SETBACK), (top - POST, top))
