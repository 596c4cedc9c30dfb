"""Parts from plain data: the name of a kind, a table with its arguments, or a class of the user's own.

`{"kind": "lidar", "rays": 90, "noise": [{"kind": "gaussian", "sigma": 0.03}]}` is a sensor; so is "lidar", and so is
`{"kind": "module:Class", "argument": 1}`. A part of ours registers itself under its kind; `catalog` imports all.
"""

from __future__ import annotations

import importlib
import inspect
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, TypeVar, dataclass_transform

from labgym.envs.parts.protocols import INTERFACES
from labgym.errors import OptionError, UnknownArgumentError, UnknownNameError

Part = TypeVar("Part", bound=type[Any])
_KINDS: dict[str, dict[str, type[Any]]] = {role: {} for role in INTERFACES}


@dataclass_transform(frozen_default=True, field_specifiers=(field,))
def registered(role: str, kind: str, *, frozen: bool = True) -> Callable[[Part], Part]:
    """Return a decorator that makes a class a dataclass, and a part of a role under a kind.

    Its last field `kind`, which is no argument, has the kind, so that `dataclasses.asdict` gives a table for `part_of`.

    Args:
        role: a key of `protocols.INTERFACES`. frozen: whether its fields cannot be assigned.
    """

    def add(part_class: Part) -> Part:
        part_class.__annotations__ = {**inspect.get_annotations(part_class), "kind": "str"}
        part_class.kind = field(default=kind, init=False)
        _KINDS[role][kind] = dataclass(frozen=frozen)(part_class)
        return part_class

    return add


def kinds_of(role: str) -> dict[str, type[Any]]:
    """Return our parts of a role by kind."""
    return dict(_KINDS[role])


def part_of(value: Any, role: str) -> Any:
    """Return the part that a value stands for.

    Args:
        value: a part, the name of a kind, or a mapping with "kind" and the arguments of its class.
        role: a key of `protocols.INTERFACES`.

    Raises:
        UnknownNameError: no such kind.
        UnknownArgumentError: its class has no such argument.
        OptionError: an argument is missing or does not fit, or the value is something else.
    """
    if isinstance(value, str):
        value = {"kind": value}
    if isinstance(value, Mapping):
        value = _made(value, role)
    protocol = INTERFACES[role]
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
    kinds = _KINDS[role]
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
