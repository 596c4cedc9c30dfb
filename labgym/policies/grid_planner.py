"""Plans on an occupancy grid: A* that likes clearance, then a taut any-angle path."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from labgym.navigation import PLANNING_RADIUS, OccupancyGrid, astar

STRIDE = 3
"""A taut path is drawn between every third cell of the grid's path."""

Array = NDArray[np.float64]
Point = tuple[float, float]


@dataclass(frozen=True)
class PlannerOptions:
    """What a plan aims at.

    Attributes:
        radius: clearance that every cell of the path has, metres.
        comfort: clearance beyond which more is not sought, metres.
        aversion: how many times its length a path through cells at `radius` costs more than one at `comfort`.
        snap: how far an end in an occupied cell may be moved to a free one, metres.
    """

    radius: float = PLANNING_RADIUS
    comfort: float = 0.50
    aversion: float = 1.0
    snap: float = 0.40


class GridPlanner:
    """Plans on one occupancy grid, known or built so far; what searches share is computed once.

    Args:
        grid: the obstacles as they are, not dilated.
        options: what a plan aims at.
        surcharge: (ny, nx), at least 0: by how many times its length a path through each cell costs more; None for
            nowhere. A map under construction charges so for what it has not seen.

    Attributes:
        free: the grid dilated by the radius.
    """

    def __init__(
        self, grid: OccupancyGrid, options: PlannerOptions | None = None, surcharge: Array | None = None
    ) -> None:
        self.options = options or PlannerOptions()
        self._grid = grid
        self.free = grid.dilated(self.options.radius)
        wanted = max(self.options.comfort - self.options.radius, 1e-6)
        lack = np.clip((self.options.comfort - clearance_field(grid)) / wanted, 0.0, 1.0)
        self._costs = 1.0 + self.options.aversion * lack**2 + (0.0 if surcharge is None else surcharge)
        self._prices = np.where(self.free.occupied, math.inf, self._costs)

    def plan(self, start: Point, goal: Point) -> Array | None:
        """Return a path (n, 2) in the grid's frame, metres, from start to goal; None where there is none.

        An end where the robot does not fit is joined by a straight piece to the nearest free cell, if that is near.
        """
        here, there = self.snapped(start), self.snapped(goal)
        if here is None or there is None:
            return None
        path = astar(self.free, here, there, self._costs)
        if path is None:
            return None
        path = self._taut(np.concatenate([[here], path[1:-1], [there]]))
        before = [start] if here != start else []
        after = [goal] if there != goal else []
        return np.array([*before, *path, *after])

    def snapped(self, point: Point) -> Point | None:
        """Return the point where the robot fits there, else the nearest free cell's centre; None where none is near."""
        if self.free.free(*point):
            return point
        xs, ys = self.free.centres()
        away = np.hypot(xs[None, :] - point[0], ys[:, None] - point[1])
        away[self.free.occupied] = math.inf
        row, column = np.unravel_index(int(np.argmin(away)), away.shape)
        return self.free.centre_of(int(row), int(column)) if away[row, column] <= self.options.snap else None

    def _taut(self, path: Array) -> Array:
        """Return the cheapest chain of straight pieces between points of a path, ends kept: dynamic programming."""
        points = np.concatenate([path[:-1:STRIDE], path[-1:]])
        best = np.full(len(points), math.inf)
        best[0] = 0.0
        before = np.zeros(len(points), dtype=np.intp)
        for k in range(len(points) - 1):
            total = best[k] + self._straight_costs(points[k], points[k + 1 :])
            better = total < best[k + 1 :]
            best[k + 1 :][better] = total[better]
            before[k + 1 :][better] = k
        if not math.isfinite(best[-1]):
            return path
        kept = [len(points) - 1]
        while kept[-1] > 0:
            kept.append(int(before[kept[-1]]))
        return np.asarray(points[kept[::-1]])

    def _straight_costs(self, start: Array, ends: Array) -> Array:
        """Return what straight pieces from a point to others (m, 2) cost, (m,); inf through occupied cells."""
        lengths = np.linalg.norm(ends - start, axis=1)
        count = max(2, math.ceil(float(lengths.max()) / (self._grid.resolution / 2.0)))
        samples = start + np.linspace(0.0, 1.0, count)[None, :, None] * (ends - start)[:, None, :]
        cells = np.floor((samples - self._grid.origin) / self._grid.resolution).astype(np.intp)
        ny, nx = self._grid.shape
        columns, rows = np.clip(cells[..., 0], 0, nx - 1), np.clip(cells[..., 1], 0, ny - 1)
        return np.asarray(lengths * self._prices[rows, columns].mean(axis=1))


def clearance_field(grid: OccupancyGrid) -> Array:
    """Return the distance from each cell's centre to the nearest occupied cell's side, (ny, nx) metres.

    By the exact Euclidean distance transform, less half a cell: exact straight across, and up to a fifth of a cell too
    long askew.
    """
    walled = np.pad(~grid.occupied, 1).astype(np.uint8)
    cells = cv2.distanceTransform(walled, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)[1:-1, 1:-1]
    return np.maximum(np.asarray(cells, dtype=np.float64) - 0.5, 0.0) * grid.resolution
