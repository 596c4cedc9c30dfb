"""Numbers and switches that users pass, and the memory that counts require.

Python's truth values are integers; here they are no numbers. Documents are validated by pydantic instead.
"""

from __future__ import annotations

import math
import os
import resource
import sys
from pathlib import Path
from typing import TypeGuard

import numpy as np

from labgym.errors import OptionError

MAX_COUNT = 10_000_000
"""Largest number of layouts, episodes, rounds or repeats."""
MAX_SEED = 2**53 - 1
"""Largest random seed: integers up to it are exact in JSON."""
MAX_STEPS = 10**12
"""Largest number of control steps of a training, summed over its environments."""
MAX_PROCESSES = 1024
"""Largest number of worker processes, threads, or jobs at a time."""
ENVIRONMENT_KB = 12
"""Memory of an environment of the planar kernel without observation and layouts, kilobytes, as measured."""
SINGLE_MB = 0.5
"""Memory of a single environment without pictures and layouts, megabytes, as measured."""
PROCESS_MB = 150
"""Memory of a worker process without its layouts, megabytes."""


def is_whole(value: object) -> TypeGuard[int]:
    """Return whether a value is a whole number of Python or NumPy."""
    return isinstance(value, int | np.integer) and not isinstance(value, bool)


def is_real(value: object) -> TypeGuard[float]:
    """Return whether a value is a real number of Python, possibly infinite; NaN is none."""
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= math.inf


def is_finite(value: object) -> TypeGuard[float]:
    """Return whether a value is a real number of Python that a float holds."""
    return is_real(value) and abs(value) <= sys.float_info.max


def check_switch(name: str, value: object) -> None:
    """Check that a value is a truth value.

    Raises:
        OptionError: it is something else.
    """
    if not isinstance(value, bool):
        raise OptionError(f"{name} is {repr(value)[:40]}, expected True or False")


def whole_number(name: str, value: object, least: int = 1, most: int = MAX_COUNT) -> int:
    """Return a whole number of a range.

    Raises:
        OptionError: it is something else.
    """
    if not is_whole(value) or not least <= value <= most:
        raise OptionError(f"{name} is {repr(value)[:40]}, expected a whole number from {least} to {most}")
    return int(value)


def check_memory(name: str, count: int, bytes_each: float) -> None:
    """Check that as many things as a count says fit into the memory of this machine.

    Raises:
        OptionError: they do not fit; names the count, the memory that it requires and the largest count.
    """
    available = physical_memory()
    if count * bytes_each > available:
        raise OptionError(
            f"{name} is {count}: it requires about {count * bytes_each / 1e9:.3g} GB of memory, and this machine has "
            f"{available / 1e9:.3g} GB; at most {int(available / bytes_each)} fit"
        )


def check_address_space(purpose: str, required_bytes: float) -> None:
    """Check that the limit of the address space (`ulimit -v`) leaves room for a library that crashes without memory.

    Raises:
        MemoryError: it does not; names the memory that is required and that is left.
    """
    limit = resource.getrlimit(resource.RLIMIT_AS)[0]
    statistics = Path("/proc/self/statm")
    if limit == resource.RLIM_INFINITY or not statistics.exists():
        return
    left = limit - int(statistics.read_text().split()[0]) * resource.getpagesize()
    if left < required_bytes:
        raise MemoryError(
            f"{purpose} requires about {required_bytes / 1e6:.0f} MB of address space, and {max(left, 0) / 1e6:.0f} MB "
            "are left: raise the limit (ulimit -v)"
        )


def physical_memory() -> int:
    """Return the memory of this machine, bytes."""
    return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
