"""Checks of the arguments of parts."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import fields, replace
from typing import Any, TypeVar, cast

from labgym.counts import is_finite, whole_number
from labgym.errors import OptionError, check_name

Record = TypeVar("Record")
"""A dataclass of numbers."""

MAX_CELLS = 4096
"""Largest number of cells along a side of a map."""
MAX_METERS = 1e6
"""Largest reach and height of a sensor, meters; their squares fit into a float32."""


def positive(part: Any, *names: str, zero: bool = False, most: float = math.inf) -> None:
    """Check that fields are finite numbers above 0, or at least 0 if `zero`, and at most `most`.

    Raises:
        OptionError: one is not.
    """
    for name in names:
        value = getattr(part, name)
        if not is_finite(value) or not 0 <= value <= most or (value == 0 and not zero):
            least = ("at least 0" if zero else "above 0") + (f" and at most {most:g}" if most < math.inf else "")
            raise OptionError(f"{type(part).__name__}: {name} is {str(value)[:40]!r}, expected a number {least}")


def finite(part: Any, *names: str) -> None:
    """Check that fields are finite numbers.

    Raises:
        OptionError: one is not.
    """
    for name in names:
        value = getattr(part, name)
        if not is_finite(value):
            raise OptionError(f"{type(part).__name__}: {name} is {str(value)[:40]!r}, expected a finite number")


MAX_READINGS = 16_777_216
"""Largest number of values of one reading of a sensor: a picture of 4096 x 4096 pixels."""


def count(part: Any, *names: str, most: int = MAX_READINGS) -> None:
    """Check that fields are whole numbers of at least 1, and that their product is not above `most`.

    Raises:
        OptionError: one is not, or the product is.
    """
    numbers = [whole_number(f"{type(part).__name__}: {name}", getattr(part, name), 1, most) for name in names]
    if math.prod(numbers) > most:
        product = " x ".join(names)
        raise OptionError(f"{type(part).__name__}: {product} is {math.prod(numbers)}, expected at most {most}")


def record_of(value: Any, default: Record, name: str, entry: str) -> Record:
    """Return a record of numbers that was passed as an object, or as a mapping of the entries that differ.

    Args:
        default: has the other entries.
        name, entry: of the record and of one entry, in error messages.

    Raises:
        UnknownNameError: the record has no such entry.
        OptionError: neither a record nor a mapping.
    """
    kind: Any = type(default)
    if isinstance(value, Mapping):
        names = [each.name for each in fields(kind)]
        for key in value:
            check_name(entry, key, names)
        value = replace(cast(Any, default), **value)
    if not isinstance(value, kind):
        raise OptionError(f"{name} is a {type(value).__name__}, expected {kind.__name__} or a mapping")
    return cast(Record, value)
