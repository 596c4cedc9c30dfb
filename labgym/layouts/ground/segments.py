"""Segments: straight stretches of a space's boundary that have a wall behind them, and the gates in them."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labgym.geometry import OrientedBox

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
