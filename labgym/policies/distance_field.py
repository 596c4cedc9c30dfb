"""Signed distances to obstacles, sampled on a grid and interpolated."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from labgym.geometry import Array, OrientedBox
from labgym.navigation import OccupancyGrid

NODE_DISTANCE_M = 0.05
"""Distance between the nodes of a field of boxes, meters."""
FARTHEST_BOX_M = 1.2
"""Greatest distance in a field of boxes, meters."""


@dataclass(frozen=True, eq=False)
class DistanceField:
    """Distances to the nearest obstacle, negative inside it, at the nodes of a grid; bilinear between the nodes.

    Attributes:
        values: (ny, nx) meters.
        origin: corner of the grid, meters.
        resolution: distance between nodes, meters.
        first: place of node [0, 0] along both axes from the corner, in units of the resolution.
    """

    values: Array
    origin: tuple[float, float]
    resolution: float = NODE_DISTANCE_M
    first: float = 0.0

    @classmethod
    def of_boxes(
        cls, boxes: Iterable[OrientedBox], bounds: Sequence[float], resolution: float = NODE_DISTANCE_M
    ) -> DistanceField:
        """Return the field of boxes, at most `FARTHEST_BOX_M`.

        Args:
            boxes: rectangles; their heights do not count.
            bounds: x0, y0, x1, y1 of the region, meters.
            resolution: distance between nodes, meters.
        """
        x0, y0, x1, y1 = bounds
        nx, ny = (math.ceil((high - low) / resolution) + 1 for low, high in ((x0, x1), (y0, y1)))
        values = np.full((ny, nx), FARTHEST_BOX_M)
        for box in boxes:
            _lower(values, box, (x0, y0), resolution)
        return cls(values, (x0, y0), resolution)

    @classmethod
    def of_cells(cls, grid: OccupancyGrid, farthest: float) -> DistanceField:
        """Return the field of the sides of the occupied cells, with a node in the center of each cell.

        Args:
            grid: the obstacles; outside, the floor counts as free. farthest: greatest distance, meters.
        """
        outside, inside = (
            np.maximum(cv2.distanceTransform(mask.astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE) - 0.5, 0.0)
            for mask in (~grid.occupied, grid.occupied)
        )
        meters = (outside.astype(np.float64) - inside.astype(np.float64)) * grid.resolution
        return cls(np.clip(meters, -farthest, farthest), grid.origin, grid.resolution, first=0.5)

    def at(self, points: Array) -> Array:
        """Return the distances at points (..., 2), meters; outside the grid, that of the nearest place inside."""
        (a, b, c, d), fx, fy = self._corners(points)
        low = a + (b - a) * fx
        return np.asarray(low + (c + (d - c) * fx - low) * fy)

    def with_gradient(self, points: Array) -> tuple[Array, Array]:
        """Return the distances at points (..., 2), meters, and their derivatives (..., 2)."""
        (a, b, c, d), fx, fy = self._corners(points)
        low, high = a + (b - a) * fx, c + (d - c) * fx
        along_x = ((b - a) * (1.0 - fy) + (d - c) * fy) / self.resolution
        return low + (high - low) * fy, np.stack([along_x, (high - low) / self.resolution], axis=-1)

    def _corners(self, points: Array) -> tuple[tuple[Array, Array, Array, Array], Array, Array]:
        """Return the values at the four nodes around points (..., 2), and the places in between, in [0, 1]."""
        ny, nx = self.values.shape
        u, v = (
            np.minimum(np.maximum((points[..., axis] - self.origin[axis]) / self.resolution - self.first, 0.0), last)
            for axis, last in ((0, nx - 1.0), (1, ny - 1.0))
        )
        column, row = np.minimum(u.astype(np.intp), nx - 2), np.minimum(v.astype(np.intp), ny - 2)
        flat, corner = self.values.ravel(), row * nx + column
        nodes = flat.take(corner), flat.take(corner + 1), flat.take(corner + nx), flat.take(corner + nx + 1)
        return nodes, u - column, v - row


def _lower(values: Array, box: OrientedBox, origin: tuple[float, float], resolution: float) -> None:
    """Lower the nodes around a box to their distance from it."""
    x0, y0, x1, y1 = box.bounds()
    ny, nx = values.shape
    c0, c1 = _span(x0 - FARTHEST_BOX_M - origin[0], x1 + FARTHEST_BOX_M - origin[0], nx, resolution)
    r0, r1 = _span(y0 - FARTHEST_BOX_M - origin[1], y1 + FARTHEST_BOX_M - origin[1], ny, resolution)
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
