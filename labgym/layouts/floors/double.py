"""Doubles: two laboratories side by side, joined by a door or a passage, with a glazed partition or without."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np

from labgym.layouts.floors.building import Draft, FloorDraw, Shell
from labgym.layouts.floors.fittings import draw_glazing
from labgym.layouts.floors.openings import UnsuitableError, between, chosen
from labgym.layouts.floors.plots import Plot, posed, rectangle
from labgym.layouts.floors.ranges import KINDS, BuildingRanges, Limits, chance, integer, uniform
from labgym.layouts.floors.sides import OUTSIDE

SHARED = 2.5
"""Least length of the wall that the two laboratories share, meters: a passage and its corners."""
OFFSET = 0.6
"""Least offset between walls of the two that are not aligned, meters."""
PASSAGE = (1.2, 2.4)
"""Range of the width of a passage, meters (assumption: one leaf and a half to two bench depths)."""


@dataclass(frozen=True)
class DoubleRanges(BuildingRanges):
    """Ranges of doubles."""

    width: Annotated[Limits, "width of each laboratory, across the shared wall, m", "assumption"] = (5.0, 11.0)
    depth: Annotated[Limits, "depth of each laboratory, along the shared wall, m", "assumption"] = (5.0, 12.0)
    floor_area: Annotated[Limits, "floor area of both, m²", "assumption: two laboratory units"] = (60.0, 240.0)
    exits: Annotated[tuple[int, int], "number of exits", "NFPA 101, 7.5.1.3: two, half the diagonal apart"] = (2, 3)
    glazing: Annotated[Limits, "probability of a glazed partition", "assumption"] = (0.5, 0.5)
    flush: Annotated[Limits, "probability that the two are aligned", "assumption"] = (0.5, 0.5)
    aisle: Annotated[
        Limits, "clear width between furniture, m", "BG RCI 6.2.1: 0.90 m for circulation; 24 CCR: 1.52 m"
    ] = (0.95, 1.52)
    islands: Annotated[tuple[str, ...], KINDS, "assumption"] = ("island", "double_island", "peninsula")


def double(generator: np.random.Generator, ranges: DoubleRanges) -> FloorDraw:
    """Return a double, turned and mirrored at random.

    Raises:
        UnsuitableError: the area or the shared wall is out of range, or a door fits nowhere.
    """
    shell = Shell.drawn(ranges, generator)
    widths = [uniform(generator, ranges.width) for _ in range(2)]
    depths = [uniform(generator, ranges.depth) for _ in range(2)]
    flush = chance(generator, ranges.flush[0])
    shift = 0.0 if flush else uniform(generator, (SHARED - depths[1], depths[0] - SHARED))
    second = str(generator.choice(["laboratory", "instrument"]))
    plots = posed(
        (
            Plot("laboratory", "laboratory", rectangle(0.0, 0.0, widths[0], depths[0])),
            Plot(
                "annex",
                "laboratory" if second == "laboratory" else "instrument",
                rectangle(
                    widths[0] + shell.partition,
                    shift,
                    widths[0] + shell.partition + widths[1],
                    shift + depths[1],
                ),
            ),
        ),
        generator,
    )
    area = sum(plot.area for plot in plots)
    if not ranges.floor_area[0] <= area <= ranges.floor_area[1]:
        raise UnsuitableError(f"the floor has {area:.1f} m²")
    draft = Draft.of(plots, shell, ranges, generator)
    openings = draft.openings
    if (shortest := min(side.length for side in openings.sides)) < OFFSET:
        raise UnsuitableError(f"the walls of the two are offset by {shortest:.2f} m")
    shared = between(openings.sides, plots[0].id, plots[1].id)
    ways = _join(draft)
    count = integer(generator, ranges.exits)
    doors = draft.door_widths(count)
    own = [between(openings.sides, plot.id, OUTSIDE) for plot in plots]
    draft.add_exits([own[0], *([own[0] + own[1]] * (count - 1))], doors)
    panes = draw_glazing(openings, shared, shell.door_height, ranges.glazing[0], generator)
    drawn = {"widths": widths, "depths": depths, "shift": shift, "use": second, "doors": doors, "ways": ways}
    return draft.finished({**drawn, "glazed": panes > 0})


def _join(draft: Draft[DoubleRanges]) -> list[str]:
    """Add a door, a passage or a door and a passage to the shared wall; return their kinds."""
    openings, plots, generator = draft.openings, draft.plots, draft.generator
    shared = between(openings.sides, plots[0].id, plots[1].id)
    kinds: list[Literal["door", "passage"]] = ["door", "passage"]
    if not chance(generator, 0.2):
        kinds = [kinds[int(generator.integers(2))]]
    added: list[str] = []
    for kind in kinds:
        width = uniform(generator, PASSAGE if kind == "passage" else draft.ranges.door, 0.05)
        into = plots[int(generator.integers(2))].id
        places = openings.places(shared, width, into)
        if places or not added:
            place = chosen(places, generator, "a way between the laboratories")
            openings.add_way(place, width, draft.shell.door_height, kind, into)
            added.append(kind)
    return added
