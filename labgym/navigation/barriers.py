"""The furniture and the walls of a floor plan, from which a disc keeps its distance; clearances of single points."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labgym.navigation.clearance import Obstacles
from labgym.navigation.plan import OBSTACLE_HEIGHT, FloorPlan, FloorShape

Array = NDArray[np.float64]

DIRECTIONS = 8
"""Number of directions in which a disc is looked up on the floor."""
CELL_M = 0.5
"""Side of the cells whose nearest rectangles are looked up once, meters."""
ROUNDING_M = 1e-6
"""Reserve for rounding, meters."""

_Row = tuple[float, ...]


@dataclass(frozen=True, eq=False)
class Barriers:
    """The barriers of a floor plan.

    Attributes:
        obstacles: the rectangles: furniture, walls and columns.
        low, high: (2,) corners of a rectangle around the floor and its walls, meters.
        floor: walls and spaces.
    """

    obstacles: Obstacles
    low: Array
    high: Array
    floor: FloorShape

    @classmethod
    def of(cls, plan: FloorPlan, below: float = OBSTACLE_HEIGHT) -> Barriers:
        """Return the barriers of a floor plan; objects whose bottom is above a height in meters are ignored."""
        boxes = [*plan.obstacles(below), *(box for box in plan.floor.solids if box.z0 < below)]
        bounds = np.array(plan.floor.bounds, dtype=np.float64)
        return cls(Obstacles(boxes), bounds[:2], bounds[2:], plan.floor)

    def clearance(self, points: Array) -> Array:
        """Return the distance from points (m, 2) to the nearest barrier, (m,) meters; 0 in an obstacle or a wall."""
        return self.obstacles.nearest(points)

    def line_clearance(self, points: Array) -> float:
        """Return the least distance from a polyline (n, 2) to a barrier, meters; as `clearance`."""
        return float(self.obstacles.segment_distances(points[:-1], points[1:]).min(initial=math.inf))

    def inside(self, points: Array) -> NDArray[np.bool_]:
        """Whether points (m, 2) lie in a room, or in an opening between rooms, (m,)."""
        return self.floor.inside(points)

    def discs_inside(self, points: Array, radius: float) -> NDArray[np.bool_]:
        """Whether discs that touch no obstacle lie on the floor and not outside of its walls, (m,).

        Walls enclose the floor, so a disc that none of them cuts is on the floor with all of its points or with none;
        spaces may leave wedges along oblique walls, so several points of the disc are looked up.
        """
        inside = np.asarray(self.floor.inside(points))
        rest = np.flatnonzero(~inside)
        if len(rest):
            angle = np.arange(DIRECTIONS) * (2.0 * math.pi / DIRECTIONS)
            offsets = 0.9 * radius * np.column_stack([np.cos(angle), np.sin(angle)])
            samples = (points[rest, None, :] + offsets).reshape(-1, 2)
            inside[rest] = self.floor.inside(samples).reshape(len(rest), -1).any(axis=1)
        return inside


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
        cell = math.floor(x / CELL_M), math.floor(y / CELL_M)
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
        center = np.array([[(column + 0.5) * CELL_M, (row + 0.5) * CELL_M]])
        distances = self._barriers.obstacles.point_distances(center)[0]
        near = distances <= distances.min() + math.sqrt(2.0) * CELL_M + ROUNDING_M
        return tuple(self._rows[index] for index in np.flatnonzero(near).tolist())
