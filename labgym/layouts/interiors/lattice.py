"""A space as square cells: where rectangles of furniture can stand in the open."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

CELL = 0.05
"""Side of a cell, meters."""
EPSILON = 1e-6

Array = NDArray[np.float64]


class Lattice:
    """Cells that are solid, and cells that stay free of furniture; everything beyond the bounds is solid."""

    def __init__(self, width: float, depth: float) -> None:
        """Start with empty bounds, meters."""
        shape = (max(1, math.floor(depth / CELL + EPSILON)), max(1, math.floor(width / CELL + EPSILON)))
        self.solid = np.zeros(shape, dtype=np.int32)
        self.free = np.zeros(shape, dtype=np.int32)

    def add(self, solid: Array, free: Array) -> None:
        """Mark the cells that overlap boxes with bounds (n, 4): x0, y0, x1, y1."""
        _mark(self.solid, solid)
        _mark(self.free, free)

    def corners(self, width: float, depth: float, gaps: tuple[float, float]) -> Array:
        """Return where a rectangle can stand: positions (n, 2) of its corner of least x and y.

        It overlaps no area that stays free, and keeps a gap to everything solid.

        Args:
            width, depth: sides along x and y, meters.
            gaps: along x and y, meters.
        """
        columns, rows = math.ceil(width / CELL - EPSILON), math.ceil(depth / CELL - EPSILON)
        gx, gy = (math.ceil(gap / CELL - EPSILON) for gap in gaps)
        padded = np.pad(self.solid, ((gy, gy), (gx, gx)), constant_values=1)
        if padded.shape[0] < rows + 2 * gy or padded.shape[1] < columns + 2 * gx:
            return np.zeros((0, 2))
        clear = _sums(padded, rows + 2 * gy, columns + 2 * gx) == 0
        clear &= _sums(self.free, rows, columns) == 0
        return np.asarray(np.argwhere(clear)[:, ::-1] * CELL, dtype=np.float64)


def _mark(cells: NDArray[np.int32], bounds: Array) -> None:
    low = np.floor(bounds[:, :2] / CELL + EPSILON).astype(int)
    high = np.ceil(bounds[:, 2:] / CELL - EPSILON).astype(int)
    for (x0, y0), (x1, y1) in zip(np.maximum(low, 0).tolist(), np.maximum(high, 0).tolist(), strict=True):
        cells[y0:y1, x0:x1] = 1


def _sums(cells: NDArray[np.int32], rows: int, columns: int) -> NDArray[np.int32]:
    """Sum of each window of cells, by its first row and column."""
    table = np.zeros((cells.shape[0] + 1, cells.shape[1] + 1), dtype=np.int32)
    np.cumsum(np.cumsum(cells, axis=0), axis=1, out=table[1:, 1:])
    return np.asarray(
        table[rows:, columns:] - table[:-rows, columns:] - table[rows:, :-columns] + table[:-rows, :-columns]
    )
