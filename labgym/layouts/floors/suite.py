"""Suites: two to eight rooms of different use along one or both sides of a corridor."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from labgym.layouts.floors.building import SECOND_EXIT_AREA, Draft, FloorDraw, Shell
from labgym.layouts.floors.fittings import draw_glazing
from labgym.layouts.floors.openings import OpeningPlace, UnsuitableError, between, chosen
from labgym.layouts.floors.plots import Plot, Use, diagonal, posed, rectangle
from labgym.layouts.floors.ranges import BuildingRanges, Limits, chance, integer, uniform
from labgym.layouts.floors.sides import OUTSIDE

MODULES = (1.0, 1.0, 1.5, 2.0, 2.0, 2.5, 3.0)
"""Widths of rooms in modules, drawn from these (assumption)."""
MAIN_AREA = 36.0
"""Least area of the largest laboratory, square meters (assumption: two modules 5.5 m deep)."""
SMALL = 24.0
"""Rooms up to this area are no laboratories, square meters (assumption)."""
LONGEST_ROW = 5
"""Largest number of rooms along one side of a corridor with rooms on one side only."""
STRETCH = 3.0
"""A row of rooms that is shorter than the other by up to this is stretched to its length, meters."""
ENDS = 0.15
"""Least distance of an exit from the corners of a corridor, meters."""


@dataclass(frozen=True)
class SuiteRanges(BuildingRanges):
    """Ranges of suites."""

    rooms: Annotated[tuple[int, int], "number of rooms", "assumption: 2 to 8"] = (2, 8)
    module: Annotated[Limits, "width of a module, m", "JGJ 91: a bay of two modules is 6.6 m wide"] = (3.0, 3.6)
    depth: Annotated[Limits, "depth of the rooms of a row, m", "JGJ 91: 5.7 m without hoods, 6.6 m with them"] = (
        5.7,
        8.0,
    )
    single: Annotated[Limits, "width of a corridor with rooms on one side, m", "JGJ 91-2019: at least 1.50 m"] = (
        1.5,
        2.2,
    )
    loaded: Annotated[Limits, "width of a corridor with rooms on both sides, m", "JGJ 91-2019: at least 1.80 m"] = (
        1.8,
        2.6,
    )
    floor_area: Annotated[Limits, "floor area with the corridor, m²", "assumption: 80 to 400 m²"] = (80.0, 400.0)
    exits: Annotated[tuple[int, int], "number of exits", "NFPA 101, 7.5.1.3: two, half the diagonal apart"] = (2, 3)
    both: Annotated[Limits, "probability of rooms on both sides of the corridor", "assumption"] = (0.7, 0.7)
    joined: Annotated[Limits, "probability of a door between neighbors", "assumption"] = (0.25, 0.25)
    glazing: Annotated[Limits, "probability of a glazed part in a wall to the corridor", "assumption"] = (0.2, 0.2)
    aisle: Annotated[
        Limits, "clear width between furniture, m", "BG RCI 6.2.1: 0.90 m for circulation; 24 CCR: 1.52 m"
    ] = (0.95, 1.50)


def suite(generator: np.random.Generator, ranges: SuiteRanges) -> FloorDraw:
    """Return a suite, turned and mirrored at random.

    Raises:
        UnsuitableError: the area is out of range, or a door fits nowhere.
    """
    shell = Shell.drawn(ranges, generator)
    count = integer(generator, ranges.rooms)
    rows, lengths = _rows(ranges, shell, count, generator)
    corridor = uniform(generator, ranges.loaded if rows[1] else ranges.single)
    depths = [uniform(generator, ranges.depth) for _ in rows]
    outlines = [rectangle(0.0, 0.0, max(lengths), corridor)]
    for row, depth, above in zip(rows, depths, (True, False), strict=True):
        low = corridor + shell.partition if above else -shell.partition - depth
        outlines += [rectangle(x0, low, x1, low + depth) for x0, x1 in row]
    plots = posed(_assigned(outlines, generator), generator)
    area = sum(plot.area for plot in plots)
    if not ranges.floor_area[0] <= area <= ranges.floor_area[1]:
        raise UnsuitableError(f"the floor has {area:.1f} m²")
    draft = Draft.of(plots, shell, ranges, generator)
    openings, doors, exits = draft.openings, _add_doors(draft), _add_exits(draft)
    partitions = [k for plot in plots[1:] for k in between(openings.sides, plots[0].id, plot.id)]
    panes = draw_glazing(openings, partitions, shell.door_height, ranges.glazing[0], generator)
    drawn = {"rooms": count, "corridor": corridor, "depths": depths[: 1 + bool(rows[1])], "length": max(lengths)}
    uses = {plot.id: plot.use for plot in plots}
    return draft.finished({**drawn, "uses": uses, "doors": doors + exits, "glazed": panes})


def _rows(
    ranges: SuiteRanges, shell: Shell, count: int, generator: np.random.Generator
) -> tuple[list[list[tuple[float, float]]], list[float]]:
    """Return the spans of the rooms along the corridor, a list for each of its sides, and the lengths of the rows."""
    module = uniform(generator, ranges.module)
    widths = [round(module * float(generator.choice(MODULES)), 2) for _ in range(count)]
    widths[0] = max(widths[0], round(2.0 * module, 2))
    rows: list[list[float]] = [[], []]
    both = count > LONGEST_ROW or chance(generator, ranges.both[0])
    for width in widths:
        shorter = 1 if both and sum(rows[1]) < sum(rows[0]) else 0
        rows[shorter].append(width)
    lengths = [sum(row) + shell.partition * max(len(row) - 1, 0) for row in rows]
    length = max(lengths)
    spans = []
    for row, own in zip(rows, lengths, strict=True):
        order = [row[k] for k in generator.permutation(len(row))]
        if row and length - own <= STRETCH:
            order[-1] += length - own
        slack = length - sum(order) - shell.partition * max(len(row) - 1, 0)
        at = slack if chance(generator, 0.5) else 0.0
        placed = []
        for width in order:
            placed.append((at, at + width))
            at += width + shell.partition
        spans.append(placed)
    return spans, lengths


def _assigned(outlines: Sequence[tuple[tuple[float, float], ...]], generator: np.random.Generator) -> list[Plot]:
    """Return plots for outlines, the corridor first: the largest room is a laboratory, the others are drawn."""
    plots = [Plot("corridor", "corridor", outlines[0])]
    rooms = [Plot("room", "laboratory", outline) for outline in outlines[1:]]
    largest = max(range(len(rooms)), key=lambda k: rooms[k].area)
    if rooms[largest].area < MAIN_AREA:
        raise UnsuitableError(f"the largest room has {rooms[largest].area:.1f} m²")
    small: tuple[Use, ...] = ("store", "write-up", "instrument")
    large: tuple[Use, ...] = ("laboratory", "laboratory", "instrument", "write-up")
    counts: dict[str, int] = {}
    for k, room in enumerate(rooms):
        offered = ("laboratory",) if k == largest else (small if room.area <= SMALL else large)
        use: Use = offered[int(generator.integers(len(offered)))]
        counts[use] = counts.get(use, 0) + 1
        plots.append(Plot(f"{use}-{counts[use]}", use, room.outline))
    return plots


def _add_doors(draft: Draft[SuiteRanges]) -> list[float]:
    """Add doors to all rooms: from the corridor, second ones to large rooms, and some between neighbors."""
    openings, (corridor, *rooms) = draft.openings, draft.plots
    widths = []
    for room in rooms:
        sides = between(openings.sides, corridor.id, room.id)
        width, first = _add_door(draft, sides, room)
        widths.append(width)
        if room.area > SECOND_EXIT_AREA:
            others = [k for other in rooms if other is not room for k in between(openings.sides, room.id, other.id)]
            widths.append(_add_door(draft, sides + others, room, first)[0])
    for index, room in enumerate(rooms):
        for other in rooms[index + 1 :]:
            sides = between(openings.sides, room.id, other.id)
            if sides and chance(draft.generator, draft.ranges.joined[0]) and not any(openings.on(k) for k in sides):
                widths.append(_add_door(draft, sides, room)[0])
    return widths


def _add_door(
    draft: Draft[SuiteRanges], sides: Sequence[int], room: Plot, first: OpeningPlace | None = None
) -> tuple[float, OpeningPlace]:
    """Add an open door that swings into a room, and return its width and place.

    Args:
        first: another door of the room, from which it is half the diagonal of the room away.
    """
    (width,) = draft.door_widths(1)
    places = draft.openings.places(sides, width, room.id)
    if first is not None:
        places = [place for place in places if math.dist(place.point, first.point) > diagonal([room]) / 2.0]
    place = chosen(places, draft.generator, f"a door of room {room.id!r}")
    draft.openings.add_way(place, width, draft.shell.door_height, "door", room.id)
    return width, place


def _add_exits(draft: Draft[SuiteRanges]) -> list[float]:
    """Add exits: at an end of the corridor, at its other end if that is far enough, and anywhere else."""
    openings, plots = draft.openings, draft.plots
    ends = between(openings.sides, plots[0].id, OUTSIDE)
    anywhere = [k for plot in plots for k in between(openings.sides, plot.id, OUTSIDE)]
    apart = diagonal(plots) / 2.0
    second = ends if max(math.dist(*edge) for edge in plots[0].edges) > apart + 1.0 else anywhere
    count = integer(draft.generator, draft.ranges.exits)
    widest = min(openings.sides[k].length for k in ends) - 2.0 * ENDS
    widths = [min(width, round(widest - 0.005, 2)) for width in draft.door_widths(count)]
    allowed = [ends, second, *([anywhere] * (count - 2))]
    draft.add_exits(allowed, widths, ENDS)
    return widths
