"""Rectangles of a constraint program: bounds that are expressions, each with the numbers that it lies between."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from labgym.geometry import OrientedBox
from labgym.layouts.brief import Wall
from labgym.layouts.constraint_solver import CM, centimeters

Range = tuple[int, int]
Ranges = tuple[Range, Range, Range, Range]
"""Least and greatest x0, y0, x1 and y1, centimeters."""


class Edge(NamedTuple):
    """A coordinate: a linear expression and the numbers that it lies between, centimeters."""

    value: Any
    low: int
    high: int


class Rect(NamedTuple):
    """Bounds of a rectangle."""

    x0: Edge
    y0: Edge
    x1: Edge
    y1: Edge

    @classmethod
    def fixed(cls, *bounds: int) -> Rect:
        """Return the rectangle with constant bounds x0, y0, x1 and y1, centimeters."""
        return cls(*(Edge(bound, bound, bound) for bound in bounds))


def union(ranges: list[Ranges]) -> Ranges:
    """Return the smallest ranges that contain some."""
    low = [min(choice[k][0] for choice in ranges) for k in range(4)]
    high = [max(choice[k][1] for choice in ranges) for k in range(4)]
    return (low[0], high[0]), (low[1], high[1]), (low[2], high[2]), (low[3], high[3])


def fronted(ranges: Ranges, wall: Wall, front: int) -> Ranges:
    """Return the ranges of a footprint against a wall, grown by the zone in front of it in centimeters."""
    (x0, y0, x1, y1) = ranges
    if wall == "right":
        return (x0[0] - front, x0[1] - front), y0, x1, y1
    if wall == "back":
        return x0, (y0[0] - front, y0[1] - front), x1, y1
    if wall == "left":
        return x0, y0, (x1[0] + front, x1[1] + front), y1
    return x0, y0, x1, (y1[0] + front, y1[1] + front)


def rect_around(box: OrientedBox) -> Rect:
    """Return the bounds of a box in whole centimeters, rounded outward."""
    x0, y0, x1, y1 = box.bounds()
    return Rect.fixed(math.floor(x0 * CM + 1e-6), math.floor(y0 * CM + 1e-6), centimeters(x1), centimeters(y1))
