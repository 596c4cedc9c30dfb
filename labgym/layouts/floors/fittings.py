"""Windows, finishes, service points, panel clearances and styles of floors, drawn once their doors stand. Meters."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any, Literal, get_args

import numpy as np

from labgym.errors import OptionError
from labgym.geometry import BoxArray, OrientedBox, pairwise_penetration
from labgym.layouts.floor import Finishes, KeepOut, Service
from labgym.layouts.floor.fields import HOOD_DOOR_LEAST
from labgym.layouts.floors.openings import LINTEL, Openings, add_windows, chosen
from labgym.layouts.floors.plots import Plot
from labgym.layouts.floors.ranges import BuildingRanges, chance, uniform
from labgym.layouts.floors.sides import OUTSIDE

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


WINDOW_WIDTH, WINDOW_SILL, WINDOW_TOP = (0.9, 2.4), (0.9, 1.2), (2.1, 2.5)
"""Ranges of windows: width, and height of the lower and upper edge (assumptions; a bench top is at 0.90 m)."""
NARROWEST_PANE, WIDEST_PANE = 0.9, 3.0
"""Least and greatest width of a glazed part (assumption)."""
PANEL = (0.76, 0.91)
"""Width and depth of the floor that stays free before an electrical panel (NFPA 70, 110.26)."""
TRAINED: dict[str, tuple[str | None, ...]] = {
    "floor": ("vinyl", "epoxy", "tile"),
    "walls": ("white", "cream", "gray"),
    "accent": ("teal", "navy", "ochre", None),
    "accent_wall": ("opposite", "left", "right", "door"),
    "worktop": ("white", "gray", "black"),
    "fronts": ("white", "oak", "blue", "gray"),
    "doors": ("gray", "white", "oak"),
    "blinds": ("none", "roller"),
}
HELD_OUT: dict[str, tuple[str | None, ...]] = {
    "floor": ("terrazzo", "concrete"),
    "walls": ("sage", "sky"),
    "accent": ("brick", "graphite", None),
    "accent_wall": ("opposite", "left", "right", "door"),
    "worktop": ("sand", "slate"),
    "fronts": ("walnut", "mint"),
    "doors": ("walnut", "green"),
    "blinds": ("none", "slats"),
}
"""Finishes that training draws from, and those that only held-out floors have."""
SHELL = ("floor", "walls", "accent")
"""Finishes that are drawn from a floor's own random generator; the others have a separate one."""
SPACING = {"exhaust": 2.4, "water": 4.0, "gas": 4.0, "power": 3.0}
"""Distance between service points along a wall (assumption: one or two modules)."""
LEVEL = {"water": 0.6, "gas": 1.0, "power": 1.1}
"""Height of service points; exhaust is at the ceiling (assumption: below and above a worktop)."""


def draw_windows(
    openings: Openings,
    plots: Sequence[Plot],
    ranges: BuildingRanges,
    height: float,
    generator: np.random.Generator,
    bare: Sequence[int] = (),
) -> float:
    """Add windows to exterior walls and return the share of wall that was drawn for them.

    Args:
        height: of the walls.
        bare: sides without windows, where hoods stand (NFPA 45: hoods away from openable windows).
    """
    share = uniform(generator, ranges.windows)
    width, sill = uniform(generator, WINDOW_WIDTH, 0.1), uniform(generator, WINDOW_SILL, 0.05)
    top = min(uniform(generator, WINDOW_TOP, 0.05), height - LINTEL)
    daylit = {plot.id for plot in plots if plot.use not in ("store", "corridor")}
    exterior = [
        k
        for k, side in enumerate(openings.sides)
        if side.neighbor == OUTSIDE and side.space in daylit and k not in bare
    ]
    add_windows(openings, exterior, share, width, sill, top - sill)
    return share


def draw_glazing(
    openings: Openings, indices: Sequence[int], top: float, probability: float, generator: np.random.Generator
) -> int:
    """Add a glazed part to some shared walls, each with a probability; return how many were added.

    Args:
        top: height of the upper edge of the glass, that of the doors.
    """
    added = 0
    for index in indices:
        if not chance(generator, probability):
            continue
        low, high = openings.sides[index].clear
        widest = uniform(generator, (NARROWEST_PANE, max(NARROWEST_PANE, min(WIDEST_PANE, 0.6 * (high - low)))))
        sill = float(generator.choice([0.0, 0.9]))
        for width in (widest, widest / 2.0, NARROWEST_PANE):
            places = openings.gaps([index], width)
            if width >= NARROWEST_PANE and places:
                place = chosen(places, generator, "a glazed part")
                added += openings.add_pane(index, "glazing", place.along, round(width, 2), sill, top - sill)
                break
    return added


def draw_finishes(ranges: BuildingRanges, generator: np.random.Generator) -> Finishes:
    """Return finishes drawn from those of training, or from the held-out ones."""
    offered = HELD_OUT if ranges.held_out else TRAINED
    (surfaces,) = generator.spawn(1)
    picked = {}
    for name, words in offered.items():
        source = generator if name in SHELL else surfaces
        picked[name] = words[int(source.integers(len(words)))]
    return Finishes.model_validate(picked)


def draw_services(
    openings: Openings, plots: Sequence[Plot], hoods: Sequence[HoodWall], height: float
) -> tuple[Service, ...]:
    """Return service points: exhaust along the two walls that hoods prefer, power, water and gas along all walls."""
    laboratories = {plot.id for plot in plots if plot.use in ("laboratory", "instrument")}
    ducts = {(hood.space, hood.wall) for space in laboratories for hood in [h for h in hoods if h.space == space][:2]}
    services = []
    for index, side in enumerate(openings.sides):
        for space, inward in ((side.space, 0.02), (side.neighbor, -side.thickness - 0.02)):
            if space not in laboratories:
                continue
            kinds = ["power", "water", "gas"] + (["exhaust"] if (space, index) in ducts else [])
            for kind in kinds:
                services += _along(openings, index, kind, inward, height)
    return tuple(services[:500])


def panel_area(openings: Openings, plots: Sequence[Plot], generator: np.random.Generator) -> tuple[KeepOut, ...]:
    """Return the area before the electrical panel of a laboratory, or none: half of the floors have one."""
    laboratories = {plot.id for plot in plots if plot.use == "laboratory"}
    width, depth = PANEL
    boxes = [
        OrientedBox(
            *openings.sides[place.side].point(place.along, depth / 2.0), width, depth, openings.sides[place.side].yaw
        )
        for place in openings.gaps(range(len(openings.sides)), width)
        if openings.sides[place.side].space in laboratories
    ]
    if openings.zones and boxes:
        taken = pairwise_penetration(BoxArray.of(boxes), BoxArray.of(openings.zones)).max(axis=1) > 0.0
        boxes = [box for box, hit in zip(boxes, taken, strict=True) if not hit]
    if not boxes or chance(generator, 0.5):
        return ()
    box = boxes[int(generator.integers(len(boxes)))]
    reason = "working space before the electrical panel (NFPA 70, 110.26)"
    area = KeepOut(
        id="panel", x=round(box.x, 6), y=round(box.y, 6), yaw=box.yaw, width=width, depth=depth, reason=reason
    )
    return (area,)


def _along(openings: Openings, index: int, kind: str, inward: float, height: float) -> list[Service]:
    """Service points of a kind, evenly spaced along a side where it has no opening."""
    low, high = openings.sides[index].clear
    count = max(1, math.floor((high - low) / SPACING[kind]))
    points = []
    for k in range(count):
        along = low + (k + 0.5) * (high - low) / count
        if all(abs(along - o.position) > o.width / 2.0 + 0.1 for o in openings.on(index)):
            x, y = openings.sides[index].point(along, inward)
            z = LEVEL.get(kind, height - 0.1)
            points.append(Service.model_validate({"kind": kind, "x": round(x, 4), "y": round(y, 4), "z": round(z, 4)}))
    return points
