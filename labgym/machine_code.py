"""Compilation of numerical functions by numba, which the extra `fast` installs; without fast math.

Without numba the functions stay as they are: the same results, later. numba is imported with the first module of such
functions, so that these are imported where they are needed.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from typing import Any, TypeVar, cast

Function = TypeVar("Function", bound=Callable[..., Any])
numba: Any
Cache: Any
try:
    import numba
    from numba.core.caching import FunctionCache as Cache
except ImportError:
    numba, Cache = None, object


class MachineCode(Cache):  # type: ignore[misc]
    """The machine code of a function on disk. What cannot be read or written there is compiled again.

    numba's index names classes of arguments, and does not load once an update of labgym has removed one. A policy in
    its box, or the user of an installed labgym, may not write it.
    """

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the code for a signature, None without one."""
        try:
            return super().load_overload(sig, target_context)
        except Exception:  # noqa: BLE001 - unpickling raises any
            with contextlib.suppress(OSError):
                self.flush()
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Write the code for a signature, if that is possible."""
        with contextlib.suppress(Exception):
            super().save_overload(sig, data)


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
    compiled: Any = inner(function)
    if hasattr(compiled, "enable_caching"):
        with contextlib.suppress(RuntimeError):  # no folder can be written
            compiled._cache = MachineCode(function)
    return cast(Function, compiled)
