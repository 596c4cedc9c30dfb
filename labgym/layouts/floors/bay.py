"""Bays: one rectangular laboratory of any size, with one to three doors on any walls."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from labgym.layouts.floors.building import SECOND_EXIT_AREA, FloorDraw, Shell, door_widths, finished
from labgym.layouts.floors.openings import Openings, add_exits
from labgym.layouts.floors.plots import Plot, rectangle
from labgym.layouts.floors.ranges import KINDS, BuildingRanges, Limits, integer, logarithmic
from labgym.layouts.floors.sides import sides_of


@dataclass(frozen=True)
class BayRanges(BuildingRanges):
    """Ranges of bays."""

    width: Annotated[Limits, "width of the room, m, uniform in its logarithm", "assumption: 5 to 20 m"] = (5.0, 20.0)
    depth: Annotated[Limits, "depth of the room, m, uniform in its logarithm", "assumption: 5 to 20 m"] = (5.0, 20.0)
    exits: Annotated[
        tuple[int, int], "number of exits; two at least above 46.5 m²", "NFPA 45: 46.5 m² for a class B laboratory"
    ] = (1, 3)
    islands: Annotated[tuple[str, ...], KINDS, "assumption"] = ("island", "double_island", "peninsula")


def bay(generator: np.random.Generator, ranges: BayRanges) -> FloorDraw:
    """Return a bay."""
    shell = Shell.drawn(ranges, generator)
    width, depth = logarithmic(generator, ranges.width), logarithmic(generator, ranges.depth)
    plots = (Plot("laboratory", "laboratory", rectangle(0.0, 0.0, width, depth)),)
    openings = Openings(sides_of(plots, shell.exterior))
    count = max(integer(generator, ranges.exits), 2 if width * depth > SECOND_EXIT_AREA else 1)
    widths = door_widths(ranges, count, generator)
    walls = [range(len(openings.sides))] * count
    add_exits(openings, walls, widths, shell.door_height, math.hypot(width, depth) / 2.0, generator)
    return finished(openings, plots, shell, ranges, generator, {"width": width, "depth": depth, "doors": widths})
