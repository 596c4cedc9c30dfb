"""Benches, islands, desks and sinks."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator
from itertools import pairwise

from labgym.assets.model import Asset
from labgym.assets.shapes.fixtures import castors, drawer_handle
from labgym.assets.shapes.joints import DRAWER_DEPTH_M, DRAWER_RIM_SHARE, door, drawer, hidden, moving
from labgym.assets.shapes.materials import coating
from labgym.assets.shapes.parts import Part, Point, block, column, rod, rounded, span, tube
from labgym.assets.shapes.registry import choice, count, extents, flag, shape, text

TOP_M = 0.034
"""Thickness of a worktop, meters."""
KICK_M = 0.10
"""Height of a toe kick, meters."""
OVERHANG_M = 0.034
"""Overhang of a worktop beyond the cupboards below, meters: space for their handles."""
GAP_M = 0.004


def cupboards(
    x: Point,
    y: float,
    top: float,
    units: int,
    depth: float,
    *,
    side: float = 1.0,
    prefix: str = "",
    end: float = math.inf,
) -> Iterator[Part]:
    """Doors under drawers on a front at y that looks along `side` * y; handles reach 22 mm further.

    Every third unit is a stack of drawers.

    Args:
        depth: depth of the furniture behind the front, meters.
        prefix: of the names of the moving parts.
        end: units that reach beyond this x are false fronts.
    """
    pitch = (x[1] - x[0]) / units
    front = y + side * 0.018
    bench_drawer = top - 0.17
    count: Counter[str] = Counter()
    for k in range(units):
        left, right = x[0] + k * pitch + GAP_M, x[0] + (k + 1) * pitch - GAP_M
        stack = k % 3 == 1
        levels = [KICK_M + GAP_M, bench_drawer, top - GAP_M]
        if stack:
            levels.insert(1, KICK_M + (bench_drawer - KICK_M) * 0.5)
        for n, (low, high) in enumerate(pairwise(levels)):
            z = (low, high - GAP_M)
            panel = [block("laminate_white", (left, right), (y, front), z)]
            is_drawer = stack or n == 1
            if is_drawer:
                middle = (left + right) / 2.0
                reach = min(0.09, pitch * 0.3)
                panel += _pull((middle - reach, middle + reach), front, side, high - 0.045)
            else:
                edge = right - 0.045 if k % 2 == 0 else left + 0.045
                handle = (edge - 0.006, edge + 0.006), (front, front + side * 0.016), (high - 0.22, high - 0.05)
                panel.append(block("stainless", *handle))
            if right > end:
                yield from panel
                continue
            kind = "drawer" if is_drawer else "door"
            count[kind] += 1
            name = f"{prefix}{kind}_{count[kind]}"
            if is_drawer:
                yield from pulled_out(name, panel, (left, right), front, z, min(DRAWER_DEPTH_M, depth), side)
            else:
                leaf = (left, right), (y, front), z
                yield from moving(door(name, "cupboard door", leaf, "high" if k % 2 else "low", side), panel)
            yield from hidden(recess((left, right), y, z, side))


def pulled_out(
    name: str, panel: list[Part], x: Point, front: float, z: Point, depth: float, side: float = 1.0
) -> Iterator[Part]:
    """A drawer: the panel in front, and the box behind it, which only an open drawer shows."""
    joint = drawer(name, x, front, z, depth, side)
    yield from moving(joint, panel)
    board, behind = 0.012, front - side * 0.014
    end = front - side * depth
    low, rim = z[0] + 0.015, z[0] + DRAWER_RIM_SHARE * (z[1] - z[0])
    box = [block("laminate_grey", (x[0] + board, x[1] - board), (behind, end), (low, low + board))]
    box += [
        block("laminate_grey", side_wall, (behind, end), (low + board, rim))
        for side_wall in ((x[0] + board, x[0] + 2.0 * board), (x[1] - 2.0 * board, x[1] - board))
    ]
    inside = (x[0] + 2.0 * board, x[1] - 2.0 * board)
    box.append(block("laminate_grey", inside, (end, end + side * board), (low + board, rim)))
    yield from moving(joint, hidden(box))


def recess(x: Point, y: float, z: Point, side: float = 1.0) -> Iterator[Part]:
    """The dark opening behind a front whose inner face is at y."""
    inset = 0.012
    opening = (x[0] + inset, x[1] - inset), (y, y + side * 0.001), (z[0] + inset, z[1] - inset)
    yield block("powder_dark", *opening)


def _pull(x: Point, y: float, side: float, z: float) -> Iterator[Part]:
    if side > 0.0:
        yield from drawer_handle(x, y, y + 0.016, z)
    else:
        yield block("stainless", x, (y, y - 0.016), span(0.005, z))


def worktop(width: float, depth: float, height: float, material: str = "epoxy_white") -> Iterator[Part]:
    """A full-size worktop with a colored edge strip along its front."""
    hw, hd = width / 2.0, depth / 2.0
    yield block(material, span(hw), (-hd, hd - 0.006), (height - TOP_M, height))
    yield block("edge_blue", span(hw), (hd - 0.006, hd), (height - TOP_M, height))


@shape("bench")
def bench(asset: Asset) -> Iterator[Part]:
    """A laboratory bench: worktop over cupboards, or a steel frame; `casters` and `stone` vary it."""
    width, depth, height, hw, hd = extents(asset)
    doors = count(asset, "doors", 2)
    if flag(asset, "stone"):
        yield from _balance_table(width, depth, height)
        return
    yield from worktop(width, depth, height, "epoxy_white" if doors else "laminate_grey")
    if not doors:
        yield from _framed(width, depth, height, flag(asset, "casters"))
        return
    front = hd - OVERHANG_M - 0.018
    yield block("laminate_grey", span(hw), (-hd, front), (KICK_M, height - TOP_M))
    yield block("powder_dark", span(hw - 0.01), (-hd + 0.01, front - 0.05), (0.0, KICK_M))
    yield from cupboards(span(hw), front, height - TOP_M, doors, front + hd - 0.02)


def _framed(width: float, depth: float, height: float, wheels: bool) -> Iterator[Part]:
    hw, hd, foot = width / 2.0, depth / 2.0, 0.10 if wheels else 0.0
    if wheels:
        yield from castors(hw - 0.05, hd - 0.05, foot)
    for sx in (-1.0, 1.0):
        for sy in (-1.0, 1.0):
            yield block(
                "powder_grey",
                (sx * (hw - 0.02), sx * (hw - 0.065)),
                (sy * (hd - 0.02), sy * (hd - 0.065)),
                (foot, height - TOP_M),
            )
        yield block(
            "powder_grey", (sx * (hw - 0.02), sx * (hw - 0.065)), span(hd - 0.06), (height - 0.10, height - TOP_M)
        )
    for y in (-hd + 0.042, hd - 0.042):
        yield block("powder_grey", span(hw - 0.06), span(0.015, y), (height - 0.09, height - TOP_M))
    # A closed chest below keeps the frame visible to a range finder near the floor.
    low, high = foot + 0.06, foot + 0.38
    yield block("laminate_grey", span(hw - 0.03), (-hd + 0.03, hd - 0.058), (low, high))
    units = max(1, round(width / 0.6))
    pitch = (width - 0.06) / units
    for k in range(units):
        left = -hw + 0.03 + k * pitch
        x, face, z = (left + GAP_M, left + pitch - GAP_M), hd - 0.044, (low + GAP_M, high - GAP_M)
        middle = left + pitch / 2.0
        panel = [
            block("laminate_white", x, (hd - 0.058, face), z),
            *drawer_handle(span(0.07, middle), face, hd - 0.026, high - 0.06),
        ]
        yield from pulled_out(f"drawer_{k + 1}", panel, x, face, z, min(DRAWER_DEPTH_M, depth - 0.10))
        yield from hidden(recess(x, hd - 0.058, z))


def _balance_table(width: float, depth: float, height: float) -> Iterator[Part]:
    hw, hd = width / 2.0, depth / 2.0
    yield rounded("granite", span(hw), span(hd), (height - 0.06, height), 0.012)
    for side in (-1.0, 1.0):
        yield block("granite", (side * (hw - 0.03), side * (hw - 0.13)), (-hd + 0.03, hd - 0.05), (0.0, height - 0.07))
        yield block(
            "rubber", (side * (hw - 0.04), side * (hw - 0.12)), (-hd + 0.05, hd - 0.07), (height - 0.07, height - 0.06)
        )
    yield block("granite", span(hw - 0.13), (-hd + 0.06, -hd + 0.14), (0.10, height - 0.12))
    yield block("granite", span(hw - 0.13), (hd - 0.13, hd - 0.06), (0.10, 0.36))


@shape("island")
def island(asset: Asset) -> Iterator[Part]:
    """A double-sided island: cupboards to both sides, a worktop with two colored edges."""
    _, _, height, hw, hd = extents(asset)
    yield block("epoxy_white", span(hw), span(hd - 0.006), (height - TOP_M, height))
    front = hd - OVERHANG_M - 0.018
    yield block("laminate_grey", span(hw - 0.012), span(front), (KICK_M, height - TOP_M))
    yield block("powder_dark", span(hw - 0.03), span(front - 0.05), (0.0, KICK_M))
    for side in (-1.0, 1.0):
        yield block("edge_blue", span(hw), (side * (hd - 0.006), side * hd), (height - TOP_M, height))
        units, prefix = count(asset, "doors", 4), "front_" if side > 0.0 else "back_"
        yield from cupboards(
            span(hw - 0.012), side * front, height - TOP_M, units, front - 0.02, side=side, prefix=prefix
        )
        yield block(
            "laminate_white", (side * (hw - 0.012), side * (hw - 0.002)), span(front), (KICK_M, height - TOP_M - GAP_M)
        )


@shape("desk")
def desk(asset: Asset) -> Iterator[Part]:
    """A write-up desk: an oak top over two pedestals of drawers."""
    width, depth, height, hw, hd = extents(asset)
    yield rounded("oak", span(hw), span(hd), (height - 0.03, height), 0.02)
    pedestal = width * 0.32
    for side in (-1.0, 1.0):
        outer, inner = side * (hw - 0.015), side * (hw - 0.015 - pedestal)
        yield block("laminate_grey", (outer, inner), (-hd + 0.02, hd - 0.06), (0.03, height - 0.03))
        for k in range(3):
            low = 0.05 + k * (height - 0.10) / 3.0
            high = low + (height - 0.10) / 3.0 - 0.008
            ends = sorted((outer - side * 0.004, inner + side * 0.004))
            x, face, z = (ends[0], ends[1]), hd - 0.044, (low, high)
            middle = (outer + inner) / 2.0
            panel = [
                block("laminate_white", x, (hd - 0.06, face), z),
                *drawer_handle(span(0.06, middle), face, hd - 0.028, high - 0.04),
            ]
            name = f"{'left' if side < 0.0 else 'right'}_drawer_{k + 1}"
            yield from pulled_out(name, panel, x, face, z, min(DRAWER_DEPTH_M, depth - 0.10))
            yield from hidden(recess(x, hd - 0.06, z))
        yield block("powder_dark", (outer - side * 0.01, inner + side * 0.01), (-hd + 0.04, hd - 0.09), (0.0, 0.03))
    yield block("laminate_grey", span(hw - 0.3), (-hd + 0.02, -hd + 0.04), (0.25, height - 0.03))


def gooseneck(x: float, y: float, low: float, high: float, reach: float) -> Iterator[Part]:
    """A laboratory tap: a base, an arched spout towards +y, a lever."""
    radius, bore = reach / 2.0, 0.022
    high -= bore / 2.0
    yield column("chrome", 0.05, x, y, (low, low + 0.02))
    arch = [
        (x, y + radius - radius * math.cos(a), high - radius + radius * math.sin(a))
        for a in [math.pi * k / 6 for k in range(7)]
    ]
    yield from tube("chrome", bore, [(x, y, low + 0.01), *arch, (x, y + reach, high - radius - 0.05)])
    yield rod("chrome", 0.012, (x + 0.012, y, low + 0.05), (x + 0.07, y, low + 0.065))
    yield column("signal_blue", 0.02, x + 0.066, y, (low + 0.055, low + 0.075))


def bowl(x: Point, y: Point, rim: float, floor: float, material: str = "stainless") -> Iterator[Part]:
    """An open rectangular basin: four walls and a floor with a drain."""
    wall = 0.012
    yield block(material, x, y, (floor, floor + wall))
    for edge in (x[0], x[1] - wall):
        yield block(material, (edge, edge + wall), y, (floor + wall, rim))
    for edge in (y[0], y[1] - wall):
        yield block(material, (x[0] + wall, x[1] - wall), (edge, edge + wall), (floor + wall, rim))
    yield column("cast_iron", 0.05, (x[0] + x[1]) / 2.0, (y[0] + y[1]) / 2.0, (floor + wall, floor + wall + 0.003))


TAP_M = 0.32
"""Height of a sink bench's tap above its worktop, meters; the fitting of the catalog entry covers the tap."""


@shape("sink_bench")
def sink_bench(asset: Asset) -> Iterator[Part]:
    """A bench with a bowl let into its right part and a gooseneck tap; `hand` is a hand-wash basin."""
    width, depth, height, hw, hd = extents(asset)
    if flag(asset, "hand"):
        yield from _hand_basin(width, depth, height)
        return
    # The worktop's free part is the asset's surface; the bowl lies to the right of it.
    left = max((surface.x + surface.width / 2.0 for surface in asset.surfaces), default=0.0) + 0.03
    x, y, low = (left, hw - 0.05), (-hd + 0.16, hd - 0.09), height - TOP_M
    yield block("epoxy_white", (-hw, x[0]), (-hd, hd - 0.006), (low, height))
    yield block("epoxy_white", (x[1], hw), (-hd, hd - 0.006), (low, height))
    yield block("epoxy_white", x, (-hd, y[0]), (low, height))
    yield block("epoxy_white", x, (y[1], hd - 0.006), (low, height))
    yield block("edge_blue", span(hw), (hd - 0.006, hd), (low, height))
    yield from bowl(x, y, height - 0.002, height - 0.26)
    yield from gooseneck((x[0] + x[1]) / 2.0, -hd + 0.08, height, height + TAP_M, 0.24)
    front = hd - OVERHANG_M - 0.018
    yield block("laminate_grey", span(hw), (-hd, front), (KICK_M, height - 0.27))
    yield block("laminate_grey", (-hw, left - 0.02), (-hd, front), (height - 0.27, low))
    yield block("laminate_grey", (hw - 0.03, hw), (-hd, front), (height - 0.27, low))
    yield block("laminate_grey", (left - 0.02, hw - 0.03), (y[1] + 0.002, front), (height - 0.27, low))
    yield block("powder_dark", span(hw - 0.01), (-hd + 0.01, front - 0.05), (0.0, KICK_M))
    yield from cupboards(span(hw), front, low, 2, front + hd - 0.02, end=left - 0.02)


def _hand_basin(width: float, depth: float, height: float) -> Iterator[Part]:
    hw, hd, rim = width / 2.0, depth / 2.0, height - 0.20
    yield from bowl(span(hw), (-hd + 0.02, hd), rim, rim - 0.17, "porcelain")
    yield block("porcelain", span(hw), (-hd, -hd + 0.12), (rim - 0.17, rim))
    yield block("laminate_white", span(hw - 0.03), (-hd + 0.03, hd - 0.06), (0.08, rim - 0.17))
    yield block("powder_dark", span(hw - 0.05), (-hd + 0.05, hd - 0.10), (0.0, 0.08))
    yield from drawer_handle(span(0.06), hd - 0.06, hd - 0.04, rim - 0.24)
    yield from gooseneck(0.0, -hd + 0.06, rim, height, 0.16)


TOPS = {
    "white": "epoxy_white",
    "black": "epoxy_black",
    "oak": "oak",
    "steel": "stainless",
    "grey": "laminate_grey",
    "stone": "granite",
}
"""Material of a worktop by the parameter `top`."""
SETBACK_M = 0.03
"""Distance of the fronts from the edge of the worktop, meters: space for their handles."""
FRONT_M = 0.018
"""Thickness of a front, meters."""
CLEARANCE_M = 0.14
"""Free height below the cupboards of a bench on legs or C-frames, meters."""
POST_M = 0.05
"""Side of a leg, meters."""
SUPPORTS = ("plinth", "legs", "frame")


@shape("modular_bench")
def modular_bench(asset: Asset) -> Iterator[Part]:
    """A bench from a modular range, for a wall or with `double` an island.

    Parameters: `top`; `front`, a color or oak; `support`: plinth, legs at the corners, or frame (C-shaped feet);
    `doors`, the number of units along each worked side; `double`.
    """
    _, _, height, hw, hd = extents(asset)
    top = choice(asset, "top", "white", TOPS, "worktop")
    support = choice(asset, "support", "plinth", SUPPORTS, "support of a bench")
    yield block(TOPS[top], span(hw), span(hd), (height - TOP_M, height))
    double = flag(asset, "double")
    low = KICK_M if support == "plinth" else CLEARANCE_M
    back, front = (-hd + SETBACK_M + FRONT_M if double else -hd), hd - SETBACK_M - FRONT_M
    edge = hw if support == "plinth" else hw - POST_M - 0.01
    yield block("laminate_grey", span(edge), (back, front), (low, height - TOP_M))
    material = "oak" if text(asset, "front", "white") == "oak" else coating(text(asset, "front", "white"))
    for side in (1.0, -1.0) if double else (1.0,):
        at = front if side > 0.0 else back
        yield from _fronts(material, span(edge), at, side, (low, height - TOP_M), count(asset, "doors", 3))
    if support == "plinth":
        yield block("powder_dark", span(hw - 0.01), (back + 0.03, front - 0.05), (0.0, KICK_M))
    else:
        yield from _feet(support, hw, hd, height - TOP_M)


def _fronts(material: str, x: Point, y: float, side: float, z: Point, units: int) -> Iterator[Part]:
    """Doors with a drawer above them; every second unit is a stack of three drawers."""
    pitch = (x[1] - x[0]) / units
    face = y + side * FRONT_M
    for k in range(units):
        left, right = x[0] + k * pitch + GAP_M, x[0] + (k + 1) * pitch - GAP_M
        shares = (0.0, 0.36, 0.70, 1.0) if k % 2 else (0.0, 0.78, 1.0)
        levels = [z[0] + share * (z[1] - z[0]) for share in shares]
        for bottom, top in pairwise(levels):
            yield block(material, (left, right), (y, face), (bottom + GAP_M, top - GAP_M))
            middle, reach = (left + right) / 2.0, min(0.08, pitch * 0.3)
            grip = top - 0.05
            if side > 0.0:
                yield from drawer_handle(span(reach, middle), face, face + 0.012, grip)
            else:
                yield block("stainless", span(reach, middle), (face, face - 0.012), span(0.005, grip))


def _feet(support: str, hw: float, hd: float, top: float) -> Iterator[Part]:
    """Four legs, or two C-shaped frames whose feet lie along the depth."""
    for side in (-1.0, 1.0):
        x = (side * (hw - POST_M), side * hw)
        if support == "legs":
            for y in ((-hd, -hd + POST_M), (hd - SETBACK_M - POST_M, hd - SETBACK_M)):
                yield block("powder_dark", x, y, (0.0, top))
        else:
            yield block("powder_white", x, (-hd, hd - SETBACK_M), (0.0, POST_M))
            yield block("powder_white", x, (-hd, -hd + 1.6 * POST_M), (POST_M, top))
            yield block("powder_white", x, (-hd + 1.6 * POST_M, hd - SETBACK_M), (top - POST_M, top))
