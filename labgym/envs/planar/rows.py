"""Arrays of different sizes for each robot, as one row of addresses and sizes, which compiled functions read."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labgym.envs.planar.compiled import carray, compiled, pointer

Array = NDArray[np.float64]
Index = NDArray[np.int64]


def row_of(arrays: Sequence[NDArray[Any]]) -> list[int]:
    """Return the address and the size of each array. Who uses the row keeps the arrays alive."""
    return [number for array in arrays for number in (array.ctypes.data, array.size)]


@compiled
def floats(row: Index, place: int) -> Array:
    """Return array number `place` of a row, (n,)."""
    array: Array = carray(pointer(row[2 * place]), (row[2 * place + 1],), np.float64)
    return array


@compiled
def points(row: Index, place: int) -> Array:
    """Return array number `place` of a row, (n, 2)."""
    array: Array = carray(pointer(row[2 * place]), (row[2 * place + 1] // 2, 2), np.float64)
    return array


@compiled
def integers(row: Index, place: int) -> Index:
    """Return array number `place` of a row, (n,)."""
    array: Index = carray(pointer(row[2 * place]), (row[2 * place + 1],), np.int64)
    return array
