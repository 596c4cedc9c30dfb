"""Flasks, and open vessels: beakers, measuring cylinders, dishes, funnels."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from labgym.assets.model import Asset
from labgym.assets.shapes.materials import substance
from labgym.assets.shapes.parts import (
    ALONG_X,
    Part,
    Point,
    Vector,
    band,
    collar,
    column,
    cylinder,
    ellipsoid,
    prism,
    revolved,
    rod,
    sphere,
    turned,
)
from labgym.assets.shapes.registry import count, extents, flag, shape, text

GLASS = "borosilicate"
WALL_M = 0.0015
"""Thickness of blown glass, meters."""


def neck_rim(radius: float, z: float) -> list[Point]:
    """Profile points of a neck's flared end at height z."""
    return [(radius, z - 0.008), (radius * 1.22, z - 0.005), (radius * 1.22, z)]


def bulb(radius: float, center: float, start: float, end: float, steps: int = 8) -> list[Point]:
    """Profile points of a sphere between two polar angles (0 at the bottom, pi at the top), radians."""
    angles = [start + (end - start) * k / steps for k in range(steps + 1)]
    return [(radius * math.sin(angle), center - radius * math.cos(angle)) for angle in angles]


@shape("round_flask")
def round_flask(asset: Asset) -> Iterator[Part]:
    """A round-bottomed flask with one to three necks; `pear`, `sidearm` and `long_neck` vary it."""
    width, depth, height, *_ = extents(asset)
    necks, arm = count(asset, "necks", 1), flag(asset, "sidearm")
    radius = depth / 2.0
    x = -width / 2.0 + radius if necks == 2 or arm else 0.0
    if flag(asset, "long_neck"):
        yield from _volumetric(radius, height)
        return
    neck = max(0.006, min(0.013, radius * 0.27))
    opening = math.pi - math.asin(neck / radius)
    if flag(asset, "pear"):
        body = [(0.0, 0.0), (radius * 0.35, radius * 0.10), *bulb(radius, height * 0.48, 1.25, opening, 7)]
        liquid = [(0.0, WALL_M), (radius * 0.30, radius * 0.14), (radius * 0.86, height * 0.33)]
    else:
        body = bulb(radius, radius, 0.0, opening, 10)
        liquid = bulb(radius - WALL_M, radius, 0.0, 1.25, 5)
    yield revolved(GLASS, body + neck_rim(neck, height), (x, 0.0, 0.0))
    yield revolved("yellow_liquid" if necks == 3 else "clear_liquid", liquid, (x, 0.0, 0.0))
    if arm:
        z = height * 0.78
        yield rod(GLASS, 0.008, (x, 0.0, z), (width / 2.0, 0.0, z), flat=True)
        yield cylinder("ptfe", 0.011, 0.026, (width / 2.0 - 0.018, 0.0, z), turned((1.0, 0.0, 0.0), math.pi / 2.0))
    for side in {1: (), 2: (1.0,)}.get(necks, (-1.0, 1.0)):
        yield _side_neck(x, side, radius, width / 2.0, neck)


def _side_neck(x: float, side: float, center: float, edge: float, radius: float) -> Part:
    """A neck at 45 degrees from the sphere's center whose rim just reaches the edge of the box."""
    lean = math.pi / 4.0
    rim = radius * 1.15
    reach = (edge - rim * math.cos(lean) - side * x) / math.sin(lean)
    profile = [(radius, 0.0), (radius, reach - 0.008), (rim, reach - 0.006), (rim, reach)]
    return revolved(GLASS, profile, (x, 0.0, center), turned((0.0, 1.0, 0.0), side * lean))


def _volumetric(radius: float, height: float) -> Iterator[Part]:
    neck = 0.0065
    body = [(0.0, 0.0), (radius * 0.72, 0.0), *bulb(radius, radius * 0.92, 0.9, math.pi - 0.35, 8)]
    yield revolved(GLASS, [*body, (neck, radius * 2.2), (neck, height - 0.024), (neck * 1.3, height - 0.020)])
    yield revolved(
        "blue_liquid",
        [
            (0.0, WALL_M),
            (radius * 0.70, WALL_M),
            *bulb(radius - WALL_M, radius * 0.92, 0.9, 2.6, 6),
        ],
    )
    yield column("print_black", 2.0 * neck + 0.0008, 0.0, 0.0, (height * 0.62, height * 0.62 + 0.0012))
    yield revolved("abs_blue", [(neck, height - 0.020), (neck * 1.7, height - 0.014), (neck * 1.7, height)])


def conical(radius: float, neck: float, height: float) -> tuple[list[Point], list[Point]]:
    """Outlines of an Erlenmeyer body and of the liquid in it."""
    body = [(0.0, 0.0), (radius * 0.93, 0.0), (radius, radius * 0.08), (radius * 0.96, radius * 0.22)]
    body += [(neck, height * 0.76), *neck_rim(neck, height)]
    level, share = height * 0.26, 0.34
    liquid = [
        (0.0, WALL_M),
        (radius * 0.93 - WALL_M, WALL_M),
        (radius * (1.0 - share) + neck * share - WALL_M, level),
    ]
    return body, liquid


@shape("erlenmeyer")
def erlenmeyer(asset: Asset) -> Iterator[Part]:
    """A conical flask."""
    width, _, height, *_ = extents(asset)
    body, liquid = conical(width / 2.0, width * 0.19, height)
    yield revolved(GLASS, body)
    yield revolved("blue_liquid", liquid)


@shape("filter_flask")
def filter_flask(asset: Asset) -> Iterator[Part]:
    """A thick conical flask with a hose barb and a rubber cone on its mouth."""
    width, depth, height, *_ = extents(asset)
    radius = depth / 2.0
    x, z = -width / 2.0 + radius, height * 0.80
    body, liquid = conical(radius, radius * 0.36, height)
    yield revolved("thick_glass", body, (x, 0.0, 0.0))
    yield revolved("yellow_liquid", liquid, (x, 0.0, 0.0))
    yield cylinder("thick_glass", 0.011, width / 2.0 - x, ((x + width / 2.0) / 2.0, 0.0, z), ALONG_X)
    yield cylinder("thick_glass", 0.015, 0.004, (width / 2.0 - 0.008, 0.0, z), ALONG_X)


def hollow(
    material: str, outside: Sequence[Point], wall: float, at: Vector = (0.0, 0.0, 0.0), pierced: bool = False
) -> Part:
    """A vessel open at the top: an outer profile from the axis to the rim, and its inside one wall further in.

    `pierced` leaves it open at the bottom too, as a funnel's stem.
    """
    floor = min(z for _, z in outside)
    inside = [(max(r - wall, 0.0004), z if pierced else max(z, floor + wall)) for r, z in reversed(outside)]
    if pierced:
        return revolved(material, [*outside, *inside, outside[0]], at)
    return revolved(material, [*outside, *[p for p in inside if p[0] > 0.0004], (0.0, inside[-1][1])], at)


@shape("beaker")
def beaker(asset: Asset) -> Iterator[Part]:
    """A beaker with some liquid; `lid` makes it a development chamber, `dewar` a silvered vacuum vessel."""
    width, _, height, *_ = extents(asset)
    radius = width / 2.0
    if flag(asset, "dewar"):
        yield hollow("cabinet_blue", [(0.0, 0.0), (radius - 0.0005, 0.0), (radius - 0.0005, height * 0.88)], 0.008)
        yield hollow("chrome", [(0.0, 0.02), (radius - 0.009, 0.02), (radius - 0.009, height)], 0.006)
        yield band("plastic_black", 2.0 * radius, (height * 0.86, height * 0.9))
        return
    lid = flag(asset, "lid")
    top = height - 0.004 if lid else height
    wall = [
        (0.0, 0.0),
        (radius * 0.92, 0.0),
        (radius * 0.96, radius * 0.05),
        (radius * 0.96, top - 0.006),
        (radius, top),
    ]
    yield hollow(GLASS, wall, 0.002)
    level = height * (0.12 if lid else 0.45)
    yield column("clear_liquid" if lid else "blue_liquid", 1.84 * radius, 0.0, 0.0, (0.0025, level))
    if lid:
        yield column("thick_glass", 2.0 * radius, 0.0, 0.0, (top, height))
        yield column("silica", 0.7 * radius, 0.0, 0.0, (0.004, height * 0.75))
    else:
        yield collar("paper", (0.962 * radius, 0.965 * radius), (height * 0.62, height * 0.64))


@shape("cylinder_measure")
def measuring_cylinder(asset: Asset) -> Iterator[Part]:
    """A measuring cylinder on a hexagonal foot, with graduations."""
    width, _, height, *_ = extents(asset)
    radius = width * 0.25
    side = width / 2.0
    # A regular hexagon would miss the box in depth; a cut-cornered square reaches all sides.
    cut = side * 0.45
    foot = [
        (side, -cut),
        (side, cut),
        (cut, side),
        (-cut, side),
        (-side, cut),
        (-side, -cut),
        (-cut, -side),
        (cut, -side),
    ]
    yield prism("cabinet_blue", foot, 0.010, (0.0, 0.0, 0.005))
    yield hollow(GLASS, [(0.0, 0.010), (radius, 0.010), (radius, height - 0.008), (radius * 1.2, height)], 0.0018)
    yield column("blue_liquid", 2.0 * radius - 0.004, 0.0, 0.0, (0.012, height * 0.55))
    for share in (0.25, 0.4, 0.55, 0.7, 0.85):
        yield column("paper", 2.0 * radius + 0.0006, 0.0, 0.0, (height * share, height * share + 0.0016))


@shape("dish")
def dish(asset: Asset) -> Iterator[Part]:
    """A shallow vessel; `lid`, `pestle` and `desiccator` vary it."""
    width, _, height, *_ = extents(asset)
    radius, kind = width / 2.0, text(asset, "material", "glass")
    material = substance(kind)
    if flag(asset, "desiccator"):
        yield from _desiccator(radius, height)
        return
    lid, pestle = flag(asset, "lid"), flag(asset, "pestle")
    top = height * (0.82 if lid else 0.62 if pestle else 1.0)
    base = radius * (0.94 if kind == "glass" and height > 0.013 else 0.55)
    yield hollow(
        material, [(0.0, 0.0), (base, 0.0), (radius * 0.97, top * 0.8), (radius, top)], min(0.003, 0.3 * height)
    )
    if lid:
        knob = height > 0.03
        yield column(material, 2.0 * radius, 0.0, 0.0, (top, height - 0.006 if knob else height))
        if knob:
            yield column(material, 0.012, 0.0, 0.0, (height - 0.006, height))
    elif pestle:
        yield rod(material, 0.022, (0.012, 0.0, 0.014), (radius * 0.70, 0.0, height - 0.002))
    elif kind == "glass" and height > 0.03:
        yield column("ice" if radius > 0.06 else "clear_liquid", 1.8 * radius, 0.0, 0.0, (0.003, height * 0.4))
    elif kind == "plastic":
        yield ellipsoid("silica", (radius, radius, height * 0.7), (0.0, 0.0, 0.35 * height))


def _desiccator(radius: float, height: float) -> Iterator[Part]:
    rim = height * 0.52
    yield hollow(
        "thick_glass",
        [(0.0, 0.0), (radius * 0.55, 0.0), (radius * 0.62, height * 0.2), (radius * 0.9, height * 0.28), (radius, rim)],
        0.008,
    )
    yield column("porcelain", radius * 1.7, 0.0, 0.0, (height * 0.29, height * 0.31))
    yield column("cabinet_blue", radius * 1.1, 0.0, 0.0, (0.008, height * 0.14))
    dome = bulb(radius, rim, math.pi / 2.0, math.pi * 0.94, 6)
    scale = (height - 0.045 - rim) / (dome[-1][1] - rim)
    yield revolved("thick_glass", [(r, rim + (z - rim) * scale) for r, z in dome])
    yield column("thick_glass", 0.03, 0.0, 0.0, (height - 0.046, height - 0.02))
    yield sphere("thick_glass", 0.03, (0.0, 0.0, height - 0.015))


@shape("funnel")
def funnel(asset: Asset) -> Iterator[Part]:
    """A conical funnel, its stem down."""
    width, _, height, *_ = extents(asset)
    radius, stem = width / 2.0, max(0.0035, width * 0.06)
    cone = [(stem * 0.8, 0.0), (stem, height - radius * 1.55), (radius, height - 0.003), (radius, height)]
    yield hollow(substance(text(asset, "material", "glass")), cone, 0.0016, pierced=True)


@shape("buchner")
def buchner(asset: Asset) -> Iterator[Part]:
    """A filter funnel: a straight bowl with a plate or frit, over a conical stem."""
    width, _, height, *_ = extents(asset)
    radius, kind = width / 2.0, text(asset, "material", "porcelain")
    floor, stem = height * (0.50 if kind == "porcelain" else 0.42), width * 0.10
    outline = [(stem * 0.75, 0.0), (stem, floor * 0.6), (radius * 0.9, floor), (radius * 0.95, height - 0.004)]
    yield hollow(substance(kind), [*outline, (radius, height - 0.004), (radius, height)], 0.003, pierced=True)
    yield column("paper" if kind == "porcelain" else "silica", radius * 1.8, 0.0, 0.0, (floor + 0.002, floor + 0.006))
