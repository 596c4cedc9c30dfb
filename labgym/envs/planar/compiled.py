"""Compilation of the planar kernel by numba: in double precision, without the interpreter lock, cached on disk.

No function is compiled with fast math: sums keep their order, so that one robot and many give the same bits.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labgym.artefacts import user_cache
from labgym.errors import optional_package

with optional_package("numba", "the planar kernel (physics='planar')", "fast"):
    import numba
    from numba.core import cgutils
    from numba.extending import intrinsic

    from labgym import machine_code
    from labgym.machine_code import Function

CONSTANTS = ("robot.py", "sensors.py", "simulation.py", "conditions/passing.py", "conditions/cast.py")
"""Files whose constants and functions the compiled functions contain."""

inlined = machine_code.inlined
compiled = machine_code.inner
"""Compiles a function when it is first called; other compiled functions may call it."""


def entry(function: Function) -> Function:
    """Compile a function that the interpreter calls, and keep the machine code on disk.

    numba renews the code of a function when its own file changes, not when the files of the functions that it calls
    do. So the folder of the cache is named by the contents of all files of the kernel. Where no folder can be written,
    every process compiles.
    """
    settings: Any = numba.config
    directory = settings.CACHE_DIR
    settings.CACHE_DIR = directory or str(_folder())
    try:
        return machine_code.entry(function)
    finally:
        settings.CACHE_DIR = directory


def _pointer(_: Any, address: Any) -> Any:
    """Return the type and the code of `pointer`."""

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:  # noqa: ARG001
        return builder.inttoptr(arguments[0], cgutils.voidptr_t)

    return numba.types.voidptr(address), code


pointer: Any = intrinsic(_pointer)
"""In compiled functions: an address, an int64, as a pointer. Who takes the address keeps the array alive."""
carray: Any = getattr(numba, "carray")  # noqa: B009 -- numba does not declare it
"""In compiled functions: the array of a shape and type at a pointer."""


@cache
def _folder() -> Path:
    """Return the folder of the cache for these sources."""
    digest = hashlib.sha256()
    folder = Path(__file__).parent
    others = (*(folder.parent / name for name in CONSTANTS), Path(machine_code.__file__))
    for path in (*sorted(folder.glob("*.py")), *others):
        digest.update(path.name.encode() + b"\0" + path.read_bytes())
    return user_cache() / f"planar-{digest.hexdigest()[:16]}"


Array = NDArray[np.float64]
Index = NDArray[np.int64]


def row_of(arrays: Sequence[NDArray[Any]]) -> list[int]:
    """Return the address and the size of each array. Who uses the row keeps the arrays alive."""
    return [number for array in arrays for number in (array.__array_interface__["data"][0], array.size)]


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
