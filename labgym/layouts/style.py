"""How densely and how regularly a floor is furnished."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from labgym.layouts.floors import FamilyStyle
from labgym.layouts.variants import Variety

AISLE = (1.2, 1.5)
"""Range of the clear width around benches of a floor that is of no family, meters: the same along their sides and at
their ends, 1.5 between occupied benches (UC laboratory design manual) and 1.2 at least."""
WALLS, ISLANDS = (0.4, 0.8), (0.04, 0.14)
"""Ranges of what a floor varies in further; assumptions."""
KINDS = ("island", "island", "double_island", "peninsula", "oblique")


@dataclass(frozen=True)
class Style:
    """How a floor is furnished.

    Attributes:
        aisle: clear width along the sides of free-standing benches, meters.
        neck: clear width at their ends, meters.
        walls: share of the wall length that furniture takes.
        islands: share of the floor area that free-standing benches take.
        kinds: kinds of free-standing benches that occur: island, double_island, peninsula, oblique (along oblique
            walls).
        hood_walls: pairs of a space and the index of a wall that may carry hoods; empty for any wall.
        variety: which variants of furniture it has.
    """

    aisle: float = 1.2
    neck: float = 1.0
    walls: float = 0.65
    islands: float = 0.1
    kinds: tuple[str, ...] = ("island",)
    hood_walls: tuple[tuple[str, int], ...] = ()
    variety: Variety = "plain"

    @classmethod
    def draw(cls, generator: np.random.Generator) -> Style:
        """Return a random style for a floor that is of no family."""
        width = round(float(generator.uniform(*AISLE)), 2)
        return cls(aisle=width, neck=width, kinds=KINDS).varied(generator)

    @classmethod
    def of(cls, style: FamilyStyle) -> Style:
        """Return the style that a family asks for."""
        return cls(
            aisle=style.aisle,
            neck=style.maintenance_aisle,
            kinds=style.islands,
            hood_walls=tuple((each.space, each.wall) for each in style.hood_walls),
            variety="held_out" if style.held_out else "training",
        )

    def varied(self, generator: np.random.Generator) -> Style:
        """Return the style with other shares of walls and floor."""
        return replace(
            self,
            walls=round(float(generator.uniform(*WALLS)), 2),
            islands=round(float(generator.uniform(*ISLANDS)), 3),
        )
