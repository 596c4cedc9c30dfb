"""Plots: the outlines of future spaces, and the rectangles that fill them. Lengths in meters, angles in radians."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Literal

import numpy as np

from labgym.geometry import rotate
from labgym.layouts.floor import Rectangle, Space

Point = tuple[float, float]
Outline = tuple[Point, ...]
Use = Literal["laboratory", "instrument", "store", "write-up", "corridor"]

STEP = 0.06
"""Distance within which rectangles follow an oblique edge, meters; a rectangle has sides of at least 5 cm."""
STRAIGHT = 1e-6


@dataclass(frozen=True)
class Plot:
    """The free floor of a future space.

    Attributes:
        outline: corners (x, y) in the floor frame, counter-clockwise.
        yaw: yaw of the space's frame.
    """

    id: str
    use: Use
    outline: Outline
    yaw: float = 0.0

    @property
    def area(self) -> float:
        """Area, square meters."""
        twice = sum(x0 * y1 - x1 * y0 for (x0, y0), (x1, y1) in closed(self.outline))
        return abs(twice) / 2.0

    @property
    def edges(self) -> list[tuple[Point, Point]]:
        """The edges from corner to corner; the plot lies on their left."""
        return closed(self.outline)


def closed(outline: Outline) -> list[tuple[Point, Point]]:
    """Return the edges of an outline, the last one back to the first corner."""
    return list(pairwise((*outline, outline[0])))


def rectangle(x0: float, y0: float, x1: float, y1: float) -> Outline:
    """Return the outline of an axis-aligned rectangle."""
    return (x0, y0), (x1, y0), (x1, y1), (x0, y1)


def extent(outlines: Iterable[Outline]) -> tuple[float, float, float, float]:
    """Return the axis-aligned bounds (x0, y0, x1, y1) of outlines."""
    corners = np.array([corner for outline in outlines for corner in outline])
    (x0, y0), (x1, y1) = corners.min(axis=0), corners.max(axis=0)
    return float(x0), float(y0), float(x1), float(y1)


def diagonal(plots: Sequence[Plot]) -> float:
    """Return the diagonal of the bounds of plots."""
    x0, y0, x1, y1 = extent(plot.outline for plot in plots)
    return math.hypot(x1 - x0, y1 - y0)


def posed(plots: Sequence[Plot], generator: np.random.Generator) -> tuple[Plot, ...]:
    """Return plots turned by a random number of quarters, mirrored or not, with their least corner at the origin."""
    quarters, mirrored = int(generator.integers(4)), bool(generator.integers(2))
    turned = []
    for plot in plots:
        corners = [(-x, y) if mirrored else (x, y) for x, y in plot.outline]
        corners = [_quartered(corner, quarters) for corner in corners]
        outline = tuple(reversed(corners)) if mirrored else tuple(corners)
        turned.append(replace(plot, outline=outline, yaw=-plot.yaw if mirrored else plot.yaw))
    x0, y0, _, _ = extent(plot.outline for plot in turned)
    return tuple(
        replace(plot, outline=tuple((round(x - x0, 9), round(y - y0, 9)) for x, y in plot.outline)) for plot in turned
    )


def space_of(plot: Plot, ceiling: float) -> Space:
    """Return the space of a plot: its frame has its origin at the least corner of the plot in that frame.

    Along oblique edges the rectangles of the region stay inside the plot and leave wedges of up to `STEP`.
    """
    local = [rotate(x, y, -plot.yaw) for x, y in plot.outline]
    x0, y0 = min(x for x, _ in local), min(y for _, y in local)
    x, y = rotate(x0, y0, plot.yaw)
    region = inscribed(tuple((px - x0, py - y0) for px, py in local))
    return Space(id=plot.id, use=plot.use, x=round(x, 6), y=round(y, 6), yaw=plot.yaw, region=region, ceiling=ceiling)


def inscribed(outline: Outline) -> tuple[Rectangle, ...]:
    """Return rectangles inside an outline: strips along x that together fill it but for wedges at oblique edges."""
    strips: list[tuple[float, float, float, float]] = []
    for low, high in pairwise(_levels(outline)):
        for x0, x1 in _spans(outline, low, high):
            below = next((k for k, strip in enumerate(strips) if _continues(strip, x0, x1, low)), None)
            if below is None:
                strips.append((x0, low, x1, high))
            else:
                strips[below] = (x0, strips[below][1], x1, high)
    return tuple(
        Rectangle(x0=round(x0, 6), y0=round(y0, 6), x1=round(x1, 6), y1=round(y1, 6))
        for x0, y0, x1, y1 in strips
        if min(x1 - x0, y1 - y0) >= 0.05 + STRAIGHT
    )


def _continues(strip: tuple[float, float, float, float], x0: float, x1: float, y: float) -> bool:
    return max(abs(strip[0] - x0), abs(strip[2] - x1), abs(strip[3] - y)) < STRAIGHT


def _levels(outline: Outline) -> list[float]:
    """Heights between which strips run: all corners, and points along oblique edges."""
    corners = sorted(y for _, y in outline)
    levels = {corners[0], corners[-1]}
    heights = list(corners)
    for (x0, y0), (x1, y1) in closed(outline):
        rise = min(abs(x1 - x0), abs(y1 - y0))
        if rise > STRAIGHT:
            count = max(1, math.floor(rise / STEP))
            heights += [y0 + (y1 - y0) * k / count for k in range(1, count)]
    for y in heights:
        if min(abs(y - level) for level in levels) >= STEP:
            levels.add(y)
    return sorted(levels)


def _spans(outline: Outline, low: float, high: float) -> list[tuple[float, float]]:
    """Intervals of x that lie inside the outline at every height between two levels."""
    heights = [low, *sorted({y for _, y in outline if low + STRAIGHT < y < high - STRAIGHT}), high]
    spans: list[tuple[float, float]] | None = None
    for y0, y1 in pairwise(heights):
        if y1 - y0 < STRAIGHT:
            continue
        crossings = sorted(_crossings(outline, y0, y1))
        inside = [
            (max(left), min(right))
            for (_, *left), (_, *right) in zip(crossings[::2], crossings[1::2], strict=True)
            if max(left) < min(right)
        ]
        spans = inside if spans is None else _common(spans, inside)
    return spans or []


def _crossings(outline: Outline, y0: float, y1: float) -> list[tuple[float, float, float]]:
    """X of the edges that cross a strip: at its middle, at its bottom and at its top."""
    crossings = []
    for (ax, ay), (bx, by) in closed(outline):
        if min(ay, by) <= y0 + STRAIGHT and max(ay, by) >= y1 - STRAIGHT and abs(by - ay) > STRAIGHT:
            slope = (bx - ax) / (by - ay)
            bottom, top = ax + (y0 - ay) * slope, ax + (y1 - ay) * slope
            crossings.append(((bottom + top) / 2.0, bottom, top))
    return crossings


def _common(first: list[tuple[float, float]], second: list[tuple[float, float]]) -> list[tuple[float, float]]:
    pairs = [(max(a0, b0), min(a1, b1)) for a0, a1 in first for b0, b1 in second]
    return [(low, high) for low, high in pairs if low < high]


def _quartered(point: Point, quarters: int) -> Point:
    x, y = point
    for _ in range(quarters % 4):
        x, y = -y, x
    return x, y
