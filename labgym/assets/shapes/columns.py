"""Jointed and tall glassware: funnels with taps, condensers, adapters, columns, manifolds, tubes."""

from __future__ import annotations

import math
from collections.abc import Iterator

from labgym.assets.model import Asset
from labgym.assets.shapes.parts import ALONG_X, ALONG_Y, Part, block, column, cylinder, revolved, rod, span, sphere
from labgym.assets.shapes.registry import count, extents, flag, shape, text
from labgym.assets.shapes.vessels import GLASS, bulb, hollow


def stopcock(x: float, z: float, edge: float, size: float = 0.012) -> Iterator[Part]:
    """A tap on an upright tube at x: a glass barrel, and a key whose handle reaches `edge` along x."""
    yield cylinder(GLASS, size * 1.5, size * 2.0, (x, 0.0, z), ALONG_X)
    yield cylinder("ptfe", size * 0.75, edge - x + 0.8 * size, ((edge + x - size) / 2.0 - 0.1 * size, 0.0, z), ALONG_X)
    yield block("abs_blue", (edge - 0.006, edge), span(size), span(size * 0.4, z))


@shape("sep_funnel")
def separatory_funnel(asset: Asset) -> Iterator[Part]:
    """A pear-shaped separatory funnel with stopper, stopcock, and two layers inside."""
    width, depth, height, *_ = extents(asset)
    radius, stem = depth / 2.0, 0.0045
    x, middle, tap = -width / 2.0 + radius, height * 0.66, height * 0.24
    shoulder = bulb(radius, middle, math.pi / 2.0, math.pi - 0.32, 6)
    cone = [(stem, 0.0), (stem, tap + 0.03), (radius * 0.80, middle - radius * 0.62)]
    neck = [(0.0125, height - 0.046), (0.0125, height - 0.020)]
    yield revolved(GLASS, [*cone, *shoulder, *neck], (x, 0.0, 0.0))
    low, line = tap + 0.034, middle - radius * 0.5
    yield revolved(
        "yellow_liquid", [(stem * 0.6, low), (radius * 0.72, line - 0.012), (radius * 0.82, line)], (x, 0.0, 0.0)
    )
    yield revolved(
        "clear_liquid",
        [(radius * 0.82, line), (radius * 0.94, middle - 0.006), (radius * 0.93, middle + 0.008)],
        (x, 0.0, 0.0),
    )
    yield revolved("abs_green", [(0.011, height - 0.020), (0.017, height - 0.012), (0.017, height)], (x, 0.0, 0.0))
    yield from stopcock(x, tap, width / 2.0)


@shape("dropping_funnel")
def dropping_funnel(asset: Asset) -> Iterator[Part]:
    """A cylindrical addition funnel with a pressure-equalising arm."""
    width, depth, height, *_ = extents(asset)
    radius, arm = depth / 2.0, 0.007
    x, edge = -width / 2.0 + depth / 2.0, width / 2.0 - arm / 2.0
    low, high = height * 0.42, height * 0.86
    body = [(0.009, 0.0), (0.011, height * 0.14), (0.005, height * 0.16), (0.005, low - 0.02), (radius, low + 0.012)]
    yield revolved(GLASS, [*body, (radius, high - 0.02), (0.012, high), (0.012, height)], (x, 0.0, 0.0))
    yield column("yellow_liquid", depth - 0.004, x, 0.0, (low + 0.012, height * 0.6))
    yield rod(GLASS, arm, (edge, 0.0, height * 0.1), (edge, 0.0, high + 0.01))
    for z in (height * 0.12, high + 0.004):
        yield cylinder(GLASS, arm, edge - x, ((x + edge) / 2.0, 0.0, z), ALONG_X)
    yield from stopcock(x, height * 0.26, edge - 0.006, 0.010)


@shape("condenser")
def condenser(asset: Asset) -> Iterator[Part]:
    """A water condenser: a jacket round an inner tube, straight or with bulbs, and two hose barbs."""
    width, depth, height, *_ = extents(asset)
    radius = depth / 2.0
    low, high = height * 0.14, height * 0.90
    jacket = [
        (0.009, 0.0),
        (0.011, low * 0.8),
        (0.010, low),
        (radius, low + 0.012),
        (radius, high - 0.012),
        (0.011, high),
    ]
    yield revolved(GLASS, [*jacket, (0.011, height - 0.015), (0.014, height - 0.010), (0.014, height)])
    if flag(asset, "bulbs"):
        step = (high - low - 0.03) / 6.0
        for k in range(6):
            yield sphere("clear_liquid", 0.6 * depth, (0.0, 0.0, low + 0.015 + (k + 0.5) * step))
    yield column("clear_liquid", 0.012, 0.0, 0.0, (low, high))
    for side, z in ((1.0, low + 0.03), (-1.0, high - 0.03)):
        yield cylinder(GLASS, 0.010, width / 2.0 - 0.001, (side * (width / 4.0 - 0.0005), 0.0, z), ALONG_X)
        yield cylinder("rubber_orange", 0.013, 0.010, (side * (width / 2.0 - 0.005), 0.0, z), ALONG_X)


@shape("adapter")
def adapter(asset: Asset) -> Iterator[Part]:
    """A glass adapter: an upright joint and a sloping side arm; `trap` adds a graduated trap under the arm."""
    width, depth, height, *_ = extents(asset)
    r = depth / 2.0
    x, end = -width / 2.0 + r, width / 2.0 - r
    main = [(r * 0.62, 0.0), (r * 0.8, height * 0.25), (r * 0.5, height * 0.3), (r * 0.5, height * 0.78)]
    yield revolved(GLASS, [*main, (r, height * 0.82), (r, height)], (x, 0.0, 0.0))
    yield rod(GLASS, r * 0.9, (x, 0.0, height * 0.66), (end, 0.0, height * 0.48))
    if flag(asset, "trap"):
        yield revolved(
            GLASS,
            [(0.005, height * 0.05), (0.005, height * 0.12), (r * 0.8, height * 0.16), (r * 0.8, height * 0.6)],
            (end, 0.0, 0.0),
        )
        yield column("clear_liquid", r * 1.4, end, 0.0, (height * 0.17, height * 0.36))
        yield cylinder("ptfe", 0.008, r * 2.0, (end, 0.0, height * 0.09), ALONG_Y)
        yield column(GLASS, r * 2.0, end, 0.0, (height * 0.55, height * 0.6))
    else:
        yield revolved(
            GLASS,
            [(r * 0.5, height * 0.12), (r * 0.62, height * 0.40), (r, height * 0.42), (r, height * 0.52)],
            (end, 0.0, 0.0),
        )


@shape("column")
def chromatography_column(asset: Asset) -> Iterator[Part]:
    """A chromatography column with a reservoir; packed with sorbent and two colored bands."""
    width, depth, height, *_ = extents(asset)
    radius, tube = depth / 2.0, depth * 0.34
    low = height * 0.16
    top = height - 0.022
    outline = [(0.003, 0.0), (0.004, low * 0.7), (tube, low), (tube, height * 0.76)]
    ball = bulb(radius, top - 0.008 - radius, 0.75, math.pi - 0.36, 6)
    yield revolved(GLASS, [*outline, *ball, (0.011, top), (0.014, height - 0.010), (0.014, height)])
    yield column("silica", 2.0 * tube - 0.004, 0.0, 0.0, (low + 0.004, height * 0.58))
    for z, color in ((0.36, "poison_purple"), (0.46, "yellow_liquid")):
        yield column(color, 2.0 * tube - 0.003, 0.0, 0.0, (height * z, height * (z + 0.025)))
    yield column("yellow_liquid", 2.0 * tube - 0.004, 0.0, 0.0, (height * 0.585, height * 0.7))
    yield from stopcock(0.0, low * 0.5, width / 2.0, 0.010)
    yield block("ptfe", (-width / 2.0, -0.006), span(0.004), span(0.004, low * 0.5))


@shape("burette")
def burette(asset: Asset) -> Iterator[Part]:
    """A burette: a long graduated tube over a stopcock."""
    width, depth, height, *_ = extents(asset)
    radius = 0.0065
    outline = [
        (0.0015, 0.0),
        (0.004, height * 0.03),
        (0.004, height * 0.09),
        (radius, height * 0.11),
        (radius, height - 0.012),
    ]
    yield revolved(GLASS, [*outline, (depth / 2.0, height - 0.003), (depth / 2.0, height)])
    yield column("blue_liquid", 2.0 * radius - 0.003, 0.0, 0.0, (height * 0.12, height * 0.8))
    for k in range(9):
        z = height * (0.16 + 0.09 * k)
        yield column("paper", 2.0 * radius + 0.0006, 0.0, 0.0, (z, z + 0.002))
    yield from stopcock(0.0, height * 0.06, width / 2.0, 0.008)
    yield block("ptfe", (-width / 2.0, 0.0), span(0.003), span(0.003, height * 0.06))


@shape("tube")
def tube(asset: Asset) -> Iterator[Part]:
    """A round-bottomed tube; `cap`, `arms` (a cold trap), `bulb` (a drying tube) vary it."""
    width, depth, height, *_ = extents(asset)
    radius = depth / 2.0
    if flag(asset, "bulb"):
        yield from _drying_tube(width, radius, height)
        return
    plastic, cap = text(asset, "material", "glass") == "plastic", flag(asset, "cap")
    top = height - min(0.022, height * 0.14) if cap else height
    body = radius * (0.86 if cap or plastic else 0.92)
    bottom = (
        [(0.0, 0.0), (body * 0.25, 0.0), (body, height * 0.18)] if plastic else bulb(body, body, 0.0, math.pi / 2.0, 5)
    )
    rim = [(body, top)] if cap else [(body, top - 0.003), (radius, top)]
    yield hollow("polypropylene" if plastic else GLASS, [*bottom, *rim], min(0.0015, radius * 0.3))
    level = height * (0.25 if flag(asset, "arms") else 0.34)
    yield column(
        "yellow_liquid" if plastic else "clear_liquid", 1.5 * body, 0.0, 0.0, (body * (1.6 if plastic else 0.6), level)
    )
    if cap:
        yield column("abs_blue" if plastic or radius < 0.01 else "ptfe", depth, 0.0, 0.0, (top, height))
    if flag(asset, "arms"):
        for side, z in ((-1.0, top - 0.02), (1.0, top - 0.045)):
            yield cylinder(
                GLASS, 0.010, width / 2.0 - body * 0.8, (side * (width / 2.0 + body * 0.8) / 2.0, 0.0, z), ALONG_X
            )


def _drying_tube(width: float, radius: float, height: float) -> Iterator[Part]:
    x, end = -width / 2.0 + radius, width / 2.0 - 0.005
    outline = [(0.008, 0.0), (0.009, height * 0.3), (0.005, height * 0.34), (0.005, height * 0.62)]
    yield revolved(GLASS, [*outline, *bulb(radius, height - radius, 0.5, math.pi, 7)], (x, 0.0, 0.0))
    yield sphere("silica", radius * 1.7, (x, 0.0, height - radius))
    yield rod(GLASS, 0.010, (x, 0.0, height * 0.56), (end + 0.0045, 0.0, height * 0.80))


@shape("schlenk_line")
def schlenk_line(asset: Asset) -> Iterator[Part]:
    """A double manifold with taps on a frame: one tube of inert gas, one of vacuum."""
    width, depth, height, *_ = extents(asset)
    half, back, front = width / 2.0, -depth / 2.0, depth / 2.0
    for x in (-half + 0.08, half - 0.08):
        yield column("stainless", 0.012, x, back + 0.03, (0.0, height))
        yield block("cast_iron", span(0.05, x), (back, back + 0.10), (0.0, 0.012))
    upper, lower, y = height * 0.84, height * 0.64, back + 0.055
    for z in (upper, lower):
        yield cylinder(GLASS, 0.028, width - 0.002, (0.0, y, z), ALONG_X)
    yield cylinder("rubber_orange", 0.030, 0.02, (-half + 0.010, y, lower), ALONG_X)
    yield cylinder("cabinet_blue", 0.030, 0.02, (half - 0.010, y, upper), ALONG_X)
    ports = count(asset, "ports", 4)
    for k in range(ports):
        x = (k + 0.5) / ports * (width - 0.3) - (width - 0.3) / 2.0
        yield rod(GLASS, 0.012, (x, y, upper), (x, y + 0.03, lower - 0.02))
        yield cylinder("ptfe", 0.016, 0.045, (x, y + 0.03, (upper + lower) / 2.0), ALONG_Y)
        yield block("abs_green", span(0.02, x), (y + 0.05, y + 0.056), span(0.005, (upper + lower) / 2.0))
        yield rod("rubber_orange", 0.011, (x, y + 0.03, lower - 0.02), (x + 0.02, front - 0.006, 0.04))
        yield rod("rubber_orange", 0.011, (x + 0.02, front - 0.0055, 0.045), (x + 0.05, front - 0.0055, 0.006))
