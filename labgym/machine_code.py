"""Compilation of single files of functions by numba, which the extra `fast` installs; without fast math.

Only modules of compiled functions import this one, and they are imported where numba may be missing.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba

Function = TypeVar("Function", bound=Callable[..., Any])


def inner(function: Function) -> Function:
    """Compile a function that compiled functions of the same file call."""
    return cast(Function, numba.njit(nogil=True)(function))


def entry(function: Function) -> Function:
    """Compile a function that the interpreter calls, and keep the machine code on disk where that is possible.

    numba renews the code when the function's own file changes: whatever it calls or contains must be in that file.
    """
    try:
        return cast(Function, numba.njit(nogil=True, cache=True)(function))
    except RuntimeError:  # no folder can be written
        return inner(function)
