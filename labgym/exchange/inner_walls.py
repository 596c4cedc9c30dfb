"""Chooses among walls that a map seems to show those that can stand together."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

from labgym.exchange.drawing import Mark
from labgym.exchange.strips import Strip

if TYPE_CHECKING:
    from shapely import LineString, Polygon

APART = 0.6
"""Least distance between the faces of parallel walls, meters: behind what is nearer, nobody can stand."""
SIDEWAYS = 0.1
"""Largest sine of the angle between walls that are compared as parallel ones."""


@dataclass(frozen=True)
class InnerWall:
    """A wall that a map seems to show.

    Attributes:
        strip: from end to end, with its gaps. marks: the passages in it.
        solid: length without gaps, meters.
        held: whether it begins, and whether it ends, at another wall.
    """

    strip: Strip
    marks: tuple[Mark, ...]
    solid: float
    held: tuple[bool, bool]

    @property
    def line(self) -> LineString:
        """The middle line, meters."""
        from shapely import LineString

        return LineString([self.strip.start, self.strip.end])

    @property
    def body(self) -> Polygon:
        """The area of the wall, gaps included."""
        return self.line.buffer(self.strip.thickness / 2.0, cap_style="flat")


def standing(walls: Sequence[InnerWall], doors: Sequence[Mark], inner: Polygon, cell: float) -> list[InnerWall]:
    """Return the walls that can stand together; rows of furniture that look like walls are the others.

    Of two parallel walls less than 0.6 m apart, the one with the longer solid part stands, and none stands that near
    along an outer wall. No wall stands in a passage of a longer one or in an outer door. What was taken for a wall at
    the end of another may fall itself; then the other one falls with it.

    Args:
        doors: gaps in the outer walls. inner: area between the outer walls, meters.
        cell: side of a cell of the map, meters.
    """
    possible = [wall for wall in walls if not _along_outer(wall, inner) and not any(_blocks(wall, at) for at in doors)]
    possible.sort(key=lambda wall: (-wall.solid, wall.strip.start, wall.strip.end))
    while True:
        chosen: list[InnerWall] = []
        for wall in possible:
            if not any(_excluded(wall, other) for other in chosen):
                chosen.append(wall)
        held = [wall for wall in chosen if _held(wall, [other for other in chosen if other is not wall], inner, cell)]
        if len(held) == len(possible):
            return held
        possible = held


def _excluded(wall: InnerWall, longer: InnerWall) -> bool:
    """Return whether a wall cannot stand next to a longer one."""
    if _parallel(wall.strip, longer.strip):
        return _length_near(wall, longer.line, longer.strip.thickness) > APART / 2.0
    return any(_blocks(wall, mark) for mark in longer.marks)


def _blocks(wall: InnerWall, mark: Mark) -> bool:
    from shapely import LineString

    return bool(LineString([mark.start, mark.end]).intersection(wall.body).length > 1e-6)


def _parallel(first: Strip, second: Strip) -> bool:
    return abs(math.sin(first.yaw - second.yaw)) < SIDEWAYS


def _along_outer(wall: InnerWall, inner: Polygon) -> bool:
    """Return whether more than half of a wall runs along an outer wall that is parallel to it."""
    from shapely import LineString

    for start, end in pairwise(inner.exterior.coords):
        if _parallel(wall.strip, Strip(start[:2], end[:2], 0.0)):
            if _length_near(wall, LineString([start, end]), 0.0) > 0.5 * wall.strip.length:
                return True
    return False


def _length_near(wall: InnerWall, line: LineString, thickness: float) -> float:
    """Return the length of a wall with too little room between it and a straight wall on a line, meters."""
    near = APART + (wall.strip.thickness + thickness) / 2.0
    return float(wall.line.intersection(line.buffer(near, cap_style="flat")).length)


def _held(wall: InnerWall, others: Sequence[InnerWall], inner: Polygon, cell: float) -> bool:
    """Return whether the ends of a wall that seemed to be at other walls are."""
    from shapely import Point

    outer = inner.exterior
    for end, held in zip((wall.strip.start, wall.strip.end), wall.held, strict=True):
        point = Point(end)
        near = wall.strip.thickness / 2.0 + 2.0 * cell
        if held and outer.distance(point) > near and not any(other.body.distance(point) <= near for other in others):
            return False
    return True
