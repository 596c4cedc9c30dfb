"""Parts from plain data: the name of a kind, a table with its arguments, or a class of the user's own.

`{"kind": "lidar", "rays": 90, "noise": [{"kind": "gaussian", "sigma": 0.03}]}` is a sensor; so is "lidar", and so is
`{"kind": "module:Class", "argument": 1}`. Every part of ours has a field `kind`, so that `dataclasses.asdict` gives
such a table.
"""

from __future__ import annotations

import importlib
import inspect
import math
from collections.abc import Iterable, Mapping
from dataclasses import fields, replace
from functools import cache
from typing import Any, TypeVar, cast

from labgym.counts import whole_number
from labgym.errors import OptionError, UnknownArgumentError, UnknownNameError

Record = TypeVar("Record")
"""A dataclass of numbers."""


def part_of(value: Any, role: str) -> Any:
    """Return the part that a value stands for.

    Args:
        value: a part, the name of a kind, or a mapping with "kind" and the arguments of its class.
        role: a key of `catalog.ROLES`.

    Raises:
        UnknownNameError: no such kind.
        UnknownArgumentError: its class has no such argument.
        OptionError: an argument is missing or does not fit, or the value is something else.
    """
    if isinstance(value, str):
        value = {"kind": value}
    if isinstance(value, Mapping):
        value = _made(value, role)
    protocol = _roles()[role][0]
    if isinstance(value, type) or not isinstance(value, protocol):
        shown = value.__name__ if isinstance(value, type) else type(value).__name__
        members = sorted({*dir(protocol), *protocol.__annotations__})
        members = [name for name in members if not name.startswith("_")]
        missing = [name for name in members if not hasattr(value, name)]
        lacks = f"it lacks {', '.join(missing)}" if missing else "pass an object"
        raise OptionError(f"{role} {shown} is not a {role} ({lacks}); expected an object, a name or a mapping")
    return value


def parts_of(values: Any, role: str) -> tuple[Any, ...]:
    """Return the parts that a sequence of values stands for; their names must differ.

    Raises:
        UnknownNameError, OptionError: as `part_of`, not a sequence, or two parts of one name.
    """
    if isinstance(values, str | Mapping) or not isinstance(values, Iterable):
        raise OptionError(f"{role}s are {type(values).__name__}, expected a list of names, mappings or objects")
    parts = tuple(part_of(value, role) for value in values)
    names = [str(getattr(part, "name", index)) for index, part in enumerate(parts)]
    for name in names:
        if names.count(name) > 1:
            raise OptionError(f"two {role}s are named {name!r}: pass another name")
    return parts


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
            if key not in names:
                raise UnknownNameError(entry, key, names)
        value = replace(cast(Any, default), **value)
    if not isinstance(value, kind):
        raise OptionError(f"{name} is a {type(value).__name__}, expected {kind.__name__} or a mapping")
    return cast(Record, value)


def noises(part: Any) -> None:
    """Replace plain data in the field `noise` of a sensor by noise models."""
    noise = part.noise if isinstance(part.noise, list | tuple) else (part.noise,)
    object.__setattr__(part, "noise", tuple(part_of(each, "noise") for each in noise))


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
        number = isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
        if not number or not 0 <= value <= most or (value == 0 and not zero):
            least = ("at least 0" if zero else "above 0") + (f" and at most {most:g}" if most < math.inf else "")
            raise OptionError(f"{type(part).__name__}: {name} is {str(value)[:40]!r}, expected a number {least}")


def finite(part: Any, *names: str) -> None:
    """Check that fields are finite numbers.

    Raises:
        OptionError: one is not.
    """
    for name in names:
        value = getattr(part, name)
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
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


def _made(value: Mapping[Any, Any], role: str) -> Any:
    """Return the part that a mapping describes, after a check of the names of its arguments."""
    kind = value.get("kind")
    label = f"{role} {str(kind)[:80]!r}"
    arguments = {str(key): argument for key, argument in value.items() if key != "kind"}
    part_class = _class_of(kind, role)
    try:
        parameters = tuple(inspect.signature(part_class).parameters.values())
    except (TypeError, ValueError):  # a class of another language has no signature
        parameters = ()
    if parameters and not any(each.kind is inspect.Parameter.VAR_KEYWORD for each in parameters):
        named = [each for each in parameters if each.kind is not inspect.Parameter.POSITIONAL_ONLY]
        names = [each.name for each in named]
        unknown = next((name for name in arguments if name not in names), None)
        if unknown is not None:
            raise UnknownArgumentError(label, unknown, names)
        missing = [each.name for each in named if each.default is each.empty and each.name not in arguments]
        if missing:
            raise OptionError(f"{label} needs the argument {missing[0]!r}; its arguments: {', '.join(names)}")
    try:
        return part_class(**arguments)
    except (TypeError, AttributeError) as error:
        raise OptionError(f"{label}: an argument has the wrong type ({error})") from error


def _class_of(kind: Any, role: str) -> type[Any]:
    kinds = _roles()[role][1]
    if isinstance(kind, str) and ":" in kind:
        module, _, name = kind.partition(":")
        try:
            part_class = getattr(importlib.import_module(module), name)
        except (ImportError, AttributeError, ValueError) as error:
            raise OptionError(f"{role} {kind!r} cannot be imported: {error}") from None
        if isinstance(part_class, type):
            return part_class
        raise OptionError(f"{role} {kind!r} is not a class")
    if not isinstance(kind, str) or kind not in kinds:
        raise UnknownNameError(role, kind, kinds)
    return kinds[kind]


@cache
def _roles() -> dict[str, tuple[Any, dict[str, type[Any]]]]:
    """Return the interface of each role, and our classes by kind."""
    from labgym.envs.parts.catalog import ROLES

    return {
        role: (protocol, {made.__dataclass_fields__["kind"].default: made for made in classes})
        for role, (protocol, classes) in ROLES.items()
    }
