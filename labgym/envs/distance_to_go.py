"""The remaining driving distance as a field over the floor."""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from labgym.navigation import LengthsTo, OccupancyGrid, ShortestPaths, distance_field


class DistanceToGo(Protocol):
    """The remaining driving distance to a goal, finite everywhere."""

    @property
    def reachable(self) -> bool:
        """Whether a path to the goal exists from anywhere; without one, distances are straight."""
        ...

    def at(self, x: float, y: float) -> float:
        """Return the remaining driving distance from a point, meters."""
        ...


class GridDistanceToGo:
    """Length of the shortest grid path to a goal from anywhere on the floor, interpolated between cells (version 1).

    The grid is 8-connected, so the length exceeds that of the shortest any-angle path by up to 8%. For a cell without a
    path (too close to an obstacle, or cut off) it is the length from the nearest cell that has one plus the distance to
    that cell. If no cell has a path, it is the straight distance to the goal.

    Args:
        grid: the occupancy grid dilated by the planning radius.
        goal: x and y in meters; further components are ignored.
    """

    def __init__(self, grid: OccupancyGrid, goal: tuple[float, ...]) -> None:
        from scipy.ndimage import distance_transform_edt

        self._goal = (goal[0], goal[1])
        self._origin, self._resolution = grid.origin, grid.resolution
        field = distance_field(grid, self._goal)
        reached = np.isfinite(field)
        self.reachable = bool(reached.any())
        if self.reachable:
            away, nearest = distance_transform_edt(~reached, return_indices=True)
            field = field[tuple(nearest)] + grid.resolution * away
        self._field = field

    @property
    def field(self) -> tuple[NDArray[np.float64], tuple[float, float, float]] | None:
        """Lengths at the centers of cells (rows, columns) and the grid's x, y and resolution; None without any path."""
        if not self.reachable:
            return None
        return np.ascontiguousarray(self._field, dtype=np.float64), (*self._origin, self._resolution)

    def at(self, x: float, y: float) -> float:
        """Return the remaining driving distance from a point of the floor, meters."""
        if not self.reachable:
            return math.dist((x, y), self._goal)
        rows, columns = self._field.shape
        u = min(max((x - self._origin[0]) / self._resolution - 0.5, 0.0), columns - 1.001)
        v = min(max((y - self._origin[1]) / self._resolution - 0.5, 0.0), rows - 1.001)
        column, row = int(u), int(v)
        u, v = u - column, v - row
        (a, b), (c, d) = self._field[row : row + 2, column : column + 2].tolist()
        return float((1.0 - v) * ((1.0 - u) * a + u * b) + v * ((1.0 - u) * c + u * d))


class ExactDistanceToGo:
    """Length of the shortest any-angle path to a goal from anywhere on the floor (version 2).

    From a point that is too close to an obstacle it is the distance to the nearest point that is not, plus the length
    from there; `LengthsTo.at` defines it for regions that are cut off. If the goal itself is too close to an obstacle,
    it is the straight distance.

    Args:
        paths: shortest paths for a disc of the planning radius.
        goal: x and y in meters; further components are ignored.

    Attributes:
        lengths: the lengths of the paths.
    """

    def __init__(self, paths: ShortestPaths, goal: tuple[float, ...]) -> None:
        self._goal = (goal[0], goal[1])
        self.lengths = LengthsTo(paths, self._goal)

    @property
    def reachable(self) -> bool:
        """Whether the disc fits at the goal."""
        return self.lengths.reachable

    def at(self, x: float, y: float) -> float:
        """Return the remaining driving distance from a point of the floor, meters."""
        return self.lengths.at(x, y) if self.reachable else math.dist((x, y), self._goal)

    @property
    def nbytes(self) -> int:
        """Size of the arrays of this goal, without the shortest paths, bytes."""
        return self.lengths.nbytes
