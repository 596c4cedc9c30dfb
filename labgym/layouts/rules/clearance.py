"""Clearance on a grid: distances from grid points to boxes, exact for every point."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable

import numpy as np
from numpy.typing import NDArray

from labgym.geometry import Array, OrientedBox


def lower_to_boxes(values: Array, xs: Array, ys: Array, boxes: Iterable[OrientedBox], reach: float) -> None:
    """Lower the clearance of grid points to their distance from boxes, in place; heights are ignored.

    Args:
        values: clearance (ny, nx), meters; at most `reach`.
        xs, ys: ascending coordinates of columns (nx,) and rows (ny,), evenly spaced, meters.
        boxes: obstacles; inside one the clearance is negative: the depth of the point.
        reach: distance beyond which a box changes nothing, meters.
    """
    step = float(xs[1] - xs[0]) if len(xs) > 1 else 1.0
    for box in boxes:
        x0, y0, x1, y1 = box.bounds()
        columns = _window(x0 - xs[0], x1 - xs[0], reach, step)
        rows = _window(y0 - ys[0], y1 - ys[0], reach, step)
        dx, dy = xs[columns][None, :] - box.x, ys[rows][:, None] - box.y
        cosine, sine = math.cos(box.yaw), math.sin(box.yaw)
        out_x = np.abs(dx * cosine + dy * sine) - box.width / 2.0
        out_y = np.abs(dy * cosine - dx * sine) - box.depth / 2.0
        outside = np.hypot(np.maximum(out_x, 0.0), np.maximum(out_y, 0.0))
        distance = outside + np.minimum(np.maximum(out_x, out_y), 0.0)
        values[rows, columns] = np.minimum(values[rows, columns], distance)


def cells_to(labels: NDArray[np.integer], wanted: Collection[int], row: int, column: int, reach: float) -> np.float32:
    """Return the distance from a cell to the nearest cell with one of some labels, in cells.

    Args:
        labels: label of each cell, (ny, nx).
        reach: distance in cells up to which the result is exact; beyond, it is greater than `reach`.
    """
    if int(labels[row, column]) in wanted:
        return np.float32(0.0)
    span = math.ceil(reach)
    top, left = max(row - span, 0), max(column - span, 0)
    window = labels[top : row + span + 1, left : column + span + 1]
    rows, columns = np.nonzero(np.isin(window, list(wanted)))
    squares = (rows + (top - row)) ** 2 + (columns + (left - column)) ** 2
    return np.sqrt(np.float32(squares.min())) if len(squares) else np.float32(np.inf)


def _window(low: float, high: float, reach: float, step: float) -> slice:
    return slice(max(0, math.floor((low - reach) / step)), max(0, math.ceil((high + reach) / step) + 1))
