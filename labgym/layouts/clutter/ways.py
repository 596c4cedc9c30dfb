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


class Ways:
    """Clearances of a floor that is being filled, while the ways that existed at first stay.

    Args:
        radii: radii of the discs whose ways stay, meters.

    Attributes:
        points: the grid's points, shape (ny, nx, 2).
        values: distance of each point from the nearest obstacle, up to `REACH`; not positive in obstacles and outside,
            shape (ny, nx).
    """

    def __init__(
        self,
        floor: Floor,
        entrances: Iterable[Entrance],
        obstacles: Sequence[OrientedBox],
        goals: Iterable[Point],
        radii: Sequence[float] = RADII,
    ) -> None:
        x0, y0, x1, y1 = floor.bounds
        self._xs, self._ys = np.arange(x0, x1, STEP), np.arange(y0, y1, STEP)
        self.points = np.stack(np.meshgrid(self._xs, self._ys), axis=-1)
        inside = floor.inside(self.points.reshape(-1, 2)).reshape(self.points.shape[:2])
        self.values = np.where(inside, REACH, 0.0)
        lower_to_boxes(self.values, self._xs, self._ys, obstacles, REACH)
        exits = [entrance for entrance in entrances if entrance.exit]
        around = [self._around(goal) for goal in goals]
        self._exits = len(exits)
        self._places = {radius: [*(np.nonzero(self._entry(way, radius)) for way in exits), *around] for radius in radii}
        self._kept = {radius: self.joined(radius) for radius in radii}

    def add(self, boxes: Sequence[OrientedBox]) -> bool:
        """Add obstacles, unless they cut a way that existed at first; return whether they were added."""
        before = self.values
        self.values = before.copy()
        lower_to_boxes(self.values, self._xs, self._ys, boxes, REACH)
        if all((self.joined(radius) >= kept).all() for radius, kept in self._kept.items()):
            return True
        self.values = before
        return False

    def joined(self, radius: float) -> NDArray[np.bool_]:
        """Return between which places a disc of one of the radii moves, shape (places, places), symmetric.

        Places are the exits and then the goals. Ways between two exits are left out.
        """
        places = self._places[radius]
        free = (self.values >= radius).astype(np.uint8)
        _, labels = cv2.connectedComponents(free, connectivity=4, ltype=cv2.CV_32S)
        owner = np.repeat(np.arange(len(places)), [len(rows) for rows, _ in places])
        rows, columns = np.concatenate([np.empty((2, 0), np.intp), *places], axis=1)
        present, component = np.unique(labels[rows, columns], return_inverse=True)
        touches = np.zeros((len(places), len(present)), dtype=np.float32)
        touches[owner, component] = present[component] > 0
        joined = np.asarray(touches @ touches.T > 0.0)
        joined[: self._exits, : self._exits] = False
        np.fill_diagonal(joined, False)
        return joined

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
