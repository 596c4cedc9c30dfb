"""Sides: the stretches of wall along the edges of plots. Lengths in meters."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from labgym.layouts.floor import Opening, Wall
from labgym.layouts.floors.plots import Plot, Point

OUTSIDE = "outside"
THICKEST = 0.7
"""Plots whose edges face each other within this distance share a wall, meters."""
SAME = 1e-6
SHORT = 0.6
"""An exterior stretch shorter than this is joined to the shared wall next to it, meters: the end of a partition."""


@dataclass(frozen=True)
class PlotSide:
    """A straight stretch of wall; its space lies on the left.

    Attributes:
        start, end: ends on the face of the wall in `space`.
        space, neighbor: ids of the spaces on its left and right; "outside" for none.
        clear: interval along the side, from its start, in which openings lead from one to the other.
    """

    start: Point
    end: Point
    thickness: float
    space: str
    neighbor: str
    clear: tuple[float, float]

    @cached_property
    def length(self) -> float:
        """Length."""
        return math.dist(self.start, self.end)

    @cached_property
    def direction(self) -> Point:
        """Unit vector from start to end."""
        return (self.end[0] - self.start[0]) / self.length, (self.end[1] - self.start[1]) / self.length

    @property
    def yaw(self) -> float:
        """Direction from start to end, radians; also the yaw of an object in `space` with its back to the wall."""
        return math.atan2(self.end[1] - self.start[1], self.end[0] - self.start[0])

    def point(self, along: float, inward: float = 0.0) -> Point:
        """Return the point at a distance along the side, and from its face into the space."""
        dx, dy = self.direction
        return self.start[0] + along * dx - inward * dy, self.start[1] + along * dy + inward * dx

    def wall(self, height: float, openings: Sequence[Opening]) -> Wall:
        """Return the wall between the ends of the side."""
        (x0, y0), (x1, y1) = (self.point(along, -self.thickness / 2.0) for along in (0.0, self.length))
        return Wall(
            start=(round(x0, 6), round(y0, 6)),
            end=(round(x1, 6), round(y1, 6)),
            thickness=self.thickness,
            height=height,
            openings=tuple(sorted(openings, key=lambda opening: opening.position)),
        )


def sides_of(plots: Sequence[Plot], exterior: float) -> tuple[PlotSide, ...]:
    """Return the sides around plots: one for each pair of facing edges, and the exterior ones.

    Two plots share a wall where their edges run parallel and face each other at the wall's thickness. The first of the
    two has it on its left.

    Args:
        exterior: thickness of the walls that no other plot shares.
    """
    sides: list[PlotSide] = []
    for index, plot in enumerate(plots):
        edges = [list(_stretches(plots, index, edge, exterior)) for edge in range(len(plot.outline))]
        for edge, stretches in enumerate(edges):
            previous, following = edges[edge - 1][-1], edges[(edge + 1) % len(edges)][0]
            for stretch in stretches:
                low, high = stretch.clear
                # Where another wall ends at this one, or fills the inner corner of an L, it takes its thickness.
                if stretch is not stretches[0] or _turn(previous, stretch) < -SAME:
                    low = max(low, exterior if stretch.neighbor == OUTSIDE else 0.0)
                if stretch is not stretches[-1] or _turn(stretch, following) < -SAME:
                    high = min(high, stretch.length - (exterior if stretch.neighbor == OUTSIDE else 0.0))
                if stretch.space != OUTSIDE:  # otherwise an earlier plot has it
                    sides.append(replace(stretch, clear=(low, high)))
    return tuple(sides)


def _stretches(plots: Sequence[Plot], index: int, edge: int, exterior: float) -> Iterator[PlotSide]:
    """Split an edge where its neighbor changes; stretches of an earlier plot have the space "outside"."""
    plot = plots[index]
    start, end = plot.edges[edge]
    whole = PlotSide(start, end, exterior, plot.id, OUTSIDE, (0.0, math.dist(start, end)))
    pieces: list[tuple[float, float, PlotSide]] = []
    at = 0.0
    for low, high, other, gap in sorted(_facing(plots, index, whole)):
        if low - at > SAME:
            pieces.append((at, low, whole))
        owner = plot.id if index < other else OUTSIDE
        pieces.append((low, high, replace(whole, thickness=gap, neighbor=plots[other].id, space=owner)))
        at = high
    if whole.length - at > SAME:
        pieces.append((at, whole.length, whole))
    for low, high, side, clear in _joined(pieces):
        yield replace(side, start=whole.point(low), end=whole.point(high), clear=(clear[0] - low, clear[1] - low))


def _joined(pieces: list[tuple[float, float, PlotSide]]) -> list[tuple[float, float, PlotSide, tuple[float, float]]]:
    """Return pieces of an edge with short exterior ones joined to the shared piece before or after them."""
    joined = [(low, high, side, (low, high)) for low, high, side in pieces]
    at = 0
    while at < len(joined):
        low, high, side, _ = joined[at]
        short = side.neighbor == OUTSIDE and high - low < SHORT
        if short and at > 0 and _is_shared(joined[at - 1][2]):
            before = joined[at - 1]
            joined[at - 1 : at + 1] = [(before[0], high, before[2], before[3])]
        elif short and at + 1 < len(joined) and _is_shared(joined[at + 1][2]):
            after = joined[at + 1]
            joined[at : at + 2] = [(low, after[1], after[2], after[3])]
        else:
            at += 1
    return joined


def _is_shared(side: PlotSide) -> bool:
    return OUTSIDE not in (side.space, side.neighbor)


def _facing(plots: Sequence[Plot], index: int, side: PlotSide) -> Iterator[tuple[float, float, int, float]]:
    """Yield the intervals of an edge that another plot's edge faces: low, high, plot, distance."""
    dx, dy = side.direction
    for other, plot in enumerate(plots):
        if other == index:
            continue
        for (ax, ay), (bx, by) in plot.edges:
            length = math.dist((ax, ay), (bx, by))
            if (bx - ax) * dx + (by - ay) * dy > -length * (1.0 - SAME):
                continue
            gap = (ax - side.start[0]) * dy - (ay - side.start[1]) * dx
            low = (bx - side.start[0]) * dx + (by - side.start[1]) * dy
            low, high = max(low, 0.0), min(low + length, side.length)
            if SAME < gap <= THICKEST and high - low > SAME:
                yield low, high, other, round(gap, 6)


def _turn(first: PlotSide, second: PlotSide) -> float:
    """Angle by which the second edge turns left from the first, radians."""
    (ax, ay), (bx, by) = first.direction, second.direction
    return math.atan2(ax * by - ay * bx, ax * bx + ay * by)
