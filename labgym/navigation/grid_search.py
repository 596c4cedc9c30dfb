"""Shortest paths over the free cells of a grid: 8-connected, without corner cutting."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix, csr_matrix
from scipy.sparse.csgraph import dijkstra

from labgym.errors import OptionError
from labgym.navigation.occupancy import OccupancyGrid

Point = tuple[float, float]
DIAGONAL = math.sqrt(2.0)


def astar(
    grid: OccupancyGrid,
    start: Point,
    goal: Point,
    costs: NDArray[np.float64] | None = None,
) -> NDArray[np.float64] | None:
    """Return a shortest path between the cells of two points, or None if no path exists.

    A* with the octile distance. A diagonal step requires that both adjacent cells are free. Ties are broken by the cell
    number: the same input gives the same path.

    Args:
        grid: the grid dilated by the robot's radius.
        start: (x, y), meters.
        goal: (x, y), meters.
        costs: (ny, nx), cost per meter through each cell, at least 1; a step costs its length times the mean of its two
            cells. None stands for 1 everywhere.

    Returns:
        (n, 2) room coordinates of the cell centers from start to goal, both included (n = 1 if it is the same cell).

    Raises:
        OptionError: the shape of the costs differs from the grid's, or a cost is below 1 or NaN.
    """
    from labgym.navigation.search_kernel import search  # takes some tenths of a second, with numba

    if costs is not None and (costs.shape != grid.shape or not bool((costs >= 1.0).all())):
        raise OptionError(f"costs of shape {costs.shape} must have the grid's shape {grid.shape} and be at least 1")
    if not grid.connected(start, goal):
        return None
    width = grid.shape[1] + 2
    blocked = np.pad(grid.occupied, 1, constant_values=True).ravel()
    (r0, c0), (r1, c1) = grid.cell_of(*start), grid.cell_of(*goal)
    source, target = (r0 + 1) * width + c0 + 1, (r1 + 1) * width + c1 + 1
    prices = np.pad(np.ones(grid.shape) if costs is None else costs, 1, constant_values=1.0).ravel()
    predecessors = search(blocked, prices, width, source, target)
    cells = followed(predecessors, target, source)
    assert cells is not None  # They are connected.
    rows, columns = np.divmod(np.array(cells[::-1]), width)
    xs, ys = grid.centres()
    return np.column_stack([xs[columns - 1], ys[rows - 1]])


def followed(onward: NDArray[np.integer[Any]], start: int, end: int) -> list[int] | None:
    """Return the cells from a start to an end, both included; None if the way breaks off.

    Args:
        onward: number of the next cell of each cell; negative: the way ends there.
    """
    cells = [start]
    while cells[-1] != end:
        cells.append(int(onward[cells[-1]]))
        if cells[-1] < 0:
            return None
    return cells


def distance_field(grid: OccupancyGrid, *sources: Point) -> NDArray[np.float64]:
    """Return the length of the shortest grid path from every cell to the nearest source, with the moves of `astar`.

    Args:
        grid: dilated by the robot's radius.
        sources: points (x, y), meters; those that are not free are left out.

    Returns:
        (ny, nx) meters; inf for cells without a path, and everywhere if no source is free.
    """
    cells = [grid.cell_of(*source) for source in sources if grid.free(*source)]
    if not cells:
        return np.full(grid.shape, np.inf)
    numbers = [row * grid.shape[1] + column for row, column in cells]
    field = dijkstra(grid_graph(grid), directed=False, indices=numbers, min_only=True)
    return np.asarray(field.reshape(grid.shape))


def grid_graph(grid: OccupancyGrid, costs: NDArray[np.float64] | None = None) -> csr_matrix:
    """Return the sparse graph of the moves that `astar` allows, each once, weighted by length times mean cost.

    Args:
        grid: dilated by the robot's radius.
        costs: (ny, nx), cost per meter through each cell; None is 1 everywhere.

    Returns:
        (ny * nx, ny * nx); cells are numbered row by row.
    """
    free = ~grid.occupied
    ny, nx = grid.shape
    number = np.arange(ny * nx).reshape(ny, nx)
    prices = np.ones(grid.shape) if costs is None else costs
    right, up = free[:, :-1] & free[:, 1:], free[:-1] & free[1:]
    block = free[:-1, :-1] & free[:-1, 1:] & free[1:, :-1] & free[1:, 1:]
    sources, targets, weights = [], [], []
    for a, b, allowed, length in (
        (np.s_[:, :-1], np.s_[:, 1:], right, 1.0),
        (np.s_[:-1], np.s_[1:], up, 1.0),
        (np.s_[:-1, :-1], np.s_[1:, 1:], block, DIAGONAL),
        (np.s_[:-1, 1:], np.s_[1:, :-1], block, DIAGONAL),
    ):
        sources.append(number[a][allowed])
        targets.append(number[b][allowed])
        weights.append(length * grid.resolution * ((prices[a] + prices[b])[allowed] / 2.0))
    indices = np.concatenate(sources), np.concatenate(targets)
    return coo_matrix((np.concatenate(weights), indices), shape=(ny * nx, ny * nx)).tocsr()
