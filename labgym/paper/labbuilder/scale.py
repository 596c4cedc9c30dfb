"""Files whose lengths are in another unit than meters, recognized by the size of their numbers."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from pydantic import ValidationError

from labgym.counts import is_real
from labgym.documents import document_error
from labgym.errors import DocumentError

LONGEST = 100.0
"""Longest side of a room and greatest coordinate, meters."""
UNITS = ((2000.0, "millimeters", 1000), (LONGEST, "centimeters", 100))
"""Largest length from which numbers look like a unit, its name, and how many make a meter."""
ANGLES = ("rotation",)
"""Fields whose numbers are no lengths."""


def scaled_error(path: object, error: ValidationError, data: Any) -> DocumentError:
    """Return the error of an invalid file, with a hint at the unit if its lengths are too large for meters.

    Args:
        data: the content of the file.
    """
    named = document_error(path, error)
    first = error.errors(include_url=False)[0]
    out_of_range = first["type"] in ("less_than_equal", "less_than", "greater_than_equal")
    largest = max((abs(value) for value in _lengths(data) if math.isfinite(value)), default=0.0)
    unit = next(((name, count) for least, name, count in UNITS if largest > least), None)
    if not out_of_range or unit is None or set(first["loc"]) & set(ANGLES):
        return named
    name, count = unit
    problem = str(named).removeprefix(f"{path}: field {named.field}: ")
    hint = f"lengths are meters, and up to {largest:g} looks like {name}: divide all lengths by {count}"
    return DocumentError(path, named.field, f"{problem}; {hint}")


def _lengths(data: Any) -> Iterator[float]:
    """Yield all numbers of a file but its angles."""
    if isinstance(data, dict | list):
        for name, each in data.items() if isinstance(data, dict) else enumerate(data):
            if name not in ANGLES:
                yield from _lengths(each)
    elif is_real(data):
        yield float(data)
