"""Refits: a laboratory in an old building, with columns, chamfered corners, narrow aisles and an oblique wing."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np

from labgym.geometry import BoxArray, OrientedBox, pairwise_distance, rotate
from labgym.layouts.floor import Column
from labgym.layouts.floors.building import Draft, FloorDraw, Shell
from labgym.layouts.floors.openings import UnsuitableError, between, chosen
from labgym.layouts.floors.plots import Outline, Plot, Point, Use, extent, posed
from labgym.layouts.floors.ranges import KINDS, BuildingRanges, Limits, chance, integer, uniform
from labgym.layouts.floors.sides import OUTSIDE

WAY = (1.2, 2.0)
"""Range of the width of a passage into the wing, meters (assumption)."""
WING_USES: tuple[Use, ...] = ("laboratory", "instrument", "store", "write-up")
BESIDE_WALL = 1.0
"""A column that would stand nearer to a wall than this stands against it, meters, so that no slit is left."""


@dataclass(frozen=True)
class RefitRanges(BuildingRanges):
    """Ranges of refits."""

    exterior: Annotated[Limits, "thickness of walls, m", "assumption: load-bearing masonry"] = (0.35, 0.60)
    height: Annotated[Limits, "ceiling height, m", "assumption: buildings before 1940"] = (3.00, 4.20)
    width: Annotated[Limits, "width of the hall, m", "assumption"] = (8.0, 15.0)
    depth: Annotated[Limits, "depth of the hall, along the wall of the wing, m", "assumption"] = (7.0, 12.0)
    chamfers: Annotated[tuple[int, int], "number of chamfered corners of the hall", "assumption"] = (1, 3)
    chamfer: Annotated[Limits, "length that a chamfer takes from each wall, m", "assumption"] = (0.5, 1.2)
    wing_width: Annotated[Limits, "width of the wing, m", "JGJ 91: a bay of 6.6 m, at least half of one"] = (3.6, 6.0)
    wing_length: Annotated[Limits, "length of the shorter wall of the wing, m", "assumption"] = (4.0, 9.0)
    wing_angle: Annotated[Limits, "angle of the wing to the hall, degrees", "assumption: 3 to 15 degrees"] = (3.0, 15.0)
    column: Annotated[Limits, "side of a column, m", "assumption: masonry piers and cast columns"] = (0.30, 0.60)
    grid: Annotated[Limits, "spacing of columns, m", "assumption: spans of timber and cast-iron floors"] = (3.6, 6.0)
    floor_area: Annotated[Limits, "floor area of hall and wing, m²", "assumption"] = (80.0, 240.0)
    exits: Annotated[tuple[int, int], "number of exits", "NFPA 101, 7.5.1.3: two, half the diagonal apart"] = (2, 3)
    aisle: Annotated[Limits, "clear width between furniture, m", "BG RCI 6.2.1: 0.90 m for circulation"] = (0.90, 1.20)
    islands: Annotated[tuple[str, ...], KINDS, "assumption"] = ("oblique", "peninsula", "island")


def refit(generator: np.random.Generator, ranges: RefitRanges) -> FloorDraw:
    """Return a refit, turned and mirrored at random.

    Raises:
        UnsuitableError: the area is out of range, the wing does not fit the hall, or a door fits nowhere.
    """
    shell = Shell.drawn(ranges, generator)
    width, depth = uniform(generator, ranges.width), uniform(generator, ranges.depth)
    corners = sorted(int(k) for k in generator.permutation(4)[: integer(generator, ranges.chamfers)])
    legs = {corner: uniform(generator, ranges.chamfer) for corner in corners}
    angle = uniform(generator, ranges.wing_angle, 0.1) * float(generator.choice([-1.0, 1.0]))
    wing = uniform(generator, ranges.wing_width), uniform(generator, ranges.wing_length)
    use = WING_USES[int(generator.integers(len(WING_USES)))]
    free = legs.get(1, 0.0), depth - legs.get(2, 0.0)
    low = _wing_start(free, wing[0] / math.cos(math.radians(angle)), generator)
    hall = Plot("hall", "laboratory", _chamfered(width, depth, legs))
    outline = _wing((width + shell.exterior, low), wing, math.radians(angle))
    plots = posed((hall, Plot("wing", use, outline, math.radians(angle))), generator)
    area = sum(plot.area for plot in plots)
    if not ranges.floor_area[0] <= area <= ranges.floor_area[1]:
        raise UnsuitableError(f"the floor has {area:.1f} m²")
    draft = Draft.of(plots, shell, ranges, generator)
    way = _join(draft)
    exits = integer(generator, ranges.exits)
    doors = draft.door_widths(exits)
    own = [between(draft.openings.sides, plot.id, OUTSIDE) for plot in plots]
    draft.add_exits([own[0], *([own[0] + own[1]] * (exits - 1))], doors)
    columns = _columns(draft)
    drawn = {"width": width, "depth": depth, "chamfers": {str(k): leg for k, leg in legs.items()}, "angle": angle}
    drawn |= {"wing": list(wing), "use": use, "way": way, "doors": doors, "columns": len(columns)}
    return draft.finished(drawn, columns)


def _chamfered(width: float, depth: float, legs: dict[int, float]) -> Outline:
    """Return a rectangle with some corners cut off, numbered counter-clockwise from the origin."""
    corners = (0.0, 0.0), (width, 0.0), (width, depth), (0.0, depth)
    along: tuple[Point, ...] = (1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)
    outline: list[Point] = []
    for k, (x, y) in enumerate(corners):
        if k in legs:
            (ax, ay), (bx, by) = along[k - 1], along[k]
            outline += [(x - legs[k] * ax, y - legs[k] * ay), (x + legs[k] * bx, y + legs[k] * by)]
        else:
            outline.append((x, y))
    return tuple(outline)


def _wing_start(free: tuple[float, float], length: float, generator: np.random.Generator) -> float:
    """Return where along a wall of the hall the wing begins.

    Raises:
        UnsuitableError: the wall is too short.
    """
    if free[1] - free[0] < length:
        raise UnsuitableError(f"the wing takes {length:.2f} m of the hall's wall of {free[1] - free[0]:.2f} m")
    return float(generator.uniform(free[0], free[1] - length))


def _wing(start: Point, size: tuple[float, float], angle: float) -> Outline:
    """Return the outline of a wing to the right of a wall that runs along y: its near edge is parallel to the wall.

    Args:
        start: lower end of the near edge.
        size: width of the wing, and length of its shorter side.
    """
    (x, y), (width, length) = start, size
    near = width / math.cos(angle)
    offset = near * math.sin(angle)  # by how much the far edge, square to the wing, is nearer to the upper end
    lower, upper = length + max(offset, 0.0), length + max(-offset, 0.0)
    (lx, ly), (ux, uy) = rotate(lower, 0.0, angle), rotate(upper, 0.0, angle)
    return (x, y), (x + lx, y + ly), (x + ux, y + near + uy), (x, y + near)


def _join(draft: Draft[RefitRanges]) -> str:
    """Add a door or a passage between hall and wing and return its kind; the door opens into the hall."""
    openings, generator = draft.openings, draft.generator
    wide = chance(generator, 0.5)
    width = uniform(generator, WAY if wide else draft.ranges.door, 0.05)
    places = openings.places(between(openings.sides, "hall", "wing"), width, "hall")
    place = chosen(places, generator, "a way into the wing")
    kind: Literal["door", "passage"] = "passage" if wide else "door"
    openings.add_way(place, width, draft.shell.door_height, kind, "hall")
    return kind


def _columns(draft: Draft[RefitRanges]) -> tuple[Column, ...]:
    """Return columns on a grid in the hall, away from doors; those near a wall stand against it."""
    hall, ranges, generator = draft.plots[0], draft.ranges, draft.generator
    x0, y0, x1, y1 = extent([hall.outline])
    side = uniform(generator, ranges.column, 0.05)
    pitch = uniform(generator, ranges.grid), uniform(generator, ranges.grid)
    start = [float(generator.uniform(0.3, 0.7)) * step for step in pitch]
    columns: list[Column] = []
    for x in _lines(x0, x1, start[0], pitch[0], side):
        for y in _lines(y0, y1, start[1], pitch[1], side):
            box = OrientedBox(x, y, side, side)
            inside = all(_left_of(edge, (x, y)) >= side / 2.0 - 1e-6 for edge in hall.edges)
            if inside and _away(box, hall, draft.openings.zones):
                columns.append(Column(id=f"column-{len(columns) + 1}", x=x, y=y, width=side, depth=side))
    return tuple(columns)


def _lines(low: float, high: float, start: float, pitch: float, side: float) -> list[float]:
    """Coordinates of columns along one axis."""
    lines = []
    for at in np.arange(low + start, high, pitch):
        middle = float(at)
        if middle - side / 2.0 - low < BESIDE_WALL:
            middle = low + side / 2.0
        elif high - middle - side / 2.0 < BESIDE_WALL:
            middle = high - side / 2.0
        lines.append(round(middle, 4))
    return sorted(set(lines))


def _away(box: OrientedBox, hall: Plot, zones: Sequence[OrientedBox]) -> bool:
    """Whether a column keeps clear of doors and of oblique walls."""
    if zones and pairwise_distance(BoxArray.of([box]), BoxArray.of(zones)).min() < 0.3:
        return False
    oblique = [e for e in hall.edges if min(abs(e[1][0] - e[0][0]), abs(e[1][1] - e[0][1])) > 0.01]
    return all(_left_of(edge, (box.x, box.y)) > BESIDE_WALL + box.width for edge in oblique)


def _left_of(edge: tuple[Point, Point], point: Point) -> float:
    """Distance of a point to the left of a line, meters."""
    (ax, ay), (bx, by) = edge
    return ((bx - ax) * (point[1] - ay) - (by - ay) * (point[0] - ax)) / math.dist(*edge)
