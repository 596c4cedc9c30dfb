"""Fume hoods of other makes: color, sash and base are chosen by parameters."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

from labgym.assets.model import Asset, Cavity
from labgym.assets.shapes.fixtures import drawer_handle, knob, panel_screen
from labgym.assets.shapes.materials import coating
from labgym.assets.shapes.parts import Part, Point, block, column
from labgym.assets.shapes.registry import extents, number, shape, text
from labgym.assets.shapes.storage import cavity
from labgym.errors import UnknownNameError

SASHES = ("vertical", "sliding", "framed")
BASES = ("cupboards", "drawers", "open")
SHEET = 0.008
"""Thickness of the lining, meters."""
REVEAL = 0.03
"""Depth of the controls in front of the posts, meters."""


@shape("modular_hood")
def modular_hood(asset: Asset) -> Iterator[Part]:
    """A fume hood with square posts.

    Parameters: `colour` of the casing; `trim` of fascia and base; `sash`: vertical (one pane), sliding (two panes side
    by side) or framed (a grid of bars); `opening`, the height of the sash above the floor of the hood; `base`:
    cupboards, drawers or open (a frame with a shelf).
    """
    width, depth, height = extents(asset)
    hollow, hw, hd = cavity(asset), width / 2.0, depth / 2.0
    casing, trim = coating(text(asset, "colour", "white")), coating(text(asset, "trim", "grey"))
    x0, x1 = hollow.x - hollow.width / 2.0, hollow.x + hollow.width / 2.0
    back, front = hollow.y - hollow.depth / 2.0, hollow.y + hollow.depth / 2.0
    post = hd - REVEAL
    for x in ((-hw, x0 - SHEET), (x1 + SHEET, hw)):
        yield block(casing, x, (-hd, post), (hollow.z0, hollow.z1))
        yield block("hood_lining", (x[1], x[1] + SHEET) if x[0] < 0.0 else (x[0] - SHEET, x[0]), (back, front),
                    (hollow.z0, hollow.z1))  # fmt: skip
    yield block("hood_lining", (x0, x1), (-hd, back), (hollow.z0, hollow.z1))
    yield block(casing, (-hw, hw), (-hd, post), (hollow.z1, height - 0.05))
    yield column("galvanised", 0.25, 0.0, -0.05, (height - 0.06, height))
    yield block(trim, (-hw, hw), (post, post + 0.012), (hollow.z1 + 0.02, hollow.z1 + 0.12))
    yield from panel_screen("screen_green", (hw - 0.24, hw - 0.12), post, (hollow.z1 + 0.14, hollow.z1 + 0.19))
    yield from _sash(text(asset, "sash", "vertical"), hollow, front, hollow.z0 + number(asset, "opening", 0.46))
    yield from _base(text(asset, "base", "cupboards"), trim, (hw, hd), hollow.z0)
    for k, colour in enumerate(("abs_green", "safety_yellow", "abs_blue")):
        yield from knob(colour, 0.036, (x1 + hw) / 2.0, post, hd, hollow.z0 + 0.16 + 0.09 * k)
    yield block("plastic_white", ((x0 - hw) / 2.0 - 0.03, (x0 - hw) / 2.0 + 0.03), (post, post + 0.01),
                (hollow.z0 + 0.16, hollow.z0 + 0.34))  # fmt: skip


def _sash(kind: str, hollow: Cavity, front: float, low: float) -> Iterator[Part]:
    """Panes above the opening.

    Raises:
        UnknownNameError: there is no such sash.
    """
    if kind not in SASHES:
        raise UnknownNameError("sash", kind, SASHES)
    x0, x1, high = hollow.x - hollow.width / 2.0, hollow.x + hollow.width / 2.0, hollow.z1
    yield block("sash_glass", (x0, x1), (front + 0.010, front + 0.015), (low + 0.03, high))
    yield block("aluminium", (x0, x1), (front + 0.004, front + 0.022), (low, low + 0.035))
    bars = {"vertical": (), "sliding": (0.5,), "framed": (0.25, 0.5, 0.75)}[kind]
    for share in (0.0, *bars, 1.0):
        middle = x0 + 0.012 + share * (x1 - x0 - 0.024)
        yield block("aluminium", (middle - 0.012, middle + 0.012), (front + 0.004, front + 0.020), (low, high))
    if kind == "framed":
        level = (low + high) / 2.0
        yield block("aluminium", (x0, x1), (front + 0.004, front + 0.020), (level - 0.012, level + 0.012))


def _base(kind: str, trim: str, half: Point, top: float) -> Iterator[Part]:
    """The part below the worktop.

    Raises:
        UnknownNameError: there is no such base.
    """
    if kind not in BASES:
        raise UnknownNameError("base of a hood", kind, BASES)
    hw, hd = half
    yield block("phenolic_black", (-hw, hw), (-hd, hd), (top - 0.04, top))
    face, crown = hd - 0.05, top - 0.04
    if kind == "open":
        for x in ((-hw, -hw + 0.06), (hw - 0.06, hw)):
            for y in ((-hd, -hd + 0.06), (face - 0.06, face)):
                yield block("powder_grey", x, y, (0.0, crown))
        yield block("powder_grey", (-hw + 0.06, hw - 0.06), (-hd + 0.02, face - 0.02), (0.18, 0.22))
        yield block(trim, (-hw + 0.06, hw - 0.06), (face - 0.03, face), (crown - 0.12, crown))
        return
    yield block("powder_grey", (-hw, hw), (-hd, face - 0.02), (0.08, crown))
    yield block("powder_dark", (-hw + 0.02, hw - 0.02), (-hd + 0.02, face - 0.08), (0.0, 0.08))
    units = max(2, round(2.0 * hw / 0.6))
    levels = (0.084, crown - 0.004) if kind == "cupboards" else (0.084, 0.36, 0.62, crown - 0.004)
    for k in range(units):
        left, right = -hw + 2.0 * hw * k / units + 0.004, -hw + 2.0 * hw * (k + 1) / units - 0.004
        for low, high in pairwise(levels):
            yield block(trim, (left, right), (face - 0.02, face), (low, high - 0.006))
            middle = (left + right) / 2.0
            yield from drawer_handle((middle - 0.07, middle + 0.07), face, face + 0.02, high - 0.06)
