"""Distances to the nearest barrier of a floor, interpolated, with their gradient."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from labgym.navigation import FloorPlan
from labgym.navigation.barriers import Barriers
from labgym.navigation.clearance import Obstacles

Array = NDArray[np.float64]

NODE = 0.05
"""Distance between the nodes, meters."""
FAR = 2.0
"""Distances greater than this count as this, meters."""
TILE = 32
"""Number of rows and columns of nodes that are computed at a time, with the obstacles within reach alone."""


class ClearanceField:
    """Distances from points of a floor to its nearest barrier, up to 2 m; bilinear between nodes 5 cm apart.

    Args:
        plan: the floor.

    Attributes:
        barriers: of the floor. low: (2,) corner of the field, meters. values: (rows, columns) of y and x, meters.
    """

    def __init__(self, plan: FloorPlan) -> None:
        self.barriers = Barriers.of(plan)
        self.low = self.barriers.low - NODE
        columns, rows = (np.ceil((self.barriers.high - self.low) / NODE).astype(int) + 2).tolist()
        x, y = self.low[0] + NODE * np.arange(columns), self.low[1] + NODE * np.arange(rows)
        self.values: Array = np.empty((rows, columns))
        for row in range(0, rows, TILE):
            for column in range(0, columns, TILE):
                part = slice(row, row + TILE), slice(column, column + TILE)
                self.values[part] = self._distances(x[part[1]], y[part[0]])

    def _distances(self, x: Array, y: Array) -> Array:
        """Return the distances at the nodes of a tile, (rows, columns) meters, from its x and y."""
        nodes = np.column_stack([np.tile(x, len(y)), np.repeat(y, len(x))])
        reach, obstacles = FAR + NODE, self.barriers.obstacles
        _, near = obstacles.near(nodes[:1] - reach, nodes[-1:] + reach)
        within = replace(self.barriers, obstacles=Obstacles(obstacles.sources[k] for k in near.tolist()))
        return np.minimum(within.clearance(nodes), FAR).reshape(len(y), len(x))

    def at(self, points: Array) -> tuple[Array, Array]:
        """Return the distances at points (n, 2), (n,) meters, and their gradients, (n, 2)."""
        rows, columns = self.values.shape
        place = (points - self.low) / NODE
        x, y = np.clip(place[:, 0], 0.0, columns - 1.001), np.clip(place[:, 1], 0.0, rows - 1.001)
        column, row = x.astype(int), y.astype(int)
        u, v = x - column, y - row
        a, b = self.values[row, column], self.values[row, column + 1]
        c, d = self.values[row + 1, column], self.values[row + 1, column + 1]
        below, above = a + (b - a) * u, c + (d - c) * u
        slope = np.column_stack([(b - a) * (1.0 - v) + (d - c) * v, above - below]) / NODE
        return below + (above - below) * v, slope
