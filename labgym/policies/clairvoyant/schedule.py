"""When to be where on a path: the fastest schedule within the acceleration that touches no moving disc.

Path-velocity decomposition of K. Kant and S. W. Zucker, Toward efficient trajectory planning, International Journal of
Robotics Research 5(3), 1986, by dynamic programming over place, speed and time.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
People = Callable[[float], Array]

LONGEST = 120.0
"""Time after which no schedule is looked for, seconds."""


@dataclass(frozen=True, eq=False)
class Schedule:
    """Places and speeds on a path at even times.

    Attributes:
        start: time of the first one, seconds. dt: time between them, seconds.
        places: (k,) lengths along the path, meters. speeds: (k,) m/s.
    """

    start: float
    dt: float
    places: Array
    speeds: Array

    def at(self, time: float) -> tuple[float, float]:
        """Return place, meters, and speed, m/s, at a time; the ends before and after."""
        times = self.start + self.dt * np.arange(len(self.places))
        return float(np.interp(time, times, self.places)), float(np.interp(time, times, self.speeds))

    @property
    def end(self) -> float:
        """Time at which the robot rests at the end, seconds."""
        return self.start + self.dt * (len(self.places) - 1)


def fastest_schedule(
    path: Array,
    limits: Array,
    acceleration: float,
    people: People,
    apart: float,
    start: float = 0.0,
    place: float = 0.0,
    speed: float = 0.0,
    dt: float = 0.1,
) -> Schedule | None:
    """Return the schedule that rests at the end of a path soonest; None if none does within `LONGEST`.

    Speeds are multiples of `acceleration dt`; in each step the speed stays, rises or falls by one of them. Places are
    multiples of half of one times dt, so that the steps are exact. The robot may rest anywhere: people walk around a
    robot at rest.

    Args:
        path: (n, 2) at even steps, meters. limits: (n,) speed limits, m/s.
        acceleration: along the way, m/s2.
        people: returns the centers (m, 2) at a time. apart: least distance to them while the robot moves, meters.
        start: the time now, seconds. place: length along the path, meters. speed: m/s, of the robot now.
        dt: time step, seconds.
    """
    rise = acceleration * dt
    unit = 0.5 * rise * dt
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
    count = math.ceil((along[-1] - place) / unit) + 1
    spots = np.minimum(place + unit * np.arange(count), along[-1])
    points = np.column_stack([np.interp(spots, along, path[:, axis]) for axis in range(2)])
    levels = max(1, math.floor(float(limits.max()) / rise + 1e-9)) + 1
    slow = np.arange(levels)[:, None] * rise <= np.maximum(np.interp(spots, along, limits), rise)[None, :] + 1e-9
    level = min(round(speed / rise), levels - 1)
    slow[: level + 1, : _braking(level) + 1] = True
    reached = np.zeros((levels, count), dtype=bool)
    reached[level, 0] = True
    before: list[NDArray[np.int8]] = []
    for step in range(1, round(LONGEST / dt) + 1):
        clear = _clear(points, people(start + step * dt), apart)
        following, came = _advanced(reached, slow, clear)
        before.append(came)
        reached = following
        if reached[0, -1]:
            return _traced(before, spots, rise, start, dt)
        if not reached.any():
            return None
    return None


def _advanced(
    reached: NDArray[np.bool_], slow: NDArray[np.bool_], clear: NDArray[np.bool_]
) -> tuple[NDArray[np.bool_], NDArray[np.int8]]:
    """Return the states (levels, places) after a step, and by how many levels the speed changed to get there."""
    levels, count = reached.shape
    following = np.zeros_like(reached)
    came = np.zeros(reached.shape, dtype=np.int8)
    for level in range(levels):
        # Of several ways to the same state the evenest is kept.
        for change in (0, 1, -1):
            last = level - change
            if not 0 <= last < levels:
                continue
            moved = last + level
            if moved >= count:
                continue
            hit = reached[last, : count - moved] & ~following[level, moved:]
            following[level, moved:] |= hit
            came[level, moved:][hit] = change
    following &= slow
    following[1:] &= clear
    return following, came


def _clear(points: Array, people: Array, apart: float) -> NDArray[np.bool_]:
    """Return whether points (n, 2) keep their distance from people (m, 2), (n,)."""
    if len(people) == 0:
        return np.ones(len(points), dtype=bool)
    away = np.hypot(points[:, 0, None] - people[:, 0], points[:, 1, None] - people[:, 1])
    return np.asarray(away.min(axis=1) >= apart)


def _traced(before: list[NDArray[np.int8]], spots: Array, rise: float, start: float, dt: float) -> Schedule:
    """Return the schedule that ends at rest at the last place."""
    level, spot = 0, len(spots) - 1
    states = [(spot, level)]
    for came in reversed(before):
        last = level - int(came[level, spot])
        level, spot = last, spot - last - level
        states.append((spot, level))
    states.reverse()
    places = np.array([spots[spot] for spot, _ in states])
    return Schedule(start, dt, places, np.array([rise * level for _, level in states]))


def _braking(level: int) -> int:
    """Return the number of units of length that braking from a level to rest takes."""
    return level * level
