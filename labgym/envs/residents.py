"""Prepared layouts that stay in memory although no environment uses them at the moment."""

from __future__ import annotations

from threading import Lock
from typing import Protocol

from labgym.counts import is_real
from labgym.errors import OptionError

RESIDENT_MB = 512.0
"""Default budget of a process for prepared layouts that it will use again, megabytes."""


class Sized(Protocol):
    """An object whose size in memory may grow."""

    @property
    def nbytes(self) -> int:
        """Size, bytes."""
        ...


class Residents:
    """The objects used last, up to a budget; the one used last stays in any case."""

    def __init__(self) -> None:
        self._objects: dict[Sized, None] = {}
        self._lock = Lock()

    def __len__(self) -> int:
        return len(self._objects)

    @property
    def nbytes(self) -> int:
        """Size of all objects, bytes."""
        return sum(one.nbytes for one in self._objects)

    def keep(self, value: Sized, megabytes: float) -> None:
        """Keep an object as the one used last, and forget those used longest ago beyond the budget in megabytes."""
        with self._lock:
            self._objects.pop(value, None)
            self._objects[value] = None
            excess = self.nbytes - megabytes * 1e6
            for one in list(self._objects)[:-1]:
                if excess <= 0.0:
                    break
                excess -= one.nbytes
                del self._objects[one]

    def clear(self) -> None:
        """Forget all objects."""
        with self._lock:
            self._objects.clear()


def check_budget(megabytes: float) -> None:
    """Check a budget.

    Raises:
        OptionError: it is not a number of at least 0.
    """
    if not is_real(megabytes) or megabytes < 0.0:
        raise OptionError(f"resident_mb is {megabytes!r}, expected a number of megabytes of at least 0")
