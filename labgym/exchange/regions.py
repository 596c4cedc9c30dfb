"""Regions of spaces from polygons: a frame along the longest side, and rectangles in it."""

from __future__ import annotations

import math
from collections.abc import Iterable
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from labgym.errors import OptionError
from labgym.exchange.strips import tidy
from labgym.layouts.floor import Rectangle
from labgym.layouts.ground.ground import distinct

if TYPE_CHECKING:
    from shapely import Polygon

MOST = 64
"""Largest number of rectangles of a region."""
STEPS = tuple(round(0.05 * 1.2**power, 3) for power in range(20))
"""Widths of the stairs along an oblique side, the first with few enough rectangles, meters."""
HIGHEST = 0.6
"""Largest height of a stair that is wider than the narrowest rectangle, meters: its wall is within reach."""
SAME = 1e-3
"""Coordinates that differ by less are the same, meters."""
NARROWEST = 0.05
"""Width of the narrowest rectangle, meters."""

Frame = tuple[float, float, float]
Slab = tuple[float, float, float, float]
"""x0, y0, x1, y1."""


def region_of(polygon: Polygon, yaw: float | None = None) -> tuple[Frame, tuple[Rectangle, ...]]:
    """Return the frame and the rectangles of a space whose outline is a polygon.

    The frame lies along the longest side, with the region's lower left corner as origin. Sides parallel to the frame
    are kept exactly; along an oblique side the region is the largest staircase inside that 64 rectangles allow, with
    stairs of 5 cm or wider.

    Args:
        yaw: direction of the frame, radians; by default that of the longest sides.

    Raises:
        OptionError: the outline is too small, or has too many corners for 64 rectangles.
    """
    from shapely.affinity import rotate

    yaw = direction(polygon) if yaw is None else yaw
    turned = rotate(polygon, -yaw, (0.0, 0.0), use_radians=True)
    for step in STEPS:
        slabs = _slabs(turned, step)
        if len(slabs) <= MOST:
            break
    if not slabs:
        x, y = polygon.representative_point().coords[0]
        raise OptionError(f"the outline around ({x:.2f}, {y:.2f}) m is narrower than {NARROWEST:g} m")
    if len(slabs) > MOST:
        x, y = polygon.representative_point().coords[0]
        raise OptionError(
            f"the outline around ({x:.2f}, {y:.2f}) m needs {len(slabs)} rectangles, at most {MOST} are allowed: "
            "straighten it"
        )
    low_x, low_y = min(slab[0] for slab in slabs), min(slab[1] for slab in slabs)
    cosine, sine = math.cos(yaw), math.sin(yaw)
    frame = (low_x * cosine - low_y * sine, low_x * sine + low_y * cosine, yaw)
    rectangles = []
    for x0, y0, x1, y1 in slabs:
        (left, right), (low, high) = _extent(x0 - low_x, x1 - low_x), _extent(y0 - low_y, y1 - low_y)
        rectangles.append(Rectangle(x0=left, y0=low, x1=right, y1=high))
    return (tidy(frame[0]), tidy(frame[1]), frame[2]), tuple(rectangles)


def _slabs(polygon: Polygon, step: float) -> list[Slab]:
    """Return the rectangles of the staircase inside a polygon with stairs of some width, meters."""
    columns = _columns(polygon, step)
    slabs = _joined(columns)
    if any(x1 - x0 < NARROWEST - SAME / 10.0 for x0, _, x1, _ in slabs):
        slabs = _widened(columns)
    return slabs


def _extent(low: float, high: float) -> tuple[float, float]:
    """Return the ends of a side of a rectangle, rounded; a side of 5 cm does not become shorter by rounding."""
    low, high = tidy(low), tidy(high)
    while high - low < NARROWEST:
        high += 1e-6
    return low, high


def direction(polygon: Polygon) -> float:
    """Return the direction of the sides of a polygon, by length, in (-pi/4, pi/4]; 0 unless it exceeds 0.1 mrad."""
    lengths: dict[int, float] = {}
    angles: dict[int, float] = {}
    for (x0, y0), (x1, y1) in pairwise(polygon.exterior.coords):
        angle = math.atan2(y1 - y0, x1 - x0)
        angle -= math.pi / 2.0 * round(angle / (math.pi / 2.0))
        key = round(angle / 2e-3)
        length = math.hypot(x1 - x0, y1 - y0)
        if length > lengths.get(key, 0.0):
            angles[key] = angle
        lengths[key] = lengths.get(key, 0.0) + length
    best = angles[max(lengths, key=lambda key: (round(lengths[key], 6), -abs(key)))]
    return 0.0 if abs(best) < 1e-4 else best


def _columns(polygon: Polygon, step: float) -> list[list[Slab]]:
    """Return columns of slabs inside a polygon, cut at its corners and, under oblique sides, at steps in between."""
    edges = [
        (a, b)
        for ring in (polygon.exterior, *polygon.interiors)
        for a, b in pairwise(ring.coords)
        if abs(a[0] - b[0]) > SAME
    ]
    cuts = distinct([x for edge in edges for x, _ in edge])
    columns: list[list[Slab]] = []
    for low, high in pairwise(cuts):
        rise = _slope(edges, low, high)
        most = max(1, math.floor((high - low) / NARROWEST + SAME))
        parts = 1 if rise <= SAME else min(max((high - low) / step, rise / HIGHEST), most)
        parts = max(1, math.floor(parts))
        columns += [_intervals(edges, *ends) for ends in pairwise(np.linspace(low, high, parts + 1).tolist())]
    return columns


def _slope(edges: list[tuple[tuple[float, ...], tuple[float, ...]]], low: float, high: float) -> float:
    """Return by how much the edges over an interval rise or fall at most, meters."""
    middle = (low + high) / 2.0
    crossing = [(a, b) for a, b in edges if min(a[0], b[0]) < middle < max(a[0], b[0])]
    return max((abs(_at(edge, low) - _at(edge, high)) for edge in crossing), default=0.0)


def _intervals(edges: list[tuple[tuple[float, ...], tuple[float, ...]]], low: float, high: float) -> list[Slab]:
    middle = (low + high) / 2.0
    crossing = [(a, b) for a, b in edges if min(a[0], b[0]) < middle < max(a[0], b[0])]
    crossing.sort(key=lambda edge: _at(edge, middle))
    slabs = []
    for below, above in zip(crossing[::2], crossing[1::2], strict=False):
        y0 = max(_at(below, low), _at(below, high))
        y1 = min(_at(above, low), _at(above, high))
        if y1 - y0 >= NARROWEST - SAME / 10.0:
            slabs.append((low, y0, high, y1))
    return slabs


def _joined(columns: list[list[Slab]]) -> list[Slab]:
    """Return slabs with neighbors of equal height joined; they do not overlap."""
    joined: list[Slab] = []
    for slab in (slab for column in columns for slab in column):
        for index, other in enumerate(joined):
            same = max(abs(other[1] - slab[1]), abs(other[3] - slab[3])) < SAME
            if abs(other[2] - slab[0]) < SAME and same:
                joined[index] = (other[0], other[1], slab[2], other[3])
                break
        else:
            joined.append(slab)
    return joined


def _widened(columns: list[list[Slab]]) -> list[Slab]:
    """Return the rectangles that slabs become if each is widened over the columns that hold its interval of y.

    They overlap, which lets narrow steps be part of wider rectangles.
    """
    widened: dict[tuple[int, int, int, int], Slab] = {}
    for index, column in enumerate(columns):
        for x0, y0, x1, y1 in column:
            left = _reach(reversed(columns[:index]), y0, y1)
            right = _reach(columns[index + 1 :], y0, y1)
            slab = (left[0] if left else x0, y0, right[1] if right else x1, y1)
            if slab[2] - slab[0] >= NARROWEST - SAME / 10.0:
                widened.setdefault((*(round(value / SAME) for value in slab),), slab)  # type: ignore[arg-type]
    return list(widened.values())


def _reach(columns: Iterable[list[Slab]], y0: float, y1: float) -> tuple[float, float] | None:
    """Return the ends in x of the last of the first columns that hold an interval of y, None if none does."""
    last: tuple[float, float] | None = None
    for column in columns:
        holding = [slab for slab in column if slab[1] <= y0 + SAME / 2.0 and slab[3] >= y1 - SAME / 2.0]
        if not holding:
            break
        last = (holding[0][0], holding[0][2])
    return last


def _at(edge: tuple[tuple[float, ...], tuple[float, ...]], x: float) -> float:
    """Return the y of the line through an edge at an x."""
    (x0, y0, *_), (x1, y1, *_) = edge
    return y0 + (y1 - y0) * (x - x0) / (x1 - x0)
