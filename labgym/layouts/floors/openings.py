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
from labgym.layouts.floors.sides import OUTSIDE, PlotSide

CORNER = 0.25
"""Least distance of an opening from a corner: room for a door's frame."""
GAP = 0.15
"""Least distance between two openings of a wall."""
SWING = 1.2
"""Side of the square inside a door that nothing else may take: its leaf and a person next to it."""
APPROACH = 0.6
"""Depth of the same area on the side to which the leaf does not open."""
PITCH = 0.1
"""Spacing of the places tried along a side."""
LINTEL = 0.15
"""Least height of wall above an opening."""


class UnsuitableError(LabgymError):
    """A draw that its family's rules refuse; the family draws again."""


@dataclass(frozen=True)
class OpeningPlace:
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

    def __init__(self, sides: Sequence[PlotSide]) -> None:
        self.sides = tuple(sides)
        self.zones: list[OrientedBox] = []
        self._openings: list[list[Opening]] = [[] for _ in self.sides]

    def on(self, index: int) -> tuple[Opening, ...]:
        """Return the openings of a side; their positions are counted from its start."""
        return tuple(self._openings[index])

    def places(
        self, indices: Iterable[int], width: float, into: str | None = None, corner: float = CORNER
    ) -> list[OpeningPlace]:
        """Return the places, every `PITCH`, where a door or passage of a width fits on some sides.

        Args:
            into: space into which a door opens; None for the space of the side.
            corner: least distance from a corner.
        """
        places = self.gaps(indices, width, corner)
        if not self.zones or not places:
            return places
        opens_left = [into in (None, self.sides[place.side].space) for place in places]
        before = [
            self._zone(p, width, SWING if left else APPROACH, True) for p, left in zip(places, opens_left, strict=True)
        ]
        behind = [
            self._zone(p, width, APPROACH if left else SWING, False) for p, left in zip(places, opens_left, strict=True)
        ]
        taken = BoxArray.of(self.zones)
        depths = [pairwise_penetration(BoxArray.of(zones), taken).max(axis=1) for zones in (before, behind)]
        return [place for place, depth in zip(places, np.maximum(*depths).tolist(), strict=True) if depth <= 0.0]

    def gaps(self, indices: Iterable[int], width: float, corner: float = CORNER) -> list[OpeningPlace]:
        """Return the places, every `PITCH`, where an opening of a width meets no other one and no corner."""
        places = []
        for index in indices:
            side = self.sides[index]
            low, high = side.clear[0] + corner + width / 2.0, side.clear[1] - corner - width / 2.0
            alongs = np.round(np.arange(low, high + 1e-9, PITCH), 3).tolist()
            places += [
                OpeningPlace(index, along, side.point(along)) for along in alongs if self._fits(index, along, width)
            ]
        return places

    def add_way(
        self,
        place: OpeningPlace,
        width: float,
        height: float,
        kind: Literal["door", "passage"] = "door",
        into: str | None = None,
    ) -> None:
        """Add a door or a passage; the hinge of a door is at its end nearer to a corner.

        Exits open outward (NFPA 101, 7.2.1.4.2: in the direction of egress from high hazards).

        Args:
            into: space into which an interior door opens; None for the space of the side. Interior doors are open.
        """
        side = self.sides[place.side]
        left = into in (None, side.space)
        opening = Opening(
            kind=kind,
            position=place.along,
            width=width,
            height=height,
            hinge="start" if place.along < side.length / 2.0 else "end",
            swing="left" if left and side.neighbor != OUTSIDE else "right",
            state="closed" if side.neighbor == OUTSIDE or kind == "passage" else "open",
        )
        self._openings[place.side].append(opening)
        self.zones.append(self._zone(place, width, SWING if left else APPROACH, True))
        if side.neighbor != OUTSIDE:
            self.zones.append(self._zone(place, width, APPROACH if left else SWING, False))

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

    def _zone(self, place: OpeningPlace, width: float, depth: float, left: bool) -> OrientedBox:
        """The floor inside a door, on the left or the right of its side."""
        side = self.sides[place.side]
        inward = depth / 2.0 if left else -side.thickness - depth / 2.0
        x, y = side.point(place.along, inward)
        return OrientedBox(x, y, max(width, SWING), depth, side.yaw)


def between(sides: Sequence[PlotSide], first: str, second: str) -> list[int]:
    """Return the sides that separate two spaces, one of which may be "outside"."""
    return [k for k, side in enumerate(sides) if {side.space, side.neighbor} == {first, second}]


def chosen(places: Sequence[OpeningPlace], generator: np.random.Generator, what: str) -> OpeningPlace:
    """Return a place: the side drawn uniformly from those with places, then the place on it.

    Raises:
        UnsuitableError: the list is empty.
    """
    if not places:
        raise UnsuitableError(f"no place for {what}")
    sides = sorted({place.side for place in places})
    side = sides[int(generator.integers(len(sides)))]
    on_side = [place for place in places if place.side == side]
    return on_side[int(generator.integers(len(on_side)))]


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
