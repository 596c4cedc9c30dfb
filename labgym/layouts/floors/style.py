"""How a family furnishes: aisles, kinds of islands, and the walls that may carry hoods."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any, Literal, get_args

import numpy as np

from labgym.errors import OptionError
from labgym.layouts.floor.fields import HOOD_DOOR_LEAST
from labgym.layouts.floors.openings import Openings
from labgym.layouts.floors.plots import Plot
from labgym.layouts.floors.ranges import BuildingRanges, uniform

Island = Literal["island", "double_island", "peninsula", "oblique"]

HOOD_RUN = 2.4
"""Least length of wall without doors and glazing for a hood, meters: a 1.5 m hood and its neighbor."""
OBLIQUE = (0.17, 0.52)
"""Range of the angle of an oblique bench to the walls, radians: 10 to 30 degrees (assumption)."""


@dataclass(frozen=True)
class HoodWall:
    """A wall that may carry hoods, and the space in which they stand.

    Attributes:
        space: id of the space.
        wall: index of the wall in the floor.
    """

    space: str
    wall: int


@dataclass(frozen=True)
class FamilyStyle:
    """Clear widths, kinds of benches and hood walls of a floor.

    Attributes:
        aisle: clear width between pieces of furniture where people work, meters.
        maintenance_aisle: clear width of ways that lead to no place of work, meters.
        islands: kinds of free-standing benches, preferred ones first.
        oblique: angle of oblique benches to the axes of their space, radians; 0 without them.
        hood_walls: walls that may carry hoods, preferred ones first; only those of laboratories.
        held_out: whether the variants of furniture are those that training never shows.
    """

    aisle: float
    maintenance_aisle: float
    islands: tuple[Island, ...]
    oblique: float
    hood_walls: tuple[HoodWall, ...]
    held_out: bool = False

    def walls_of(self, space: str) -> tuple[int, ...]:
        """Return the walls of a space that may carry hoods, preferred ones first."""
        return tuple(each.wall for each in self.hood_walls if each.space == space)

    def to_json(self) -> dict[str, Any]:
        """Return the style as plain JSON data."""
        return asdict(self)


def draw_style(ranges: BuildingRanges, hood_walls: tuple[HoodWall, ...], generator: np.random.Generator) -> FamilyStyle:
    """Return a style drawn from a family's ranges.

    Raises:
        OptionError: the ranges name an unknown kind of island.
    """
    unknown = [name for name in ranges.islands if name not in get_args(Island)]
    if unknown:
        raise OptionError(f"unknown kind of island {unknown[0]!r}; available: {', '.join(get_args(Island))}")
    order: list[Island] = [ranges.islands[k] for k in generator.permutation(len(ranges.islands))]
    return FamilyStyle(
        aisle=uniform(generator, ranges.aisle),
        maintenance_aisle=uniform(generator, ranges.maintenance_aisle),
        islands=tuple(order),
        oblique=uniform(generator, OBLIQUE) if "oblique" in order else 0.0,
        hood_walls=hood_walls,
        held_out=ranges.held_out,
    )


def hood_walls(openings: Openings, plots: Sequence[Plot], generator: np.random.Generator) -> tuple[HoodWall, ...]:
    """Return the walls of laboratories that may carry hoods, in a random order.

    A wall qualifies if it has `HOOD_RUN` meters without doors, passages and glazing, `HOOD_DOOR_LEAST` from each door.
    """
    laboratories = {plot.id for plot in plots if plot.use == "laboratory"}
    candidates = [
        HoodWall(space, index)
        for index, side in enumerate(openings.sides)
        for space in (side.space, side.neighbor)
        if space in laboratories and _run(openings, index) >= HOOD_RUN
    ]
    return tuple(candidates[k] for k in generator.permutation(len(candidates)))


def _run(openings: Openings, index: int) -> float:
    """Longest part of a side that is free for hoods, meters."""
    low, high = openings.sides[index].clear
    longest, at = 0.0, low
    for opening in sorted(openings.on(index), key=lambda opening: opening.position):
        if opening.kind != "window":
            margin = opening.width / 2.0 + (HOOD_DOOR_LEAST if opening.kind in ("door", "passage") else 0.0)
            longest = max(longest, opening.position - margin - at)
            at = max(at, opening.position + margin)
    return max(longest, high - at)
