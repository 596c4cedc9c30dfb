"""Places doors, passages, windows and glazed parts in the sides of plots. Lengths in meters."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from labgym.errors import LabgymError
from labgym.geometry import BoxArray, OrientedBox, pairwise_penetration
from labgym.layouts.floor import Opening, Wall
from labgym.layouts.floors.plots import Point
from labgym.layouts.floors.sides import OUTSIDE, Side

CORNER = 0.25
"""Least distance of an opening from a corner: room for a door's frame."""
GAP = 0.15
"""Least distance between two openings of a wall."""
SWING = 1.2
"""Side of the square inside a door that nothing else may take: its leaf and a person next to it."""
APPROACH = 0.6
"""Depth of the same area on the side to which the leaf does not open."""
PITCH = 0.05
"""Spacing of the places tried along a side."""
LINTEL = 0.15
"""Least height of wall above an opening."""


class UnsuitableError(LabgymError):
    """A draw that its family's rules refuse; the family draws again."""


@dataclass(frozen=True)
class Place:
    """A place for an opening: its side, the distance of its middle along it, and the point on the side's face."""

    side: int
    along: float
    point: Point


class Openings:
    """The openings of the sides of a floor, as they are added one by one.

    Attributes:
        sides: the sides.
        zones: floor areas that the doors added so far keep free.
    """

    def __init__(self, sides: Sequence[Side]) -> None:
        self.sides = tuple(sides)
        self.zones: list[OrientedBox] = []
        self._openings: list[list[Opening]] = [[] for _ in self.sides]

    def on(self, index: int) -> tuple[Opening, ...]:
        """Return the openings of a side; their positions are counted from its start."""
        return tuple(self._openings[index])

    def places(self, indices: Iterable[int], width: float, swing: float = SWING, corner: float = CORNER) -> list[Place]:
        """Return the places, every `PITCH`, where a door or passage of a width fits on some sides.

        Args:
            swing: depth of the area inside it that other doors leave free; 0 for windows, which need none.
            corner: least distance from a corner.
        """
        places = []
        for index in indices:
            side = self.sides[index]
            low, high = side.clear[0] + corner + width / 2.0, side.clear[1] - corner - width / 2.0
            alongs = np.round(np.arange(low, high + 1e-9, PITCH), 3)
            places += [Place(index, float(at), side.point(float(at))) for at in alongs if self._fits(index, at, width)]
        if not self.zones or not swing or not places:
            return places
        before = [self._zone(place, width, swing, True) for place in places]
        behind = [self._zone(place, width, APPROACH, False) for place in places]
        taken = BoxArray.of(self.zones)
        hits = [(pairwise_penetration(BoxArray.of(zones), taken) > 0.0).any(axis=1) for zones in (before, behind)]
        return [place for place, hit in zip(places, hits[0] | hits[1], strict=True) if not hit]

    def add_way(
        self,
        place: Place,
        width: float,
        height: float,
        kind: Literal["door", "passage"] = "door",
        into: Literal["left", "right"] = "left",
        state: Literal["open", "closed"] = "closed",
    ) -> None:
        """Add a door or a passage; the hinge of a door is at its end nearer to a corner."""
        side = self.sides[place.side]
        hinge: Literal["start", "end"] = "start" if place.along < side.length / 2.0 else "end"
        opening = Opening(kind=kind, position=place.along, width=width, height=height, hinge=hinge)
        if kind == "door":
            opening = opening.model_copy(update={"swing": into, "state": state})
        self._openings[place.side].append(opening)
        depth = {into: SWING, "left" if into == "right" else "right": APPROACH}
        self.zones.append(self._zone(place, width, depth["left"], True))
        if side.neighbor != OUTSIDE:
            self.zones.append(self._zone(place, width, depth["right"], False))

    def add_pane(
        self, index: int, kind: Literal["window", "glazing"], along: float, width: float, sill: float, height: float
    ) -> bool:
        """Add a window or a glazed part if it fits; return whether it did."""
        low, high = (end + sign * CORNER for end, sign in zip(self.sides[index].clear, (1.0, -1.0), strict=True))
        if along - width / 2.0 < low or along + width / 2.0 > high or not self._fits(index, along, width):
            return False
        pane = Opening(kind=kind, position=round(along, 3), width=width, height=round(height, 3), sill=sill)
        self._openings[index].append(pane)
        return True

    def walls(self, height: float) -> tuple[Wall, ...]:
        """Return the walls with their openings, in the order of the sides."""
        return tuple(side.wall(height, openings) for side, openings in zip(self.sides, self._openings, strict=True))

    def _fits(self, index: int, along: float, width: float) -> bool:
        return all(abs(along - o.position) >= (width + o.width) / 2.0 + GAP for o in self._openings[index])

    def _zone(self, place: Place, width: float, depth: float, left: bool) -> OrientedBox:
        """The floor inside a door, on the left or the right of its side."""
        side = self.sides[place.side]
        inward = depth / 2.0 if left else -side.thickness - depth / 2.0
        x, y = side.point(place.along, inward)
        return OrientedBox(x, y, max(width, SWING), depth, side.yaw)


def between(sides: Sequence[Side], first: str, second: str) -> list[int]:
    """Return the sides that separate two spaces, one of which may be "outside"."""
    return [k for k, side in enumerate(sides) if {side.space, side.neighbor} == {first, second}]


def chosen(places: Sequence[Place], generator: np.random.Generator, what: str) -> Place:
    """Return a place: the side drawn uniformly from those with places, then the place on it.

    Raises:
        UnsuitableError: there is none.
    """
    if not places:
        raise UnsuitableError(f"no place for {what}")
    sides = sorted({place.side for place in places})
    side = sides[int(generator.integers(len(sides)))]
    on_side = [place for place in places if place.side == side]
    return on_side[int(generator.integers(len(on_side)))]


def add_exits(
    openings: Openings,
    sides: Sequence[Sequence[int]],
    widths: Sequence[float],
    height: float,
    apart: float,
    generator: np.random.Generator,
    corner: float = CORNER,
) -> list[Place]:
    """Add exits and return their places.

    Args:
        sides: for each exit the sides on which it may be.
        widths: clear width of each exit.
        apart: least distance between the first two, half the diagonal of what they serve (NFPA 101, 7.5.1.3).

    Raises:
        UnsuitableError: one of them fits nowhere.
    """
    exits: list[Place] = []
    for number, (allowed, width) in enumerate(zip(sides, widths, strict=True)):
        least = apart if number == 1 else 2.0
        places = [
            place
            for place in openings.places(allowed, width, corner=corner)
            if all(math.dist(place.point, other.point) > least for other in exits)
        ]
        place = chosen(places, generator, f"exit {number + 1}")
        openings.add_way(place, width, height)
        exits.append(place)
    return exits


def add_windows(
    openings: Openings,
    indices: Iterable[int],
    share: float,
    width: float,
    sill: float,
    height: float,
) -> None:
    """Add evenly spaced windows to sides, leaving out those that meet a door.

    Args:
        share: share of a side's length that windows take.
    """
    for index in indices:
        low, high = openings.sides[index].clear
        count = math.floor((high - low) * share / width)
        for k in range(count):
            openings.add_pane(index, "window", low + (k + 0.5) * (high - low) / count, width, sill, height)
