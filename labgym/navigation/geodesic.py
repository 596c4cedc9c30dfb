"""Costs of cheapest paths over a grid, of any direction: the eikonal equation by fast sweeping."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Bool = NDArray[np.bool_]

FAR = 1e9
"""Value of a cell that nothing has reached yet. Its differences are finite, those of inf are not."""

TOLERANCE = 1e-4
"""Sweeps end when no value falls by more than this."""


def geodesic_fields(costs: Array, starts: Array, resolution: float) -> Array:
    """Return the cost of the cheapest path from every cell to the start cells: its length where all cells cost 1.

    Unlike `distance_field`, which takes eight directions and overstates lengths by up to 8%, paths may have any
    direction: |grad V| = cost with the upwind differences of Godunov, solved by sweeps in four directions (Zhao, A
    fast sweeping method for eikonal equations, 2005). The error is of first order, a few hundredths of a meter over
    ten meters of cells of 5 cm. Paths do not pass between two closed cells that touch at a corner.

    Args:
        costs: (ny, nx), cost per meter through each cell, above 0; inf where the robot does not fit.
        starts: (k, ny, nx), costs that are known, for k fields; inf elsewhere. Those of closed cells do not count.
        resolution: side of a cell, meters.

    Returns:
        (k, ny, nx); inf for closed cells and for those without a path.
    """
    ny, nx = costs.shape
    free = np.isfinite(costs)
    known = np.pad(np.where(free, starts, np.inf), ((0, 0), (1, 1), (1, 1)), constant_values=np.inf)
    values = np.minimum(known.reshape(len(starts), -1).T, FAR)
    width = nx + 2
    steps = resolution * np.pad(costs, 1, constant_values=np.inf).ravel()
    sweeps = _sweeps(np.pad(free, 1).ravel(), width)
    change = np.inf
    while change > TOLERANCE:
        before = values.copy()
        for sweep in sweeps:
            for cells in sweep:
                _lower(values, cells, width, steps[cells, None])
        change = float((before - values).max(initial=0.0))
    fields = values.T.reshape(len(starts), ny + 2, width)[:, 1:-1, 1:-1]
    return np.where(fields < FAR, fields, np.inf)


def _lower(values: Array, cells: NDArray[np.intp], width: int, steps: Array) -> None:
    """Lower the values of cells (n,), no two of which are neighbors, to what their neighbors allow.

    Args:
        values: (m, k), of all cells and fields.
        cells: numbers of the cells.
        width: of the grid.
        steps: (n, 1), cost of a step through each cell.
    """
    across = np.minimum(values[cells - 1], values[cells + 1])
    along = np.minimum(values[cells - width], values[cells + width])
    gap = np.minimum(np.abs(across - along), steps)
    reached = np.minimum(across, along) + 0.5 * (gap + np.sqrt(2.0 * steps**2 - gap**2))
    values[cells] = np.minimum(values[cells], reached)


def _sweeps(inside: Bool, width: int) -> tuple[list[NDArray[np.intp]], ...]:
    """Return four sweeps over the free cells of a flat grid, each a list of diagonals in the order of the sweep."""
    cells = np.flatnonzero(inside)
    rows, columns = np.divmod(cells, width)
    falling, rising = (_by(cells, key) for key in (rows + columns, rows - columns))
    return falling, rising, falling[::-1], rising[::-1]


def _by(cells: NDArray[np.intp], key: NDArray[np.intp]) -> list[NDArray[np.intp]]:
    """Return cells in groups of one key, in ascending order of the keys."""
    order = np.argsort(key, kind="stable")
    return np.split(cells[order], np.flatnonzero(np.diff(key[order])) + 1)
