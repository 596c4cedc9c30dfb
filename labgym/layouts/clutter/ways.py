"""The ways of a floor as clearances on a grid: between which exits and goals a disc moves. Lengths in meters."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from labgym.geometry import OrientedBox
from labgym.layouts.floor import Floor
from labgym.layouts.rules.building import Entrance
from labgym.layouts.rules.clearance import lower_to_boxes

STEP = 0.05
"""Spacing of the grid."""
REACH = 0.6
"""Clearances are measured up to this value."""
NEAR = 0.15
"""A goal is reached if the disc reaches a grid point this near to it."""
RADII = (0.375, 0.325)
"""Radii for which ways are kept: a way of 0.75 m, which a 5 cm grid with a disc of 0.30 m lets through, and, where none
existed before, the disc with half a step to spare."""

Array = NDArray[np.float64]
Point = tuple[float, float]
Pair = tuple[int, int]


class Ways:
    """Clearances of a floor that is being filled.

    Attributes:
        points: the grid's points, shape (ny, nx, 2).
        values: distance of each point from the nearest obstacle, up to `REACH`; not positive in obstacles and outside,
            shape (ny, nx).
    """

    def __init__(
        self, floor: Floor, entrances: Iterable[Entrance], obstacles: Sequence[OrientedBox], goals: Iterable[Point]
    ) -> None:
        x0, y0, x1, y1 = floor.bounds
        self._xs, self._ys = np.arange(x0, x1, STEP), np.arange(y0, y1, STEP)
        self.points = np.stack(np.meshgrid(self._xs, self._ys), axis=-1)
        inside = floor.inside(self.points.reshape(-1, 2)).reshape(self.points.shape[:2])
        self.values = np.where(inside, REACH, 0.0)
        lower_to_boxes(self.values, self._xs, self._ys, obstacles, REACH)
        exits = [entrance for entrance in entrances if entrance.exit]
        self._starts = {radius: [np.nonzero(self._entry(way, radius)) for way in exits] for radius in RADII}
        self._goals = [self._around(goal) for goal in goals]

    def with_boxes(self, boxes: Sequence[OrientedBox]) -> Array:
        """Return the clearances with more obstacles."""
        values = self.values.copy()
        lower_to_boxes(values, self._xs, self._ys, boxes, REACH)
        return values

    def joined(self, values: Array) -> tuple[frozenset[Pair], ...]:
        """Return, for each of `RADII`, the pairs of places between which a disc of that radius moves.

        Places are the exits and then the goals, by number; pairs of two exits are left out.
        """
        return tuple(self._joined(values, radius) for radius in RADII)

    def _joined(self, values: Array, radius: float) -> frozenset[Pair]:
        _, labels = cv2.connectedComponents((values >= radius).astype(np.uint8), connectivity=4, ltype=cv2.CV_32S)
        exits, goals = (
            [set(labels[nodes].tolist()) - {0} for nodes in places] for places in (self._starts[radius], self._goals)
        )
        places = [*exits, *goals]
        return frozenset(
            (first, second)
            for second in range(len(exits), len(places))
            for first in range(second)
            if not places[first].isdisjoint(places[second])
        )

    def _around(self, goal: Point) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Rows and columns of the grid points near a goal."""
        rows = np.flatnonzero(np.abs(self._ys - goal[1]) <= NEAR)
        columns = np.flatnonzero(np.abs(self._xs - goal[0]) <= NEAR)
        square = np.ix_(rows, columns)
        near = np.argwhere(np.hypot(*(self.points[square] - goal).transpose(2, 0, 1)) <= NEAR)
        return rows[near[:, 0]], columns[near[:, 1]]

    def _entry(self, way: Entrance, radius: float) -> NDArray[np.bool_]:
        """Grid points where the disc has just come in through an exit."""
        x, y, yaw = way.pose
        offset = self.points - (x, y)
        across = offset[..., 0] * math.cos(yaw) + offset[..., 1] * math.sin(yaw)
        inward = offset[..., 1] * math.cos(yaw) - offset[..., 0] * math.sin(yaw)
        play = max(way.width / 2.0 - radius, 0.0) + STEP
        return np.asarray((np.abs(across) <= play) & (np.abs(inward - radius) <= 1.5 * STEP))
