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
        clear = self._clear(rows, columns, gx, gy)
        return np.asarray(np.argwhere(clear)[:, ::-1] * CELL, dtype=np.float64)

    def clearances(self, width: float, depth: float, gaps: tuple[float, float]) -> tuple[Array, Array]:
        """Return where a rectangle can stand, as `corners`, and the clear widths around it.

        The widths (n, 4) in meters are those before and behind it along x, and along y, up to something solid.
        """
        columns, rows = math.ceil(width / CELL - EPSILON), math.ceil(depth / CELL - EPSILON)
        gx, gy = (math.ceil(gap / CELL - EPSILON) for gap in gaps)
        places = np.argwhere(self._clear(rows, columns, gx, gy))
        if not len(places):
            return np.zeros((0, 2)), np.zeros((0, 4))
        runs = _runs(self.solid == 0, rows, columns)
        widths = np.stack([run[places[:, 0], places[:, 1]] for run in runs], axis=1)
        return np.asarray(places[:, ::-1] * CELL, dtype=np.float64), np.asarray(widths * CELL, dtype=np.float64)

    def _clear(self, rows: int, columns: int, gx: int, gy: int) -> NDArray[np.bool_]:
        """Whether each window of cells can be furnished, by its first row and column."""
        padded = np.pad(self.solid, ((gy, gy), (gx, gx)), constant_values=1)
        if padded.shape[0] < rows + 2 * gy or padded.shape[1] < columns + 2 * gx:
            return np.zeros((0, 0), dtype=np.bool_)
        clear = _sums(padded, rows + 2 * gy, columns + 2 * gx) == 0
        return np.asarray(clear & (_sums(self.free, rows, columns) == 0))


def _runs(open_: NDArray[np.bool_], rows: int, columns: int) -> list[NDArray[np.int32]]:
    """The number of open cells before and behind each window of cells, along x and along y.

    Each array has an entry for each window, by its first row and column.
    """
    along_x = [_covered(run, rows, 1) for run in (_before(open_), _before(open_[:, ::-1])[:, ::-1])]
    along_y = [_covered(run, 1, columns) for run in (_before(open_.T).T, _before(open_.T[:, ::-1])[:, ::-1].T)]
    left = np.pad(along_x[0], ((0, 0), (1, 0)))[:, : open_.shape[1] - columns + 1]
    right = np.pad(along_x[1], ((0, 0), (0, 1)))[:, columns:]
    below = np.pad(along_y[0], ((1, 0), (0, 0)))[: open_.shape[0] - rows + 1]
    above = np.pad(along_y[1], ((0, 1), (0, 0)))[rows:]
    return [left, right, below, above]


def _before(open_: NDArray[np.bool_]) -> NDArray[np.int32]:
    """The number of open cells in a row that end at each cell, from the left."""
    index = np.arange(open_.shape[1])
    closed = np.maximum.accumulate(np.where(open_, -1, index), axis=1)
    return np.asarray(index - closed, dtype=np.int32)


def _covered(values: NDArray[np.int32], rows: int, columns: int) -> NDArray[np.int32]:
    """The least value in each window of cells, by its first row and column."""
    windows = np.lib.stride_tricks.sliding_window_view(values, (rows, columns))
    return np.asarray(windows.min(axis=(2, 3)), dtype=np.int32)


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
