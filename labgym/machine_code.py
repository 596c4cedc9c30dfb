"""Compilation of numerical functions by numba, which the extra `fast` installs; without fast math.

Without numba the functions stay as they are: the same results, later. numba is imported with the first module of such
functions, so that these are imported where they are needed.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

Function = TypeVar("Function", bound=Callable[..., Any])
numba: Any
try:
    import numba
except ImportError:
    numba = None


def inner(function: Function) -> Function:
    """Compile a function that compiled functions of the same file call."""
    return function if numba is None else cast(Function, numba.njit(nogil=True)(function))


def inlined(function: Function) -> Function:
    """Compile a function into each function that calls it, instead of a call of many arguments."""
    return function if numba is None else cast(Function, numba.njit(nogil=True, forceinline=True)(function))


def entry(function: Function) -> Function:
    """Compile a function that the interpreter calls, and keep the machine code on disk where that is possible.

    numba renews the code when the function's own file changes: whatever it calls or contains must be in that file.
    """
    if numba is None:
        return function
    try:
        return cast(Function, numba.njit(nogil=True, cache=True)(function))
    except RuntimeError:  # no folder can be written
        return inner(function)
