"""Fume hoods, the glove box and the exhaust arm."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

from labgym.assets.model import Asset, Cavity
from labgym.assets.shapes.fixtures import diamond, drawer_handle, frame, knob, panel_screen
from labgym.assets.shapes.furniture import GAP_M, KICK_M, recess
from labgym.assets.shapes.joints import door, hidden, moving, sash
from labgym.assets.shapes.materials import coating
from labgym.assets.shapes.parts import (
    ALONG_X,
    ALONG_Y,
    Part,
    Point,
    block,
    collar,
    column,
    cylinder,
    ellipsoid,
    revolved,
    rod,
    rounded,
    side_profile,
    span,
    sphere,
)
from labgym.assets.shapes.registry import choice, count, extents, flag, number, shape, text
from labgym.assets.shapes.storage import cavity


@shape("fume_hood")
def fume_hood(asset: Asset) -> Iterator[Part]:
    """A fume hood with a raised sash, a dark lined inside, an airfoil sill and posts; `walk_in` opens to the floor."""
    hollow = cavity(asset)
    _, _, height, hw, hd = extents(asset)
    x0, x1, back, front = hollow.edges
    post = hd - 0.03
    for x in ((-hw, x0 - LINING_M), (x1 + LINING_M, hw)):
        yield rounded("powder_grey", x, (front - 0.06, post), (hollow.z0, hollow.z1), 0.012)
        yield block("powder_white", x, (-hd, front - 0.06), (hollow.z0, hollow.z1))
    yield block("powder_white", (x0, x1), (-hd, back - 0.03), (hollow.z0, hollow.z1))
    yield block("powder_white", span(hw), (-hd, post), (hollow.z1, height - 0.05))
    yield from _inside(x0, x1, back, front, hollow.z0, hollow.z1)
    stop = number(asset, "sash", 0.46)
    low = hollow.z0 + stop
    joint = sash((x0, x1), (front + 0.006, front + 0.022), (low, hollow.z1), hollow.z0, low)
    yield from moving(joint, _sash(x0, x1, front, hd, low, hollow.z1))
    # A fixed pane covers what the lowered sash leaves open.
    pane = (x0, x1), (front + 0.001, front + 0.004), (max(hollow.z1 - stop - 0.02, low), hollow.z1)
    yield from hidden([block("sash_glass", *pane)])
    yield from _fascia(hw, post, hollow.z1, height)
    yield column("galvanised", 0.25, 0.0, -0.05, (height - 0.06, height))
    if flag(asset, "walk_in"):
        yield block("stainless", span(hw), (-hd, hd - 0.03), (0.0, hollow.z0))
        yield block("safety_yellow", span(hw), (hd - 0.03, hd), (0.0, hollow.z0 * 0.6))
    else:
        yield from _base(hw, hd, hollow.z0)
    yield from _services((x1 + hw) / 2.0, -(x1 + hw) / 2.0, post, hd, hollow.z0)


def _inside(x0: float, x1: float, back: float, front: float, low: float, high: float) -> Iterator[Part]:
    for x in ((x0 - LINING_M, x0), (x1, x1 + LINING_M)):
        yield block("hood_lining", x, (back, front), (low, high))
    yield block("hood_lining", (x0, x1), (back - 0.03, back - 0.022), (low, high))
    # Two baffles with an exhaust slot between and above them.
    slot, middle = 0.025, low + 0.42 * (high - low)
    yield block("powder_grey", (x0, x1), (back - 0.012, back), (low + slot, middle))
    yield block("powder_grey", (x0, x1), (back - 0.012, back), (middle + slot, high - 0.06))
    yield block("hood_lining", (x0, x1), (back, front - 0.05), (high - 0.001, high + 0.004))
    yield block("lamp", (x0 + 0.2, x1 - 0.2), span(0.06), (high - 0.004, high - 0.001))


def _sash(x0: float, x1: float, front: float, edge: float, low: float, high: float) -> Iterator[Part]:
    y = front + 0.006
    yield block("sash_glass", (x0, x1), (y + 0.004, y + 0.009), (low + 0.03, high))
    yield block("aluminium", (x0, x1), (y, y + 0.016), (low, low + 0.032))
    yield block("aluminium", (x0 + 0.15, x1 - 0.15), (y + 0.014, min(y + 0.034, edge)), (low + 0.004, low + 0.016))
    for x in ((x0 - LINING_M, x0 + 0.022), (x1 - 0.022, x1 + LINING_M)):
        yield block("aluminium", x, (y, y + 0.014), (low, high))


def _fascia(hw: float, y: float, low: float, height: float) -> Iterator[Part]:
    yield block("signal_blue", span(hw - 0.002), (y - 0.004, y + 0.003), (low, low + 0.03))
    yield from panel_screen("screen_green", (-hw + 0.09, -hw + 0.20), y, (low + 0.075, low + 0.135))
    yield block("powder_grey", span(hw * 0.4), (y, y + 0.002), (low + 0.07, height - 0.08))


def _base(hw: float, hd: float, top: float) -> Iterator[Part]:
    yield block("phenolic_black", span(hw), (-hd, hd - 0.04), (top - 0.035, top))
    sill = [(hd - 0.04, top - 0.035), (hd - 0.006, top - 0.035), (hd, top - 0.024), (hd, top - 0.014), (hd - 0.04, top)]
    yield side_profile("stainless", sill, span(hw))
    face, crown = hd - 0.045, top - 0.11
    yield block("powder_grey", span(hw), (-hd, face), (crown, top - 0.035))
    yield block("powder_white", span(hw), (-hd, face - 0.02), (KICK_M, crown))
    yield block("powder_dark", span(hw - 0.01), (-hd + 0.01, face - 0.07), (0.0, KICK_M))
    doors = max(2, round(2.0 * hw / 0.6))
    pitch = 2.0 * hw / doors
    for k in range(doors):
        left = -hw + k * pitch
        x, y, z = (left + GAP_M, left + pitch - GAP_M), (face - 0.02, face), (KICK_M + GAP_M, crown - GAP_M)
        hazard = k == 0
        handle = left + pitch - 0.05 if k % 2 == 0 else left + 0.05
        leaf = [
            block("safety_yellow" if hazard else "laminate_white", x, y, z),
            block("stainless", span(0.006, handle), (face, face + 0.018), (crown - 0.24, crown - 0.06)),
        ]
        if hazard:
            leaf += diamond("flammable", 0.14, left + pitch / 2.0, face, (KICK_M + crown) / 2.0)
        yield from moving(door(f"door_{k + 1}", "cupboard door", (x, y, z), "high" if k % 2 else "low"), leaf)
        yield from hidden(recess(x, face - 0.02, z))


def _services(right: float, left: float, y: float, edge: float, low: float) -> Iterator[Part]:
    """Colored service valves and sockets on the posts."""
    for k, color in enumerate(("abs_green", "signal_blue", "safety_yellow")):
        yield from knob(color, 0.034, right, y, edge, low + 0.22 + 0.10 * k)
        yield from knob(("safety_red", "plastic_white", "abs_blue")[k], 0.034, left, y, edge, low + 0.22 + 0.10 * k)
    for x in (left, right):
        yield block("plastic_white", span(0.035, x), (y, y + 0.008), (low + 0.06, low + 0.14))
        yield cylinder("plastic_dark", 0.036, 0.002, (x, y + 0.008, low + 0.10), ALONG_Y)


@shape("glovebox")
def glove_box(asset: Asset) -> Iterator[Part]:
    """A glove box on a stand: a sloping look, a window with glove ports, gloves inside, an antechamber at the side."""
    hollow = cavity(asset)
    _, depth, height, hw, hd = extents(asset)
    x0, x1, back, front = hollow.edges
    left, right, face = -hw, min(x1 + (x0 + hw), hw), hd - 0.03
    yield block("stainless", (left, right), (-hd, face), (hollow.z0 - 0.05, hollow.z0))
    yield block("stainless", (left, right), (-hd, face), (hollow.z1, hollow.z1 + 0.05))
    yield block("stainless", (left, right), (-hd, back), (hollow.z0, hollow.z1))
    yield block("stainless", (left, x0), (back, face), (hollow.z0, hollow.z1))
    yield block("stainless", (x1, right), (back, face), (hollow.z0, hollow.z1))
    yield from _window(x0, x1, front, face, hollow.z0, hollow.z1)
    yield from _ports(asset, (x0, x1), face, hd, hollow.z0 + 0.30 * (hollow.z1 - hollow.z0))
    yield block("powder_white", (left + 0.2, right - 0.2), (-hd + 0.1, hd - 0.2), (hollow.z1 + 0.05, height - 0.02))
    yield column("stainless", 0.08, hollow.x, -hd + 0.2, (height - 0.03, height))
    yield block("lamp", (x0 + 0.15, x1 - 0.15), (front - 0.10, front - 0.06), (hollow.z1 - 0.012, hollow.z1 - 0.002))
    middle = (right + hw) / 2.0
    bore, z = min(0.34, depth * 0.5), hollow.z0 + 0.36 * (hollow.z1 - hollow.z0)
    yield cylinder("stainless", bore, hw - right - 0.03, (middle - 0.015, 0.0, z), ALONG_X)
    yield cylinder("chrome", bore * 1.15, 0.03, (hw - 0.015, 0.0, z), ALONG_X)
    yield rod("plastic_black", 0.02, (hw - 0.035, bore * 0.62, z), (hw - 0.035, bore * 0.62, z + 0.12))
    yield from _stand(left, right, hw, hd, hollow.z0 - 0.05)


def _window(x0: float, x1: float, front: float, face: float, low: float, high: float) -> Iterator[Part]:
    rail = 0.035
    yield from frame("powder_dark", (x0, x1), (front + 0.004, face), (low, high), rail)
    yield block("sash_glass", (x0 + rail, x1 - rail), (front + 0.012, front + 0.020), (low + rail, high - rail))


def _ports(asset: Asset, x: tuple[float, float], face: float, edge: float, z: float) -> Iterator[Part]:
    ports = count(asset, "ports", 2)
    bore, pitch = 0.20, (x[1] - x[0]) / ports
    for k in range(ports):
        middle = x[0] + (k + 0.5) * pitch
        middle += 0.12 * (1.0 if middle < (x[0] + x[1]) / 2.0 else -1.0) if ports == 2 else 0.0
        # The axis runs along +y, so the ring stands out of the window.
        reach = (0.0, edge - face + 0.008)
        yield collar("plastic_black", (bore * 0.40, bore * 0.56), reach, (middle, face - 0.008, z), ALONG_Y)
        yield cylinder("glove", bore * 0.80, 0.012, (middle, face + 0.002, z), ALONG_Y)
        yield ellipsoid("glove", (bore * 0.6, 0.036, bore * 0.6), (middle, face - 0.004, z))


def _stand(left: float, right: float, hw: float, hd: float, top: float) -> Iterator[Part]:
    for x in (left + 0.05, right - 0.05):
        for y in (-hd + 0.05, hd - 0.10):
            yield block("powder_grey", span(0.03, x), span(0.03, y), (0.0, top))
    yield block("powder_grey", (left + 0.05, right - 0.05), (-hd + 0.03, -hd + 0.07), (0.30, 0.36))
    yield rounded("powder_white", (left + 0.12, right - 0.12), (-hd + 0.12, hd - 0.16), (0.08, 0.62), 0.02)
    yield block("powder_dark", (left + 0.16, right - 0.16), (hd - 0.162, hd - 0.155), (0.12, 0.34))
    yield from panel_screen("screen", (right - 0.42, right - 0.20), hd - 0.16, (0.44, 0.56))
    yield block("powder_grey", (right - 0.1, hw - 0.04), span(0.03), (top * 0.5, top * 0.5 + 0.05))
    yield block("powder_grey", (hw - 0.10, hw - 0.04), span(0.03), (0.0, top * 0.95))
    yield block("plastic_dark", (left + 0.2, right - 0.2), (hd - 0.16, hd - 0.06), (0.02, 0.05))


@shape("arm")
def exhaust_arm(asset: Asset) -> Iterator[Part]:
    """An extraction arm on a wall: two jointed tubes along y with a bell at the end."""
    _, _, height, hw, hd = extents(asset)
    yield block("powder_grey", span(hw), (-hd, -hd + 0.03), (height * 0.30, height * 0.80))
    bore, bell = 0.075, min(0.12, hw)
    elbow, end = (0.0, 0.0, height - bore / 2.0 - 0.02), (0.0, hd - bell, height * 0.5)
    yield rod("aluminium", bore, (0.0, -hd + 0.02, height * 0.55), elbow, flat=True)
    yield sphere("signal_blue", bore * 1.45, (0.0, 0.0, height - bore * 0.725))
    yield rod("aluminium", bore, elbow, end, flat=True)
    yield sphere("signal_blue", bore * 1.3, end)
    yield revolved(
        "polypropylene",
        [(bell, 0.0), (bell * 0.9, 0.06), (bore * 0.5, height * 0.34), (bore * 0.5, height * 0.5)],
        (0.0, end[1], 0.0),
    )


SASHES = ("vertical", "sliding", "framed")
BASES = ("cupboards", "drawers", "open")
LINING_M = 0.008
"""Thickness of the lining, meters."""
REVEAL_M = 0.03
"""Depth of the controls in front of the posts, meters."""


@shape("modular_hood")
def modular_hood(asset: Asset) -> Iterator[Part]:
    """A fume hood with square posts.

    Parameters: `colour` of the casing; `trim` of fascia and base; `sash`: vertical (one pane), sliding (two panes side
    by side) or framed (a grid of bars); `opening`, the height of the sash above the floor of the hood; `base`:
    cupboards, drawers or open (a frame with a shelf).
    """
    _, _, height, hw, hd = extents(asset)
    hollow = cavity(asset)
    casing, trim = coating(text(asset, "colour", "white")), coating(text(asset, "trim", "grey"))
    x0, x1, back, front = hollow.edges
    post = hd - REVEAL_M
    for x in ((-hw, x0 - LINING_M), (x1 + LINING_M, hw)):
        yield block(casing, x, (-hd, post), (hollow.z0, hollow.z1))
        yield block("hood_lining", (x[1], x[1] + LINING_M) if x[0] < 0.0 else (x[0] - LINING_M, x[0]), (back, front),
                    (hollow.z0, hollow.z1))  # fmt: skip
    yield block("hood_lining", (x0, x1), (-hd, back), (hollow.z0, hollow.z1))
    yield block(casing, span(hw), (-hd, post), (hollow.z1, height - 0.05))
    yield column("galvanised", 0.25, 0.0, -0.05, (height - 0.06, height))
    yield block(trim, span(hw), (post, post + 0.012), (hollow.z1 + 0.02, hollow.z1 + 0.12))
    yield from panel_screen("screen_green", (hw - 0.24, hw - 0.12), post, (hollow.z1 + 0.14, hollow.z1 + 0.19))
    yield from _panes(
        choice(asset, "sash", "vertical", SASHES, "sash"), hollow, front, hollow.z0 + number(asset, "opening", 0.46)
    )
    yield from _underframe(choice(asset, "base", "cupboards", BASES, "base of a hood"), trim, (hw, hd), hollow.z0)
    for k, color in enumerate(("abs_green", "safety_yellow", "abs_blue")):
        yield from knob(color, 0.036, (x1 + hw) / 2.0, post, hd, hollow.z0 + 0.16 + 0.09 * k)
    yield block("plastic_white", span(0.03, (x0 - hw) / 2.0), (post, post + 0.01),
                (hollow.z0 + 0.16, hollow.z0 + 0.34))  # fmt: skip


def _panes(kind: str, hollow: Cavity, front: float, low: float) -> Iterator[Part]:
    """Panes above the opening."""
    x0, x1, _, _ = hollow.edges
    high = hollow.z1
    yield block("sash_glass", (x0, x1), (front + 0.010, front + 0.015), (low + 0.03, high))
    yield block("aluminium", (x0, x1), (front + 0.004, front + 0.022), (low, low + 0.035))
    bars = {"vertical": (), "sliding": (0.5,), "framed": (0.25, 0.5, 0.75)}[kind]
    for share in (0.0, *bars, 1.0):
        middle = x0 + 0.012 + share * (x1 - x0 - 0.024)
        yield block("aluminium", span(0.012, middle), (front + 0.004, front + 0.020), (low, high))
    if kind == "framed":
        level = (low + high) / 2.0
        yield block("aluminium", (x0, x1), (front + 0.004, front + 0.020), span(0.012, level))


def _underframe(kind: str, trim: str, half: Point, top: float) -> Iterator[Part]:
    """The part below the worktop."""
    hw, hd = half
    yield block("phenolic_black", span(hw), span(hd), (top - 0.04, top))
    face, crown = hd - 0.05, top - 0.04
    if kind == "open":
        for x in ((-hw, -hw + 0.06), (hw - 0.06, hw)):
            for y in ((-hd, -hd + 0.06), (face - 0.06, face)):
                yield block("powder_grey", x, y, (0.0, crown))
        yield block("powder_grey", span(hw - 0.06), (-hd + 0.02, face - 0.02), (0.18, 0.22))
        yield block(trim, span(hw - 0.06), (face - 0.03, face), (crown - 0.12, crown))
        return
    yield block("powder_grey", span(hw), (-hd, face - 0.02), (0.08, crown))
    yield block("powder_dark", span(hw - 0.02), (-hd + 0.02, face - 0.08), (0.0, 0.08))
    units = max(2, round(2.0 * hw / 0.6))
    levels = (0.084, crown - 0.004) if kind == "cupboards" else (0.084, 0.36, 0.62, crown - 0.004)
    for k in range(units):
        left, right = -hw + 2.0 * hw * k / units + 0.004, -hw + 2.0 * hw * (k + 1) / units - 0.004
        for low, high in pairwise(levels):
            yield block(trim, (left, right), (face - 0.02, face), (low, high - 0.006))
            middle = (left + right) / 2.0
            yield from drawer_handle(span(0.07, middle), face, face + 0.02, high - 0.06)
