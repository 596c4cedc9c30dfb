"""Signed distances to boxes, sampled on a grid and interpolated."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labgym.geometry import OrientedBox

Array = NDArray[np.float64]

RESOLUTION = 0.05
"""Distance between the nodes of a field, meters."""
REACH = 1.2
"""Distances are exact up to this one, meters; larger ones are given as this one."""


@dataclass(frozen=True, eq=False)
class DistanceField:
    """Distances to the nearest of some boxes, negative inside them, at the nodes of a grid.

    Attributes:
        values: (ny, nx) meters, at most `REACH`.
        origin: coordinates of node [0, 0], meters.
        resolution: distance between nodes, meters.
    """

    values: Array
    origin: tuple[float, float]
    resolution: float = RESOLUTION

    @classmethod
    def of(cls, boxes: Iterable[OrientedBox], bounds: Sequence[float], resolution: float = RESOLUTION) -> DistanceField:
        """Return the field of boxes.

        Args:
            boxes: rectangles; their heights do not count.
            bounds: x0, y0, x1, y1 of the region, meters.
        """
        x0, y0, x1, y1 = bounds
        nx, ny = (math.ceil((high - low) / resolution) + 1 for low, high in ((x0, x1), (y0, y1)))
        values = np.full((ny, nx), REACH)
        for box in boxes:
            _lower(values, box, (x0, y0), resolution)
        return cls(values, (x0, y0), resolution)

    def at(self, points: Array) -> Array:
        """Return the interpolated distances at points (n, 2), (n,) meters; outside, that of the nearest node."""
        (a, b, c, d), fx, fy = self._corners(points)
        low = a + (b - a) * fx
        return np.asarray(low + (c + (d - c) * fx - low) * fy)

    def with_gradient(self, points: Array) -> tuple[Array, Array]:
        """Return the interpolated distances (n,) and their derivatives (n, 2) at points (n, 2)."""
        (a, b, c, d), fx, fy = self._corners(points)
        low, high = a + (b - a) * fx, c + (d - c) * fx
        along_x = ((b - a) * (1.0 - fy) + (d - c) * fy) / self.resolution
        return low + (high - low) * fy, np.column_stack([along_x, (high - low) / self.resolution])

    def _corners(self, points: Array) -> tuple[tuple[Array, Array, Array, Array], Array, Array]:
        """Return the values at the four nodes around points (n, 2), and the places in between, in [0, 1)."""
        ny, nx = self.values.shape
        u = np.minimum(np.maximum((points[:, 0] - self.origin[0]) / self.resolution, 0.0), nx - 1.0 - 1e-9)
        v = np.minimum(np.maximum((points[:, 1] - self.origin[1]) / self.resolution, 0.0), ny - 1.0 - 1e-9)
        column, row = u.astype(np.intp), v.astype(np.intp)
        flat, corner = self.values.ravel(), row * nx + column
        nodes = flat.take(corner), flat.take(corner + 1), flat.take(corner + nx), flat.take(corner + nx + 1)
        return nodes, u - column, v - row


def _lower(values: Array, box: OrientedBox, origin: tuple[float, float], resolution: float) -> None:
    """Lower the nodes around a box to their distance from it."""
    x0, y0, x1, y1 = box.bounds()
    ny, nx = values.shape
    c0, c1 = _span(x0 - REACH - origin[0], x1 + REACH - origin[0], nx, resolution)
    r0, r1 = _span(y0 - REACH - origin[1], y1 + REACH - origin[1], ny, resolution)
    if c0 >= c1 or r0 >= r1:
        return
    dx = (origin[0] + resolution * np.arange(c0, c1) - box.x)[None, :]
    dy = (origin[1] + resolution * np.arange(r0, r1) - box.y)[:, None]
    cosine, sine = math.cos(box.yaw), math.sin(box.yaw)
    along = np.abs(cosine * dx + sine * dy) - box.width / 2.0
    across = np.abs(cosine * dy - sine * dx) - box.depth / 2.0
    outside = np.hypot(np.maximum(along, 0.0), np.maximum(across, 0.0))
    window = values[r0:r1, c0:c1]
    np.minimum(window, outside + np.minimum(np.maximum(along, across), 0.0), out=window)


def _span(low: float, high: float, count: int, resolution: float) -> tuple[int, int]:
    return max(0, math.floor(low / resolution)), min(count, math.ceil(high / resolution) + 1)
