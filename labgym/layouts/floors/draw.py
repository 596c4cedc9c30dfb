"""Draws floors: the families by name, one call for a family and a seed, and the families of each split."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

import numpy as np

from labgym.counts import MAX_SEED, is_whole, whole_number
from labgym.errors import InfeasibleError, OptionError, check_name
from labgym.layouts.floors.bay import BayRanges, EllRanges, bay, ell
from labgym.layouts.floors.building import FloorDraw, named
from labgym.layouts.floors.double import DoubleRanges, double
from labgym.layouts.floors.openings import UnsuitableError
from labgym.layouts.floors.ranges import BuildingRanges, with_limits
from labgym.layouts.floors.refit import RefitRanges, refit
from labgym.layouts.floors.suite import SuiteRanges, suite

ATTEMPTS = 200
"""Draws until a family's rules accept one."""


@dataclass(frozen=True)
class Family:
    """A family of floors.

    Attributes:
        summary: what its floors are, one line.
        ranges: its ranges by default.
        draw: draws one floor, or raises `UnsuitableError`.
    """

    name: str
    summary: str
    ranges: BuildingRanges
    draw: Callable[[np.random.Generator, Any], FloorDraw]


FAMILIES: dict[str, Family] = {
    family.name: family
    for family in (
        Family("bay", "one rectangular laboratory", BayRanges(), bay),
        Family("ell", "one L-shaped laboratory", EllRanges(), ell),
        Family("double", "two laboratories side by side", DoubleRanges(), double),
        Family("suite", "two to eight rooms along a corridor", SuiteRanges(), suite),
        Family("refit", "an old building with columns, chamfered corners and an oblique wing", RefitRanges(), refit),
    )
}
"""The families by name."""


def draw_floor(family: str, seed: int, **ranges: Any) -> FloorDraw:
    """Return a floor of a family. Equal arguments give equal floors in any process.

    Args:
        family: bay, ell, double, suite or refit.
        seed: 0 to 2^53 - 1.
        ranges: ranges that replace those of the family: pairs (least, greatest), or numbers; see `FAMILIES`.

    Raises:
        UnknownNameError: no family, or no parameter of it, has that name.
        OptionError: a seed or a range that is not valid.
        InfeasibleError: the rules of the family refuse every draw from these ranges.
    """
    check_name("family of floors", family, FAMILIES)
    seed = whole_number("seed", seed, 0, MAX_SEED)
    entry = FAMILIES[family]
    limits = with_limits(entry.ranges, family, ranges)
    generator = np.random.default_rng([seed, int.from_bytes(family.encode(), "big")])
    reason = ""
    for _ in range(ATTEMPTS):
        try:
            draw = entry.draw(generator, limits)
        except UnsuitableError as error:
            reason = str(error)
            continue
        identity: dict[str, Any] = {"family": family, "seed": seed}
        if ranges:
            identity["ranges"] = {name: _plain(getattr(limits, name)) for name in sorted(ranges)}
        return named(draw, f"{family}-{seed}", identity)
    what = f"{ATTEMPTS} draws of the family {family!r} broke its rules"
    raise InfeasibleError(what, [f"the last one: {reason}"], None, remedy="widen the ranges")


def _plain(value: Any) -> Any:
    return list(value) if isinstance(value, tuple) else value


NONE: Mapping[str, Any] = MappingProxyType({})


@dataclass(frozen=True)
class Population:
    """A family and the ranges that a split restricts.

    Attributes:
        family: name of the family.
        ranges: ranges that replace those of the family.
    """

    family: str
    ranges: Mapping[str, Any] = field(default_factory=lambda: NONE)

    def draw(self, seed: int) -> FloorDraw:
        """Return the floor of a seed. Raises as `draw_floor`."""
        return draw_floor(self.family, seed, **self.ranges)


HELD_OUT: Mapping[str, Any] = MappingProxyType({"held_out": True})

TRAINED = (Population("bay"), Population("ell"), Population("suite", MappingProxyType({"rooms": (2, 3)})))
TESTED = (
    Population("double", HELD_OUT),
    Population("refit", HELD_OUT),
    Population("suite", MappingProxyType({"rooms": (4, 8), **HELD_OUT})),
)

SPLITS: dict[str, tuple[Population, ...]] = {
    "floors-train": TRAINED,
    "floors-val": TRAINED,
    "floors-seen": TRAINED,
    "floors-test": TESTED,
    "floors-sealed": TESTED,
    "floors-fresh": TESTED,
}
"""Populations of the splits of floors. The test families and their finishes do not occur in training; `floors-val` and
`floors-seen` have further floors of the families of training, `floors-sealed` and `floors-fresh` further floors of the
test families."""


def population_of(split: str, index: int) -> Population:
    """Return the population of a place in a split: the populations take turns.

    Raises:
        UnknownNameError: there is no such split.
        OptionError: the index is negative.
    """
    check_name("split of floors", split, SPLITS)
    if not is_whole(index) or index < 0:
        raise OptionError(f"index of a floor in split {split!r} is {index!r}, expected a whole number of at least 0")
    populations = SPLITS[split]
    return populations[index % len(populations)]
