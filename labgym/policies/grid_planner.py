"""Planning on an occupancy grid: A* with a preference for clearance, then a taut any-angle path."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np

from labgym.geometry import Array
from labgym.navigation import PLANNING_RADIUS, OccupancyGrid, astar

TAUT_STRIDE_CELLS = 3
"""The taut path connects every third cell of the grid path."""

Point = tuple[float, float]


@dataclass(frozen=True)
class PlannerOptions:
    """Options of `GridPlanner`.

    Attributes:
        radius: clearance of every cell of the path, meters.
        comfort: clearance beyond which more has no benefit, meters.
        aversion: extra cost per meter at `radius` compared with `comfort`, as a multiple of length.
        snap: distance by which an end in an occupied cell may be moved to a free one, meters.
    """

    radius: float = PLANNING_RADIUS
    comfort: float = 0.50
    aversion: float = 1.0
    snap: float = 0.40


class GridPlanner:
    """Plans on one occupancy grid; fields that all searches need are computed once.

    Args:
        grid: the obstacles, not dilated.
        options: options of the planner.
        surcharge: (ny, nx), at least 0: extra cost per meter, as a multiple of length; None adds nothing. A map under
            construction charges for unseen floor in this way.
        clearance: (ny, nx) distance from each cell's center to the nearest obstacle, meters, if it is known better than
            from the grid; cells with less than the radius are then closed. None computes it from the grid.

    Attributes:
        free: the grid dilated by the radius.
    """

    def __init__(
        self,
        grid: OccupancyGrid,
        options: PlannerOptions | None = None,
        surcharge: Array | None = None,
        clearance: Array | None = None,
    ) -> None:
        self.options = options or PlannerOptions()
        self._grid = grid
        if clearance is None:
            self.free, clearance = grid.dilated(self.options.radius), clearance_field(grid)
        else:
            self.free = OccupancyGrid(clearance < self.options.radius, grid.resolution, grid.origin)
        span = max(self.options.comfort - self.options.radius, 1e-6)
        lack = np.clip((self.options.comfort - clearance) / span, 0.0, 1.0)
        self._costs = 1.0 + self.options.aversion * lack**2 + (0.0 if surcharge is None else surcharge)
        self._prices = np.where(self.free.occupied, math.inf, self._costs)

    def plan(self, start: Point, goal: Point) -> Array | None:
        """Return a path (n, 2) in the grid's frame, meters, from start to goal; None if no path exists.

        An end where the robot does not fit is joined by a straight piece to the nearest free cell within `snap`.
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
        """Return the point if the robot fits there, else the center of the nearest free cell within `snap`, or None."""
        if self.free.free(*point):
            return point
        xs, ys = self.free.centres()
        away = np.hypot(xs[None, :] - point[0], ys[:, None] - point[1])
        away[self.free.occupied] = math.inf
        row, column = np.unravel_index(int(np.argmin(away)), away.shape)
        return self.free.centre_of(int(row), int(column)) if away[row, column] <= self.options.snap else None

    def _taut(self, path: Array) -> Array:
        """Return the cheapest chain of straight pieces between points of a path, by dynamic programming."""
        points = np.concatenate([path[:-1:TAUT_STRIDE_CELLS], path[-1:]])
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
        chain = [len(points) - 1]
        while chain[-1] > 0:
            chain.append(int(before[chain[-1]]))
        return np.asarray(points[chain[::-1]])

    def _straight_costs(self, start: Array, ends: Array) -> Array:
        """Return the costs (m,) of straight pieces from a point to others (m, 2); inf through occupied cells."""
        lengths = np.linalg.norm(ends - start, axis=1)
        count = max(2, math.ceil(float(lengths.max()) / (self._grid.resolution / 2.0)))
        share = np.linspace(0.0, 1.0, count)
        costs = np.full(len(ends), math.inf)
        # Most pieces run through occupied cells, which a few samples show.
        clear = np.arange(len(ends))
        for every in (16, 4):
            clear = clear[np.isfinite(self._prices_along(start, ends[clear], share[::every])).all(axis=1)]
        costs[clear] = lengths[clear] * self._prices_along(start, ends[clear], share).mean(axis=1)
        return costs

    def _prices_along(self, start: Array, ends: Array, share: Array) -> Array:
        """Return the prices (m, s) at shares (s,) of the straight pieces from a point to others (m, 2)."""
        ny, nx = self._grid.shape
        cells = []
        for axis, most in ((0, nx - 1), (1, ny - 1)):
            places = start[axis] + share * (ends[:, axis] - start[axis])[:, None]
            index = np.floor((places - self._grid.origin[axis]) / self._grid.resolution).astype(np.intp)
            cells.append(np.minimum(np.maximum(index, 0), most))
        return np.asarray(self._prices[cells[1], cells[0]])


def clearance_field(grid: OccupancyGrid) -> Array:
    """Return the distance from each cell's center to the side of the nearest occupied cell, (ny, nx) meters.

    The exact Euclidean distance transform less half a cell: exact along the axes, up to a fifth of a cell too long
    along diagonals.
    """
    walled = np.pad(~grid.occupied, 1).astype(np.uint8)
    cells = cv2.distanceTransform(walled, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)[1:-1, 1:-1]
    return np.maximum(np.asarray(cells, dtype=np.float64) - 0.5, 0.0) * grid.resolution
