"""Bays and ells: one rectangular or L-shaped laboratory of any size."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from labgym.layouts.floors.building import SECOND_EXIT_AREA, Draft, FloorDraw, Shell
from labgym.layouts.floors.openings import UnsuitableError
from labgym.layouts.floors.plots import Plot, posed, rectangle
from labgym.layouts.floors.ranges import KINDS, BuildingRanges, Limits, integer, logarithmic, uniform


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
    return _with_exits(Draft.of(plots, shell, ranges, generator), width * depth, {"width": width, "depth": depth})


@dataclass(frozen=True)
class EllRanges(BuildingRanges):
    """Ranges of ells."""

    length: Annotated[Limits, "length of each of the two outer walls, m", "assumption"] = (7.0, 16.0)
    leg: Annotated[Limits, "width of each leg, m", "JGJ 91: a bay of 6.6 m, at least half of one"] = (3.3, 8.0)
    notch: Annotated[Limits, "sides of the missing corner, m", "assumption: less is an alcove"] = (2.0, 12.0)
    floor_area: Annotated[Limits, "floor area, m²", "assumption: one laboratory unit"] = (40.0, 200.0)
    exits: Annotated[
        tuple[int, int], "number of exits; two at least above 46.5 m²", "NFPA 45: 46.5 m² for a class B laboratory"
    ] = (1, 3)
    islands: Annotated[tuple[str, ...], KINDS, "assumption"] = ("island", "double_island", "peninsula")


def ell(generator: np.random.Generator, ranges: EllRanges) -> FloorDraw:
    """Return an ell, turned and mirrored at random.

    Raises:
        UnsuitableError: the legs or the area are out of range.
    """
    shell = Shell.drawn(ranges, generator)
    width, depth = uniform(generator, ranges.length), uniform(generator, ranges.length)
    across, along = uniform(generator, ranges.leg), uniform(generator, ranges.leg)
    notch = min(width - along, depth - across), max(width - along, depth - across)
    outline = ((0.0, 0.0), (width, 0.0), (width, across), (along, across), (along, depth), (0.0, depth))
    plots = posed((Plot("laboratory", "laboratory", outline),), generator)
    if not ranges.notch[0] <= notch[0] <= notch[1] <= ranges.notch[1]:
        raise UnsuitableError(f"the missing corner measures {notch[0]:.2f} x {notch[1]:.2f} m")
    if not ranges.floor_area[0] <= plots[0].area <= ranges.floor_area[1]:
        raise UnsuitableError(f"the floor has {plots[0].area:.1f} m²")
    drawn = {"length": [width, depth], "leg": [along, across]}
    return _with_exits(Draft.of(plots, shell, ranges, generator), plots[0].area, drawn)


def _with_exits(draft: Draft[BayRanges] | Draft[EllRanges], area: float, drawn: dict[str, Any]) -> FloorDraw:
    """Return the floor with exits in any walls."""
    count = max(integer(draft.generator, draft.ranges.exits), 2 if area > SECOND_EXIT_AREA else 1)
    widths = draft.door_widths(count)
    draft.add_exits([range(len(draft.openings.sides))] * count, widths)
    return draft.finished({**drawn, "doors": widths})
