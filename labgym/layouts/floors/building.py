"""Turns plots with openings into a drawn floor: what every family does once its walls and doors stand."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, Generic

import numpy as np

from labgym.layouts.floor import Column, Floor
from labgym.layouts.floor.fields import NFPA_45
from labgym.layouts.floors.fittings import (
    FamilyStyle,
    draw_finishes,
    draw_services,
    draw_style,
    draw_windows,
    hood_walls,
    panel_area,
)
from labgym.layouts.floors.openings import CORNER, OpeningPlace, Openings, chosen
from labgym.layouts.floors.plots import Plot, diagonal, space_of
from labgym.layouts.floors.ranges import RANGES, BuildingRanges, uniform
from labgym.layouts.floors.sides import sides_of

SECOND_EXIT_AREA = NFPA_45
"""Largest laboratory with one way out, square meters: that of the default profile of thresholds."""
EXIT_DISTANCE_M = 2.0
"""Least distance of a third exit from the others, meters."""


@dataclass(frozen=True)
class Shell:
    """Sizes that all walls and doors of a floor share, meters."""

    exterior: float
    partition: float
    height: float
    door_height: float

    @classmethod
    def drawn(cls, ranges: BuildingRanges, generator: np.random.Generator) -> Shell:
        """Return sizes drawn from a family's ranges."""
        return cls(
            exterior=uniform(generator, ranges.exterior),
            partition=uniform(generator, ranges.partition),
            height=uniform(generator, ranges.height),
            door_height=uniform(generator, ranges.door_height, 0.05),
        )


@dataclass(frozen=True)
class FloorDraw:
    """A drawn floor.

    Attributes:
        floor: the floor.
        style: how it is furnished.
        parameters: family, seed and every drawn value, as plain JSON data for a layout's provenance.
    """

    floor: Floor
    style: FamilyStyle
    parameters: dict[str, Any]


@dataclass(frozen=True)
class Draft(Generic[RANGES]):
    """A floor whose walls stand and whose doors are being drawn.

    Attributes:
        plots: the outlines of its spaces.
        openings: its walls, with the openings added so far.
    """

    plots: Sequence[Plot]
    openings: Openings
    shell: Shell
    ranges: RANGES
    generator: np.random.Generator

    @classmethod
    def of(cls, plots: Sequence[Plot], shell: Shell, ranges: RANGES, generator: np.random.Generator) -> Draft[RANGES]:
        """Return plots with walls around them and no opening."""
        return cls(plots, Openings(sides_of(plots, shell.exterior)), shell, ranges, generator)

    def door_widths(self, count: int) -> list[float]:
        """Return widths of doors drawn from the family's range, multiples of 5 cm."""
        return [uniform(self.generator, self.ranges.door, 0.05) for _ in range(count)]

    def add_exits(self, sides: Sequence[Sequence[int]], widths: Sequence[float], corner: float = CORNER) -> None:
        """Add exits, the first two of which are half the diagonal of the floor apart (NFPA 101, 7.5.1.3).

        Args:
            sides: for each exit the sides on which it may be.
            widths: clear width of each exit.
            corner: least distance from a corner.

        Raises:
            UnsuitableError: one of them fits nowhere.
        """
        exits: list[OpeningPlace] = []
        for number, (allowed, width) in enumerate(zip(sides, widths, strict=True)):
            least = diagonal(self.plots) / 2.0 if number == 1 else EXIT_DISTANCE_M
            places = [
                place
                for place in self.openings.places(allowed, width, corner=corner)
                if all(math.dist(place.point, other.point) > least for other in exits)
            ]
            place = chosen(places, self.generator, f"exit {number + 1}")
            self.openings.add_way(place, width, self.shell.door_height)
            exits.append(place)

    def finished(self, parameters: dict[str, Any], columns: tuple[Column, ...] = ()) -> FloorDraw:
        """Return the floor with windows, services, finishes and a style.

        Args:
            parameters: what the family drew itself; the shared values are added.
        """
        openings, plots, generator, height = self.openings, self.plots, self.generator, self.shell.height
        hoods = hood_walls(openings, plots, generator)
        bare = [next(hood.wall for hood in hoods if hood.space == space) for space in {h.space: None for h in hoods}]
        share = draw_windows(openings, plots, self.ranges, height, generator, bare)
        finishes = draw_finishes(self.ranges, generator)
        style = draw_style(self.ranges, hoods, generator)
        keep_outs = panel_area(openings, plots, generator)
        spaces = tuple(space_of(plot, height).model_copy(update={"finishes": finishes}) for plot in plots)
        floor = Floor(
            walls=openings.walls(height),
            spaces=spaces,
            columns=columns,
            services=draw_services(openings, plots, hoods, height),
            keep_outs=keep_outs,
        )
        shared = {
            **asdict(self.shell),
            "windows": share,
            "aisle": style.aisle,
            "maintenance_aisle": style.maintenance_aisle,
            "islands": list(style.islands),
            "oblique": style.oblique,
            "exits": sum(doorway.exit for doorway in floor.doorways),
            "area": round(sum(plot.area for plot in plots), 2),
        }
        return FloorDraw(floor, style, {**parameters, **shared})


def named(draw: FloorDraw, name: str, parameters: dict[str, Any]) -> FloorDraw:
    """Return a draw with its floor's name set and further parameters in front."""
    floor = draw.floor.model_copy(update={"name": name})
    return replace(draw, floor=floor, parameters={**parameters, **draw.parameters})
