"""Observations in memory that processes share, so that images pass no pipe."""

from __future__ import annotations

import mmap
import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from gymnasium import spaces
from gymnasium.vector.utils import create_empty_array
from numpy.typing import NDArray

from labgym.envs.parcels import SHARED

ALIGNMENT = 64
"""Each array begins at a multiple of this, bytes."""


@dataclass(frozen=True)
class BoardAddress:
    """Where another process finds a board: an open file of the process that made it."""

    process: int
    descriptor: int

    def open(self, space: spaces.Space[Any], rows: int) -> Board:
        """Return the board in this process.

        Raises:
            OSError: the process that made it has closed it.
        """
        return Board(os.open(f"/proc/{self.process}/fd/{self.descriptor}", os.O_RDWR | os.O_CLOEXEC), space, rows)


class Board:
    """One row of each array of an observation for each environment, in an anonymous file in memory.

    Args:
        descriptor: the open file, which the board closes in the end.
        space: of a single observation. rows: number of environments.
    """

    def __init__(self, descriptor: int, space: spaces.Space[Any], rows: int) -> None:
        self._descriptor = descriptor
        empty: Any = create_empty_array(space, rows)
        size = sum(_padded(array.nbytes) for array in _arrays(empty))
        os.truncate(descriptor, size)
        memory = mmap.mmap(descriptor, max(size, 1))
        place = 0

        def view(array: NDArray[Any]) -> NDArray[Any]:
            nonlocal place
            begin, place = place, place + _padded(array.nbytes)
            return np.frombuffer(memory, array.dtype, array.size, begin).reshape(array.shape)

        self._views: Any = _mapped(view, empty)

    def __del__(self) -> None:
        self.close()

    @property
    def address(self) -> BoardAddress:
        """Where other processes find the board while it is open here."""
        return BoardAddress(os.getpid(), self._descriptor)

    def write(self, first: int, observations: Any) -> None:
        """Write the rows from `first` on."""

        def copy(view: NDArray[Any], array: NDArray[Any]) -> None:
            view[first : first + len(array)] = array

        _mapped(copy, self._views, observations)

    def read(self) -> Any:
        """Return copies of all arrays."""
        return _mapped(np.copy, self._views)

    def close(self) -> None:
        """Close the file here; it is safe to call this more than once, and rows can still be read."""
        descriptor, self._descriptor = self._descriptor, -1
        if descriptor >= 0:
            os.close(descriptor)


def shared_board(space: spaces.Space[Any], rows: int) -> Board | None:
    """Return a new board; None where processes cannot share memory, or if an observation is more than arrays."""
    if not SHARED or not all(isinstance(each, np.ndarray) for each in _arrays(create_empty_array(space, 1))):
        return None
    return Board(os.memfd_create("labgym", os.MFD_CLOEXEC), space, rows)


def _padded(size: int) -> int:
    return size + -size % ALIGNMENT


def _arrays(tree: Any) -> Iterator[Any]:
    """Yield the leaves of a tree of dicts."""
    if isinstance(tree, dict):
        for each in tree.values():
            yield from _arrays(each)
    else:
        yield tree


def _mapped(function: Callable[..., Any], tree: Any, *others: Any) -> Any:
    """Return a tree of dicts with a function applied to each leaf, and to those of other trees of the same keys."""
    if isinstance(tree, dict):
        return {name: _mapped(function, each, *(other[name] for other in others)) for name, each in tree.items()}
    return function(tree, *others)
