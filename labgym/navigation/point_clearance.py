"""The clearance of single points: the bits of `Barriers.clearance`, in a tenth of its time."""

from __future__ import annotations

import math

import numpy as np

from labgym.navigation.barriers import Barriers

CELL = 0.5
"""Side of the cells whose nearest rectangles are looked up once, meters."""
RESERVE = 1e-6
"""Reserve for rounding, meters."""

_Row = tuple[float, ...]


class PointClearance:
    """Distances from points of a floor to the nearest barrier.

    For each cell it compares the few rectangles that can be nearest there.

    Args:
        barriers: the barriers.
    """

    def __init__(self, barriers: Barriers) -> None:
        self._barriers = barriers
        boxes = barriers.obstacles.boxes
        rows = np.column_stack([boxes.centre, boxes.axes().reshape(-1, 4), boxes.half])
        self._rows: list[_Row] = [tuple(row) for row in rows.tolist()]
        self._cells: dict[tuple[int, int], tuple[_Row, ...]] = {}

    def at(self, x: float, y: float) -> float:
        """Return the distance from a point to the nearest barrier, meters, as `Barriers.clearance`."""
        cell = math.floor(x / CELL), math.floor(y / CELL)
        rows = self._cells.get(cell)
        if rows is None:
            rows = self._cells[cell] = self._nearest(*cell)
        nearest = math.inf
        for center_x, center_y, xx, xy, yx, yy, half_x, half_y in rows:
            dx, dy = x - center_x, y - center_y
            u, v = abs(dx * xx + dy * xy) - half_x, abs(dx * yx + dy * yy) - half_y
            # The absolute value of a complex number is the C library's hypot, as NumPy's.
            away = abs(complex(u, v)) if u > 0.0 and v > 0.0 else max(u, v, 0.0)
            if away < nearest:
                nearest = away
        return nearest

    def _nearest(self, column: int, row: int) -> tuple[_Row, ...]:
        """Return the rectangles that can be the nearest one to a point of a cell."""
        if not self._rows:
            return ()
        center = np.array([[(column + 0.5) * CELL, (row + 0.5) * CELL]])
        distances = self._barriers.obstacles.point_distances(center)[0]
        near = distances <= distances.min() + math.sqrt(2.0) * CELL + RESERVE
        return tuple(self._rows[index] for index in np.flatnonzero(near).tolist())
