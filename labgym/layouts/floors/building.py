"""Turns plots with openings into a drawn floor: what every family does once its walls and doors stand."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

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
from labgym.layouts.floors.openings import Openings
from labgym.layouts.floors.plots import Plot, space_of
from labgym.layouts.floors.ranges import BuildingRanges, uniform

SECOND_EXIT_AREA = NFPA_45
"""Largest laboratory with one way out, square meters: that of the default profile of thresholds."""


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


def door_widths(ranges: BuildingRanges, count: int, generator: np.random.Generator) -> list[float]:
    """Return widths of doors drawn from a family's range, multiples of 5 cm."""
    return [uniform(generator, ranges.door, 0.05) for _ in range(count)]


def finished(
    openings: Openings,
    plots: Sequence[Plot],
    shell: Shell,
    ranges: BuildingRanges,
    generator: np.random.Generator,
    parameters: dict[str, Any],
    columns: tuple[Column, ...] = (),
) -> FloorDraw:
    """Return the floor of plots whose doors stand, with windows, services, finishes and a style.

    Args:
        parameters: what the family drew itself; the shared values are added.
    """
    hoods = hood_walls(openings, plots, generator)
    bare = [next(hood.wall for hood in hoods if hood.space == space) for space in {h.space: None for h in hoods}]
    share = draw_windows(openings, plots, ranges, shell.height, generator, bare)
    finishes = draw_finishes(ranges, generator)
    style = draw_style(ranges, hoods, generator)
    keep_outs = panel_area(openings, plots, generator)
    spaces = tuple(space_of(plot, shell.height).model_copy(update={"finishes": finishes}) for plot in plots)
    floor = Floor(
        walls=openings.walls(shell.height),
        spaces=spaces,
        columns=columns,
        services=draw_services(openings, plots, hoods, shell.height),
        keep_outs=keep_outs,
    )
    shared = {
        "exterior": shell.exterior,
        "partition": shell.partition,
        "height": shell.height,
        "door_height": shell.door_height,
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
