"""Segments: straight stretches of a space's boundary, the walls behind them, and the gates in them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from labgym.geometry import OrientedBox, wrap_angle
from labgym.layouts.floor import Opening

Pose = tuple[float, float, float]

THIN = 1e-6
"""Depth of a box that stands for a line, meters."""


@dataclass(frozen=True)
class Cut:
    """A stretch of a segment, meters from its start, where only objects up to a height may stand: 0 at a door."""

    start: float
    end: float
    height: float


@dataclass(frozen=True)
class Segment:
    """A straight stretch of wall, in the frame of a ground.

    Attributes:
        id: unique in its ground.
        x, y: its start: the left end for someone who looks at the wall from outside, through it into the space.
        yaw: of an object with its back to the wall; the segment runs along (cos yaw, sin yaw), and its inward normal is
            (-sin yaw, cos yaw).
        length: meters.
        cuts: where openings interrupt it.
        walls: indices of the floor's walls behind it.
        straight: whether it runs along an axis of the ground's frame; oblique walls do not.
    """

    id: str
    x: float
    y: float
    yaw: float
    length: float
    cuts: tuple[Cut, ...] = ()
    walls: tuple[int, ...] = ()
    straight: bool = True

    def point(self, along: float, inward: float = 0.0) -> tuple[float, float]:
        """Return the point (x, y) at a distance from the start, and from the wall, meters."""
        cosine, sine = math.cos(self.yaw), math.sin(self.yaw)
        return self.x + along * cosine - inward * sine, self.y + along * sine + inward * cosine

    def points(self, along: NDArray[np.float64], inward: float) -> NDArray[np.float64]:
        """Return the points (n, 2) at distances (n,) from the start, and at one distance from the wall, meters."""
        cosine, sine = math.cos(self.yaw), math.sin(self.yaw)
        return np.column_stack([self.x + along * cosine - inward * sine, self.y + along * sine + inward * cosine])

    def box(self, along: float, inset: float, width: float, depth: float) -> OrientedBox:
        """Return the footprint of an object with its back to the wall.

        Args:
            along: meters from the segment's start to the object's left end. inset: gap to the wall, meters.
            width, depth: of the object, meters.
        """
        x, y = self.point(along + width / 2.0, inset + depth / 2.0)
        return OrientedBox(x, y, width, depth, self.yaw)

    def free(self, height: float) -> list[tuple[float, float]]:
        """Return the intervals along the segment where an object of a height in meters may stand."""
        return without((0.0, self.length), [(cut.start, cut.end) for cut in self.cuts if cut.height < height])


@dataclass(frozen=True)
class Gate:
    """A door or passage of a space, in the frame of a ground.

    Attributes:
        x, y, yaw: middle of the opening on the face of the wall; the yaw's front is toward the space.
        width: clear width, meters.
        area: the floor inside it that stays free.
        door: whether it is a door, not a passage. exit: whether it leads out.
    """

    x: float
    y: float
    yaw: float
    width: float
    area: OrientedBox
    door: bool = True
    exit: bool = False

    @property
    def opening(self) -> OrientedBox:
        """The opening as a thin box."""
        return OrientedBox(self.x, self.y, self.width, THIN, self.yaw)


def without(interval: tuple[float, float], taken: Iterable[tuple[float, float]]) -> list[tuple[float, float]]:
    """Return what is left of an interval outside other intervals, in order."""
    low, high = interval
    left = []
    for start, end in sorted(taken):
        if end <= low or start >= high:
            continue
        if start > low:
            left.append((low, start))
        low = max(low, end)
    if low < high:
        left.append((low, high))
    return left


TOUCH = 0.03
"""Greatest distance between an edge of a region and the face of the wall behind it, meters."""
PARALLEL = 1e-3
"""Greatest angle between an edge and the wall behind it, radians."""
REACH = 0.05
"""How far past the ends of its middle line a wall still backs furniture, meters."""
JOINT = 0.01
"""Half the width of the cut between two walls, meters."""
FRAME = 0.06
"""Width of the frame around a door, meters: furniture does not cover it."""


@dataclass(frozen=True)
class LocalWall:
    """A wall in the frame of a ground: start and direction of its middle line, length and thickness."""

    x: float
    y: float
    yaw: float
    length: float
    thickness: float
    openings: tuple[Opening, ...]


def backed(segment: Segment, walls: Sequence[LocalWall]) -> Segment:
    """Return a segment with the cuts of the walls behind it; a stretch without a wall is cut as by a door.

    It is also cut where one wall ends and the next begins, so that nothing stands against two of them.
    """
    cuts: list[Cut] = []
    covered: list[tuple[float, float]] = []
    behind: list[int] = []
    for index, wall in enumerate(walls):
        interval = _behind(segment, wall)
        if interval is None:
            continue
        covered.append(interval)
        behind.append(index)
        forward = math.cos(wall.yaw - segment.yaw) > 0.0
        for opening in wall.openings:
            offset = opening.position if forward else wall.length - opening.position
            base = _along(segment, wall.x, wall.y) if forward else _along(segment, *_end(wall))
            middle = base + offset
            if not -opening.width / 2.0 < middle < segment.length + opening.width / 2.0:
                continue
            way = opening.kind in ("door", "passage")
            half = opening.width / 2.0 + (FRAME if way else 0.0)
            cuts.append(Cut(middle - half, middle + half, 0.0 if way else opening.sill))
    cuts += [Cut(start, end, 0.0) for start, end in without((0.0, segment.length), covered)]
    ends = {end for interval in covered for end in interval if 0.0 < end < segment.length}
    cuts += [Cut(end - JOINT, end + JOINT, 0.0) for end in sorted(ends)]
    return replace(segment, cuts=tuple(cuts), walls=tuple(behind))


def faces(wall: LocalWall) -> tuple[Segment, Segment]:
    """Return both faces of a wall as segments."""
    half = wall.thickness / 2.0
    normal = (-math.sin(wall.yaw) * half, math.cos(wall.yaw) * half)
    x1, y1 = _end(wall)
    left = Segment("", wall.x + normal[0], wall.y + normal[1], wall.yaw, wall.length, straight=False)
    back = wrap_angle(wall.yaw + math.pi)
    return left, Segment("", x1 - normal[0], y1 - normal[1], back, wall.length, straight=False)


def _end(wall: LocalWall) -> tuple[float, float]:
    return wall.x + wall.length * math.cos(wall.yaw), wall.y + wall.length * math.sin(wall.yaw)


def _along(segment: Segment, x: float, y: float) -> float:
    return (x - segment.x) * math.cos(segment.yaw) + (y - segment.y) * math.sin(segment.yaw)


def _behind(segment: Segment, wall: LocalWall) -> tuple[float, float] | None:
    """The interval of a segment that a wall backs, None if the wall is not behind it."""
    if abs(math.sin(wall.yaw - segment.yaw)) > PARALLEL:
        return None
    inward = (wall.y - segment.y) * math.cos(segment.yaw) - (wall.x - segment.x) * math.sin(segment.yaw)
    if abs(inward + wall.thickness / 2.0) > TOUCH:
        return None
    ends = sorted((_along(segment, wall.x, wall.y), _along(segment, *_end(wall))))
    low, high = max(0.0, ends[0] - REACH), min(segment.length, ends[1] + REACH)
    return (low, high) if high > low else None
