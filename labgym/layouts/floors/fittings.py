"""Windows, glazed partitions, finishes, service points and panel clearances of a floor. Lengths in meters."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from labgym.geometry import BoxArray, OrientedBox, pairwise_penetration
from labgym.layouts.floor import Finishes, KeepOut, Service
from labgym.layouts.floors.openings import LINTEL, Openings, add_windows, chosen
from labgym.layouts.floors.plots import Plot
from labgym.layouts.floors.ranges import BuildingRanges, chance, uniform
from labgym.layouts.floors.sides import OUTSIDE
from labgym.layouts.floors.style import HoodWall

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
