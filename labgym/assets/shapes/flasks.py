"""Flasks: round, pear, volumetric, Erlenmeyer, filter."""

from __future__ import annotations

import math
from collections.abc import Iterator

from labgym.assets.model import Asset
from labgym.assets.shapes.parts import ALONG_X, Part, Point, column, cylinder, revolved, rod, turned
from labgym.assets.shapes.registry import count, extents, flag, shape

GLASS = "borosilicate"
WALL = 0.0015
"""Thickness of blown glass, meters."""


def neck_rim(radius: float, z: float) -> list[Point]:
    """Profile points of a neck's flared end at height z."""
    return [(radius, z - 0.008), (radius * 1.22, z - 0.005), (radius * 1.22, z)]


def bulb(radius: float, centre: float, start: float, end: float, steps: int = 8) -> list[Point]:
    """Profile points of a sphere between two polar angles (0 at the bottom, pi at the top), radians."""
    angles = [start + (end - start) * k / steps for k in range(steps + 1)]
    return [(radius * math.sin(angle), centre - radius * math.cos(angle)) for angle in angles]


@shape("round_flask")
def round_flask(asset: Asset) -> Iterator[Part]:
    """A round-bottomed flask with one to three necks; `pear`, `sidearm` and `long_neck` vary it."""
    width, depth, height = extents(asset)
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
        liquid = [(0.0, WALL), (radius * 0.30, radius * 0.14), (radius * 0.86, height * 0.33)]
    else:
        body = bulb(radius, radius, 0.0, opening, 10)
        liquid = bulb(radius - WALL, radius, 0.0, 1.25, 5)
    yield revolved(GLASS, body + neck_rim(neck, height), (x, 0.0, 0.0))
    yield revolved("yellow_liquid" if necks == 3 else "clear_liquid", liquid, (x, 0.0, 0.0))
    if arm:
        z = height * 0.78
        yield rod(GLASS, 0.008, (x, 0.0, z), (width / 2.0, 0.0, z), flat=True)
        yield cylinder("ptfe", 0.011, 0.026, (width / 2.0 - 0.018, 0.0, z), turned((1.0, 0.0, 0.0), math.pi / 2.0))
    for side in {1: (), 2: (1.0,)}.get(necks, (-1.0, 1.0)):
        yield _side_neck(x, side, radius, width / 2.0, neck)


def _side_neck(x: float, side: float, centre: float, edge: float, radius: float) -> Part:
    """A neck at 45 degrees from the sphere's center whose rim just reaches the edge of the box."""
    lean = math.pi / 4.0
    rim = radius * 1.15
    reach = (edge - rim * math.cos(lean) - side * x) / math.sin(lean)
    profile = [(radius, 0.0), (radius, reach - 0.008), (rim, reach - 0.006), (rim, reach)]
    return revolved(GLASS, profile, (x, 0.0, centre), turned((0.0, 1.0, 0.0), side * lean))


def _volumetric(radius: float, height: float) -> Iterator[Part]:
    neck = 0.0065
    body = [(0.0, 0.0), (radius * 0.72, 0.0), *bulb(radius, radius * 0.92, 0.9, math.pi - 0.35, 8)]
    yield revolved(GLASS, [*body, (neck, radius * 2.2), (neck, height - 0.024), (neck * 1.3, height - 0.020)])
    yield revolved(
        "blue_liquid", [(0.0, WALL), (radius * 0.70, WALL), *bulb(radius - WALL, radius * 0.92, 0.9, 2.6, 6)]
    )
    yield column("print_black", 2.0 * neck + 0.0008, 0.0, 0.0, (height * 0.62, height * 0.62 + 0.0012))
    yield revolved("abs_blue", [(neck, height - 0.020), (neck * 1.7, height - 0.014), (neck * 1.7, height)])


def conical(radius: float, neck: float, height: float) -> tuple[list[Point], list[Point]]:
    """Outlines of an Erlenmeyer body and of the liquid in it."""
    body = [(0.0, 0.0), (radius * 0.93, 0.0), (radius, radius * 0.08), (radius * 0.96, radius * 0.22)]
    body += [(neck, height * 0.76), *neck_rim(neck, height)]
    level, share = height * 0.26, 0.34
    liquid = [(0.0, WALL), (radius * 0.93 - WALL, WALL), (radius * (1.0 - share) + neck * share - WALL, level)]
    return body, liquid


@shape("erlenmeyer")
def erlenmeyer(asset: Asset) -> Iterator[Part]:
    """A conical flask."""
    width, _, height = extents(asset)
    body, liquid = conical(width / 2.0, width * 0.19, height)
    yield revolved(GLASS, body)
    yield revolved("blue_liquid", liquid)


@shape("filter_flask")
def filter_flask(asset: Asset) -> Iterator[Part]:
    """A thick conical flask with a hose barb and a rubber cone on its mouth."""
    width, depth, height = extents(asset)
    radius = depth / 2.0
    x, z = -width / 2.0 + radius, height * 0.80
    body, liquid = conical(radius, radius * 0.36, height)
    yield revolved("thick_glass", body, (x, 0.0, 0.0))
    yield revolved("yellow_liquid", liquid, (x, 0.0, 0.0))
    yield cylinder("thick_glass", 0.011, width / 2.0 - x, ((x + width / 2.0) / 2.0, 0.0, z), ALONG_X)
    yield cylinder("thick_glass", 0.015, 0.004, (width / 2.0 - 0.008, 0.0, z), ALONG_X)
