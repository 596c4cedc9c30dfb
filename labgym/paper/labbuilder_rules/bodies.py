"""Upright boxes as the rules see them: extents along axes, overlap and excess. Lengths in meters."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from labgym.geometry import OrientedBox
from labgym.geometry.overlap import overlap_volume

CM = 100.0
"""Centimeters in a meter."""
Span = tuple[float, float, float, float]
"""A unit vector (x, y), and the least and the greatest coordinate along it."""


@dataclass(frozen=True)
class Body:
    """An upright box.

    Attributes:
        x, y: middle of its footprint. width, depth: its sides. yaw: of the side `width` to +x, radians.
        z0, z1: bottom and top.
    """

    x: float
    y: float
    width: float
    depth: float
    yaw: float = 0.0
    z0: float = 0.0
    z1: float = 0.0

    def along(self, ux: float, uy: float) -> tuple[float, float]:
        """Return the extent along a unit vector."""
        (cx, cy), (sx, sy) = self._axes()
        half = self.width / 2 * abs(cx * ux + cy * uy) + self.depth / 2 * abs(sx * ux + sy * uy)
        middle = self.x * ux + self.y * uy
        return middle - half, middle + half

    def spans(self) -> tuple[Span, Span]:
        """Return the extents along the body's own sides."""
        first, second = self._axes()
        return (*first, *self.along(*first)), (*second, *self.along(*second))

    def contains(self, x: float, y: float, z: float) -> bool:
        """Return whether a point is inside or on the boundary."""
        flat = all(low <= x * ux + y * uy <= high for ux, uy, low, high in self.spans())
        return flat and self.z0 <= z <= self.z1

    def overlaps(self, other: Body, depth: float) -> bool:
        """Return whether two bodies overlap by more than a depth along each axis, moving either way."""
        if _apart((self.z0, self.z1), (other.z0, other.z1), depth):
            return False
        axes = (*self._axes(), *other._axes())
        return not any(_apart(self.along(*axis), other.along(*axis), depth) for axis in axes)

    def shared_area(self, other: Body) -> float:
        """Return the area that two footprints share, square meters."""
        return overlap_volume(self._box(), other._box())

    def _axes(self) -> tuple[tuple[float, float], tuple[float, float]]:
        if self.yaw == 0.0:
            return (1.0, 0.0), (0.0, 1.0)
        cosine, sine = math.cos(self.yaw), math.sin(self.yaw)
        return (cosine, sine), (-sine, cosine)

    def _box(self) -> OrientedBox:
        return OrientedBox(self.x, self.y, self.width, self.depth, self.yaw)


def excess(body: Body, bounds: Iterable[Span]) -> float:
    """Return how far a footprint extends beyond bounds, at the side where it is most; negative inside."""
    worst = -math.inf
    for ux, uy, low, high in bounds:
        least, greatest = body.along(ux, uy)
        worst = max(worst, low - least, greatest - high)
    return worst


def _apart(one: tuple[float, float], other: tuple[float, float], depth: float) -> bool:
    return one[1] <= other[0] + depth or one[0] >= other[1] - depth
