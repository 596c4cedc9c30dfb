"""Quick rejection of straight lines that run through obstacles, by looking up sample points in a grid."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from labgym.navigation.clearance import Obstacles

Array = NDArray[np.float64]

CELLS_PER_RADIUS = 5
MAX_CELLS = 2_000_000
LEVELS = (1, 2, 4, 8, 16, 32)
"""Numbers of sample points of a segment, one after the other until one of them is blocked."""


class BlockedCells:
    """Cells in which no position of the disc's center is free.

    A cell counts as blocked only if all of it is nearer than the radius to one rectangle, so a segment through a
    blocked cell is never free. The converse does not hold: this is a filter in front of the exact test.

    Args:
        obstacles: the rectangles.
        radius: radius of the disc, meters.
        low: (2,) least corner of the part of the plane that matters, meters.
        high: (2,) greatest corner, meters.
    """

    def __init__(self, obstacles: Obstacles, radius: float, low: Array, high: Array) -> None:
        extent = np.maximum(high - low, 0.0)
        self._size = max(radius / CELLS_PER_RADIUS, math.sqrt(float(extent.prod()) / MAX_CELLS))
        # A ring of cells around the part stands for everything outside of it and is not blocked.
        self._origin = low - self._size
        columns, rows = (int(count) + 3 for count in extent // self._size)
        self._blocked = np.zeros((rows, columns), dtype=bool)
        reach = radius - 1e-6 - self._size * math.sqrt(0.5)
        if reach > 0.0:
            self._mark(obstacles, reach)

    def block(self, starts: Array, ends: Array) -> NDArray[np.bool_]:
        """Whether some sample point of each segment (m, 2)-(m, 2) is in a blocked cell, (m,)."""
        blocked = np.zeros(len(starts), dtype=bool)
        rest = np.arange(len(starts))
        # In cells, so that sampling is one multiplication, one addition and one look-up.
        begin, direction = (starts - self._origin) / self._size, (ends - starts) / self._size
        rows, columns = self._blocked.shape
        for count in LEVELS:
            share = (np.arange(count) + 0.5) / count
            x = (begin[rest, 0, None] + direction[rest, 0, None] * share).astype(np.intp)
            y = (begin[rest, 1, None] + direction[rest, 1, None] * share).astype(np.intp)
            hit = self._blocked[np.clip(y, 0, rows - 1), np.clip(x, 0, columns - 1)].any(axis=1)
            blocked[rest[hit]] = True
            rest = rest[~hit]
        return blocked

    def _mark(self, obstacles: Obstacles, reach: float) -> None:
        """Set the cells whose center is nearer than `reach` to a rectangle."""
        boxes = obstacles.boxes
        rows, columns = self._blocked.shape
        axes, corners = boxes.axes(), boxes.corners()
        first = np.floor((corners.min(axis=1) - reach - self._origin) / self._size).astype(int)
        last = np.ceil((corners.max(axis=1) + reach - self._origin) / self._size).astype(int)
        for k in range(len(boxes)):
            c0, c1 = max(1, int(first[k, 0])), min(columns - 1, int(last[k, 0]))
            r0, r1 = max(1, int(first[k, 1])), min(rows - 1, int(last[k, 1]))
            if c0 >= c1 or r0 >= r1:
                continue
            x = self._origin[0] + (np.arange(c0, c1) + 0.5) * self._size - boxes.centre[k, 0]
            y = (self._origin[1] + (np.arange(r0, r1) + 0.5) * self._size - boxes.centre[k, 1])[:, None]
            ax, ay = axes[k]
            along = np.maximum(np.abs(x * ax[0] + y * ax[1]) - boxes.half[k, 0], 0.0)
            across = np.maximum(np.abs(x * ay[0] + y * ay[1]) - boxes.half[k, 1], 0.0)
            self._blocked[r0:r1, c0:c1] |= along**2 + across**2 < reach**2
