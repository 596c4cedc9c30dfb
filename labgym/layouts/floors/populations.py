"""Which families train and which test: the split of floors by family."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

import numpy as np

from labgym.layouts.floors.building import FloorDraw
from labgym.layouts.floors.draw import draw_floor

NONE: Mapping[str, Any] = MappingProxyType({})


@dataclass(frozen=True)
class Population:
    """A family and the ranges that a split restricts.

    Attributes:
        family: name of the family.
        ranges: ranges that replace those of the family.
        weight: share of the split's floors, relative to the others.
    """

    family: str
    ranges: Mapping[str, Any] = field(default_factory=lambda: NONE)
    weight: float = 1.0

    def draw(self, seed: int) -> FloorDraw:
        """Return the floor of a seed. Raises as `draw_floor`."""
        return draw_floor(self.family, seed, **self.ranges)


HELD_OUT: Mapping[str, Any] = MappingProxyType({"held_out_finishes": True})

SPLITS: dict[str, tuple[Population, ...]] = {
    "train": (Population("bay"), Population("ell"), Population("suite", MappingProxyType({"rooms": (2, 3)}))),
    "test": (
        Population("double", HELD_OUT),
        Population("refit", HELD_OUT),
        Population("suite", MappingProxyType({"rooms": (4, 8), **HELD_OUT})),
    ),
}
"""Families of the splits. No floor of the test families, nor one of their finishes, is seen in training."""


def population_of(split: str, generator: np.random.Generator) -> Population:
    """Return a population of a split, drawn by weight.

    Raises:
        KeyError: there is no such split.
    """
    populations = SPLITS[split]
    weights = np.array([population.weight for population in populations])
    return populations[int(generator.choice(len(populations), p=weights / weights.sum()))]
