"""One step of the dynamic program of `SpaceTime` compiled by numba, which the extra `fast` installs.

It takes the least of the same numbers, so that the bits are the same; the tests compare them.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from labgym.machine_code import entry, inner

Costs = NDArray[np.float32]


@inner
def _lower(row: Costs, other: Costs) -> None:
    """Take over the costs of another row that are less."""
    for k in range(len(row)):
        row[k] = other[k] if other[k] < row[k] else row[k]


@entry
def before(
    waited: Costs, entered: Costs, moves: NDArray[np.int64], inside: NDArray[np.bool_], free: NDArray[np.bool_]
) -> Costs:
    """Return the values one move earlier, as `SpaceTime._before`.

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
                _lower(values[row, first:last], entered[row + dy, first + dx : last + dx])
        for column in range(width):
            if not free[row, column]:
                values[row, column] = np.inf
            elif inside[row, column]:
                values[row, column] = 0.0
    return values
