"""One step of the dynamic program of `SpaceTime`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from labgym.machine_code import entry

Costs = NDArray[np.float32]


@entry
def earlier_values(
    waited: Costs, entered: Costs, moves: NDArray[np.int64], inside: NDArray[np.bool_], free: NDArray[np.bool_]
) -> Costs:
    """Return the values one move earlier: the least cost of waiting in a cell and of every move out of it, seconds.

    Args:
        waited, entered: (rows, columns) costs of waiting in a cell, and of moving into it, and going on, seconds.
        moves: (m, 2) rows and columns of each move. inside: cells in which a way ends. free: cells that can be entered.
    """
    height, width = waited.shape
    values = waited.copy()
    for row in range(height):
        for k in range(len(moves)):
            dy, dx = moves[k, 0], moves[k, 1]
            if 0 <= row + dy < height:
                first, last = max(-dx, 0), width - max(dx, 0)
                moved = entered[row + dy, first + dx : last + dx]
                values[row, first:last] = np.minimum(values[row, first:last], moved)
        for column in range(width):
            if not free[row, column]:
                values[row, column] = np.inf
            elif inside[row, column]:
                values[row, column] = 0.0
    return values
