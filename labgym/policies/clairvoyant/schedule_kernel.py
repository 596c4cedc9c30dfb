"""One step of the schedule's dynamic program."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from labgym.machine_code import entry, inner

Array = NDArray[np.float64]
Times = NDArray[np.float32]


class Limits(NamedTuple):
    """Limits of a step of the program.

    Attributes:
        apart, close: squares of the distances within which the robot may not move, and is near people, m2.
        margin: distance from all places beyond which people do not count, meters.
        coarse: number of places for each one at which people are looked up. dt: seconds.
    """

    apart: float
    close: float
    margin: float
    coarse: int
    dt: np.float32


@inner
def _relax(before: Times, after: Times, came: NDArray[np.int8], barred: Times, change: int, rests: bool) -> None:
    """Take over the times of one change of speed that are less; `barred` is inf where only a rest may go on."""
    for place in range(len(after)):
        time = before[place] if rests else before[place] + barred[place]
        better = time < after[place]
        after[place] = time if better else after[place]
        came[place] = np.int8(change) if better else came[place]


@inner
def _around(people: Array, points: Array, limits: Limits) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return at which places the robot may not move, and at which it is near people."""
    margin, coarse = limits.margin, limits.coarse
    size = len(points)
    blocked, near_people = np.zeros(size * coarse, dtype=np.bool_), np.zeros(size * coarse, dtype=np.bool_)
    if len(people):
        left, right, below, above = points[0, 0], points[0, 0], points[0, 1], points[0, 1]
        for k in range(1, size):
            left, right = min(left, points[k, 0]), max(right, points[k, 0])
            below, above = min(below, points[k, 1]), max(above, points[k, 1])
        for one in range(len(people)):
            x, y = people[one, 0], people[one, 1]
            if not (x > left - margin and x < right + margin and y > below - margin and y < above + margin):
                continue
            for k in range(size):
                dx, dy = points[k, 0] - x, points[k, 1] - y
                square = dx * dx + dy * dy
                if square < limits.apart:
                    blocked[coarse * k : coarse * (k + 1)] = True
                if square < limits.close:
                    near_people[coarse * k : coarse * (k + 1)] = True
    return blocked, near_people


@entry
def advance(
    before: Times,
    after: Times,
    came: NDArray[np.int8],
    slow: NDArray[np.bool_],
    people: Array,
    points: Array,
    limits: Limits,
) -> None:
    """Write the times near people after a step, and by how many levels the speed changed.

    Args:
        before, after: (levels, places) times near people, seconds; inf where the robot cannot be, and in both beyond
            the places that can be reached. came: (levels, reached). slow: where the robot may have which speed.
        people: (n, 2) centers after the step, meters. points: (k, 2) of the places at which people are looked up.
        limits: to keep to.
    """
    levels, reached = came.shape
    blocked, near_people = _around(people, points, limits)
    infinite = np.float32(np.inf)
    barred, added = np.zeros(reached, dtype=np.float32), np.zeros(reached, dtype=np.float32)
    for place in range(reached):
        if blocked[place]:
            barred[place] = infinite
        if near_people[place]:
            added[place] = limits.dt
    for level in range(levels):
        after[level, :reached] = infinite
        came[level] = 0
        for change in (0, 1, -1):
            source, moved = level - change, 2 * level - change
            if source < 0 or source >= levels or moved >= reached:
                continue
            rests = level == 0 and change == 0
            _relax(before[source], after[level, moved:reached], came[level, moved:], barred[moved:], change, rests)
        row, may = after[level], slow[level]
        for place in range(reached):
            row[place] = row[place] + added[place] if may[place] else infinite
