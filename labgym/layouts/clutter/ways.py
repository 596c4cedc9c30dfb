"""The ways of a floor as clearances on a grid: between which exits and goals a disc moves. Lengths in meters."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

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
Index = NDArray[np.intp]
Point = tuple[float, float]


class _Places(NamedTuple):
    """The grid points of all places, m of them: the number of the place, row and column of each, (m,)."""

    owner: Index
    row: Index
    column: Index

    @classmethod
    def of(cls, points: Sequence[tuple[Index, Index]]) -> _Places:
        """Return the points of places, of which each has rows and columns."""
        owner = np.repeat(np.arange(len(points)), [len(rows) for rows, _ in points])
        return cls(owner, *np.concatenate([np.empty((2, 0), np.intp), *points], axis=1))

    def within(self, rows: slice, columns: slice) -> _Places:
        """Return the points in a window, with their rows and columns in it."""
        near = (self.row >= rows.start) & (self.row < rows.stop)
        near &= (self.column >= columns.start) & (self.column < columns.stop)
        return _Places(self.owner[near], self.row[near] - rows.start, self.column[near] - columns.start)


def _components(free: NDArray[np.bool_]) -> NDArray[np.int32]:
    """Return the number of the component of each grid point, 0 where it is not free."""
    return np.asarray(cv2.connectedComponents(free.astype(np.uint8), connectivity=4, ltype=cv2.CV_32S)[1], np.int32)


def _reached(low: float, high: float) -> slice:
    """Return the grid points within `REACH` of an interval from the first one on, with a margin of a point or more."""
    return slice(max(0, math.floor((low - REACH) / STEP) - 1), max(0, math.ceil((high + REACH) / STEP) + 2))


def separates(before: NDArray[np.bool_], after: NDArray[np.bool_], places: _Places) -> bool:
    """Whether points that are no longer free may separate places, as far as a window of the grid tells.

    If what was one component in the window still joins its points on the rim, whatever passed through it still does;
    so the whole grid need not be looked at.

    Args:
        before, after: the free points of the window, earlier and now; points of its rim that are no longer free have
            no neighbor outside.
        places: their points in the window.
    """
    if (before == after).all():
        return False
    earlier, now = _components(before), _components(after)
    rim = np.zeros_like(after)
    rim[[0, -1]] = rim[:, [0, -1]] = True
    rim &= after
    leading = np.unique(now[rim])
    if len(leading) != len(np.unique(earlier[rim])):
        return True
    # Each place keeps a point, joined to the rim, in each component in which it had one.
    part = earlier[places.row, places.column]
    key = places.owner * (int(earlier.max()) + 1) + part
    stays = np.isin(now[places.row, places.column], leading)
    return not bool(np.isin(key[part > 0], key[stays]).all())


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
        self._exits, self._count = len(exits), len(exits) + len(around)
        self._places = {radius: _Places.of([*(self._entry(way, radius) for way in exits), *around]) for radius in radii}
        self._kept = {radius: self.joined(radius) for radius in radii}

    def add(self, boxes: Sequence[OrientedBox]) -> bool:
        """Add obstacles, unless they cut a way that existed at first; return whether they were added."""
        if not boxes:
            return True
        rows, columns = self._window(boxes)
        values = self.values[rows, columns]
        before = values.copy()
        lower_to_boxes(values, self._xs[columns], self._ys[rows], boxes, REACH)
        for radius, kept in self._kept.items():
            places = self._places[radius].within(rows, columns)
            if separates(before >= radius, values >= radius, places) and not (self.joined(radius) >= kept).all():
                values[:] = before
                return False
        return True

    def joined(self, radius: float) -> NDArray[np.bool_]:
        """Return between which places a disc of one of the radii moves, shape (places, places), symmetric.

        Places are the exits and then the goals. Ways between two exits are left out.
        """
        places, labels = self._places[radius], _components(self.values >= radius)
        present, component = np.unique(labels[places.row, places.column], return_inverse=True)
        touches = np.zeros((self._count, len(present)), dtype=np.float32)
        touches[places.owner, component] = present[component] > 0
        joined = np.asarray(touches @ touches.T > 0.0)
        joined[: self._exits, : self._exits] = False
        np.fill_diagonal(joined, False)
        return joined

    def _window(self, boxes: Sequence[OrientedBox]) -> tuple[slice, slice]:
        """Rows and columns of the grid points whose clearance boxes lower, with a margin of a point or more."""
        x0, y0, x1, y1 = np.array([box.bounds() for box in boxes]).T
        return _reached(y0.min() - self._ys[0], y1.max() - self._ys[0]), _reached(
            x0.min() - self._xs[0], x1.max() - self._xs[0]
        )

    def _around(self, goal: Point) -> tuple[Index, Index]:
        """Rows and columns of the grid points near a goal."""
        rows, columns, points = self._near(goal, NEAR)
        near = np.argwhere(np.hypot(*(points - goal).transpose(2, 0, 1)) <= NEAR)
        return rows[near[:, 0]], columns[near[:, 1]]

    def _entry(self, way: Entrance, radius: float) -> tuple[Index, Index]:
        """Rows and columns of the grid points where the disc has just come in through an exit."""
        x, y, yaw = way.pose
        play = max(way.width / 2.0 - radius, 0.0) + STEP
        rows, columns, points = self._near((x, y), play + radius + 2.0 * STEP)
        offset = points - (x, y)
        across = offset[..., 0] * math.cos(yaw) + offset[..., 1] * math.sin(yaw)
        inward = offset[..., 1] * math.cos(yaw) - offset[..., 0] * math.sin(yaw)
        entered = np.argwhere((np.abs(across) <= play) & (np.abs(inward - radius) <= 1.5 * STEP))
        return rows[entered[:, 0]], columns[entered[:, 1]]

    def _near(self, point: Point, reach: float) -> tuple[Index, Index, Array]:
        """Rows (r,) and columns (c,) of the grid at most a distance from a point, and their points (r, c, 2)."""
        rows = np.flatnonzero(np.abs(self._ys - point[1]) <= reach)
        columns = np.flatnonzero(np.abs(self._xs - point[0]) <= reach)
        return rows, columns, self.points[np.ix_(rows, columns)]
