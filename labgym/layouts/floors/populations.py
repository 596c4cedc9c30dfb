"""Which families train and which test: the split of floors by family."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

from labgym.counts import is_whole
from labgym.errors import OptionError, UnknownNameError
from labgym.layouts.floors.building import FloorDraw
from labgym.layouts.floors.draw import draw_floor

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
}
"""Populations of the splits of floors. The test families and their finishes do not occur in training; `floors-val` and
`floors-seen` have further floors of the families of training, `floors-sealed` further floors of the test families."""


def population_of(split: str, index: int) -> Population:
    """Return the population of a place in a split: the populations take turns.

    Raises:
        UnknownNameError: there is no such split.
        OptionError: the index is negative.
    """
    if split not in SPLITS:
        raise UnknownNameError("split of floors", split, SPLITS)
    if not is_whole(index) or index < 0:
        raise OptionError(f"index of a floor in split {split!r} is {index!r}, expected a whole number of at least 0")
    populations = SPLITS[split]
    return populations[index % len(populations)]
