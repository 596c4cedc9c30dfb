"""How far the robot still has to drive: a field over the floor, looked up at every step."""

from __future__ import annotations

import math

import numpy as np
from scipy.ndimage import distance_transform_edt

from labgym.navigation import OccupancyGrid, distance_field


class DistanceToGo:
    """Length of the shortest grid path to a goal from anywhere in the room, interpolated between cells.

    On a grid with eight neighbours, so that it is up to 8% longer than the shortest any-angle path. Where no path
    leads to the goal (too close to an obstacle, or cut off) it is that of the nearest cell that has one, and the
    straight way there; where no cell has one, the straight distance to the goal.

    Args:
        grid: the occupancy grid dilated by the planning radius.
        goal: x and y in metres; what follows is ignored.
    """

    def __init__(self, grid: OccupancyGrid, goal: tuple[float, ...]) -> None:
        self._goal = (goal[0], goal[1])
        self._origin, self._resolution = grid.origin, grid.resolution
        field = distance_field(grid, self._goal)
        reached = np.isfinite(field)
        self.reachable = bool(reached.any())
        if self.reachable:
            away, nearest = distance_transform_edt(~reached, return_indices=True)
            field = field[tuple(nearest)] + grid.resolution * away
        self._field = field

    def at(self, x: float, y: float) -> float:
        """Return metres to drive from a point of the room."""
        if not self.reachable:
            return math.dist((x, y), self._goal)
        rows, columns = self._field.shape
        u = min(max((x - self._origin[0]) / self._resolution - 0.5, 0.0), columns - 1.001)
        v = min(max((y - self._origin[1]) / self._resolution - 0.5, 0.0), rows - 1.001)
        column, row = int(u), int(v)
        u, v = u - column, v - row
        (a, b), (c, d) = self._field[row : row + 2, column : column + 2].tolist()
        return float((1.0 - v) * ((1.0 - u) * a + u * b) + v * ((1.0 - u) * c + u * d))
