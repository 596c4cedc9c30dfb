"""Ranges of a family's parameters: limits, meaning and source of each, and draws from them. Lengths in meters."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import Field, dataclass, fields, replace
from typing import Annotated, Any, TypeVar, get_type_hints

import numpy as np

from labgym.counts import check_switch, is_real
from labgym.errors import OptionError, UnknownArgumentError

Limits = tuple[float, float]

RANGES = TypeVar("RANGES", bound="BuildingRanges")


KINDS = "kinds of islands, in an order drawn at random"


@dataclass(frozen=True)
class BuildingRanges:
    """Ranges that all families share: (least, greatest) of each parameter."""

    exterior: Annotated[Limits, "thickness of exterior walls, m", "assumption: insulated masonry"] = (0.20, 0.40)
    partition: Annotated[Limits, "thickness of partitions, m", "assumption: stud walls and blockwork"] = (0.10, 0.20)
    height: Annotated[Limits, "ceiling height, m", "JGJ 91-2019: at least 2.60 m; upper limit assumed"] = (2.60, 3.60)
    door: Annotated[
        Limits, "width of doors, m", "24 CCR: 0.914 m clear with the leaf open; JGJ 91-2019: 1.20 and 1.50 m"
    ] = (1.00, 1.50)
    door_height: Annotated[Limits, "clear height of doors, m", "OSHA 1910.36(g)(1): projections above 2.0 m"] = (
        2.05,
        2.40,
    )
    windows: Annotated[Limits, "share of exterior wall that windows take", "assumption"] = (0.0, 0.6)
    aisle: Annotated[
        Limits, "clear width between furniture, m", "vendor guide: 1.07 m (42 in); 24 CCR: 1.52 m (5 ft)"
    ] = (1.07, 1.52)
    maintenance_aisle: Annotated[
        Limits, "clear width where nobody works, m", "BG RCI 6.2.1: less than 0.90 m for maintenance aisles"
    ] = (0.75, 0.90)
    islands: Annotated[tuple[str, ...], KINDS, "assumption"] = ("island", "peninsula")
    held_out: Annotated[
        bool, "whether furniture variants and finishes are those that training never shows", "splits"
    ] = False


def with_limits(ranges: RANGES, family: str, overrides: Mapping[str, Any]) -> RANGES:
    """Return the ranges with some of them replaced; a single number stands for a range of that value only.

    Raises:
        UnknownArgumentError: the family has no parameter of that name.
        OptionError: a value is neither a number nor a pair (least, greatest).
    """
    parameters = {each.name: each for each in fields(ranges)}
    changes: dict[str, Any] = {}
    for name, value in overrides.items():
        if name not in parameters:
            raise UnknownArgumentError(f"family {family!r}", name, parameters)
        changes[name] = _checked(family, parameters[name], getattr(ranges, name), value)
    return replace(ranges, **changes)


def _checked(family: str, parameter: Field[Any], default: Any, value: Any) -> Any:
    what = f"parameter {parameter.name!r} of the family {family!r}"
    if isinstance(default, bool):
        check_switch(what, value)
        return value
    if isinstance(default[0], str):
        if isinstance(value, str) or not value or not all(isinstance(item, str) for item in value):
            raise OptionError(f"{what} must be a list of names, got {value!r}")
        return tuple(value)
    pair = (value, value) if is_real(value) else value
    try:
        low, high = pair
        valid = float(low) <= float(high)
    except (TypeError, ValueError):
        valid = False
    if not valid:
        raise OptionError(f"{what} must be a number or a pair (least, greatest), got {value!r}")
    whole = isinstance(default[0], int)
    return (int(low), int(high)) if whole else (float(low), float(high))


def described(ranges: BuildingRanges) -> Iterator[tuple[str, Any, str, str]]:
    """Yield name, limits, meaning and source of every parameter; the annotations have the last two."""
    hints = get_type_hints(type(ranges), include_extras=True)
    for each in fields(ranges):
        meaning, source = hints[each.name].__metadata__
        yield each.name, getattr(ranges, each.name), meaning, source


def uniform(generator: np.random.Generator, span: Limits, step: float = 0.01) -> float:
    """Return a number drawn uniformly from a range, rounded to a multiple of `step` within it."""
    low, high = span
    value = round(float(generator.uniform(low, high)) / step) * step
    return round(min(max(value, low), high), 6)


def logarithmic(generator: np.random.Generator, span: Limits) -> float:
    """Return a length drawn uniformly in its logarithm, to a centimeter: as many from 5 to 10 as from 10 to 20."""
    low, high = span
    return round(min(max(float(np.exp(generator.uniform(np.log(low), np.log(high)))), low), high), 2)


def integer(generator: np.random.Generator, span: tuple[int, int]) -> int:
    """Return an integer drawn uniformly from a range, both ends included."""
    return int(generator.integers(span[0], span[1] + 1))


def chance(generator: np.random.Generator, probability: float) -> bool:
    """Return True with a probability."""
    return bool(generator.random() < probability)
