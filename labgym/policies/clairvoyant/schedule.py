"""When to be where on a route: the schedule worth most within the acceleration that touches no moving disc.

Path-velocity decomposition of K. Kant and S. W. Zucker, Toward efficient trajectory planning, International Journal of
Robotics Research 5(3), 1986, by dynamic programming over place, speed and time.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labgym.policies.clairvoyant.kernels import kernels
from labgym.policies.clairvoyant.route import Gait, Route
from labgym.policies.clairvoyant.worth import NEAR, Worth

Array = NDArray[np.float64]

COARSE = 4
"""People are looked up at one place of this many."""
NOBODY = np.zeros((0, 2))
LONGEST = 60.0
"""Time after which no schedule is looked for, seconds."""


@dataclass(frozen=True, eq=False)
class Crossing:
    """People who may cross the way.

    Attributes:
        places: (k, n, 2) centers after 1, 2, ... steps, meters. Nobody is expected later.
        apart: least distance to them while the robot moves, meters.
    """

    places: Array
    apart: float

    def around(self, step: int, points: Array) -> tuple[NDArray[np.bool_] | None, NDArray[np.bool_] | None]:
        """Return whether points (m, 2) are too near after a number of steps, and whether they are near; None: none."""
        if step > len(self.places) or self.places.shape[1] == 0:
            return None, None
        people = self.places[step - 1]
        low, high = points.min(axis=0) - NEAR, points.max(axis=0) + NEAR
        people = people[((people > low) & (people < high)).all(axis=1)]
        if len(people) == 0:
            return None, None
        square = ((points[None] - people[:, None]) ** 2).sum(axis=2).min(axis=0)
        return square < self.apart**2, square < NEAR**2


@dataclass(frozen=True, eq=False)
class Schedule:
    """Places and speeds on a route after each time step.

    Attributes:
        places: (k,) lengths along the route, meters. speeds: (k,) m/s. near: seconds near people. points: of the drive.
    """

    places: Array
    speeds: Array
    near: float
    points: float


def best_schedule(
    route: Route,
    crossing: Crossing,
    worth: Worth,
    gait: Gait,
    place: float = 0.0,
    speed: float = 0.0,
    dt: float = 0.1,
    least: float = -math.inf,
) -> Schedule | None:
    """Return the schedule worth most that rests at the end of a route; None if none is worth more than `least`.

    Speeds are multiples of the gait's rise; in each step the speed stays, rises or falls by one of them. The robot may
    rest anywhere: nobody walks into a robot at rest. For each time of arrival the schedule with the least time near
    people is found, and of these the one worth most is taken.

    Args:
        route: with its speed limits. crossing: the people. worth: of the drive.
        gait: speeds.
        place: length along the route now, meters. speed: m/s, now.
        dt: time step, seconds. least: points.
    """
    levels, rise = gait.levels, gait.rise
    unit = 0.5 * rise * dt
    count = max(math.ceil((route.length - place) / unit - 1e-6), 0) + 1
    spots = np.minimum(place + unit * np.arange(count), route.length)
    # People are looked up at every fourth place, 2.5 cm apart.
    points, people = route.at(spots[::COARSE])[0], np.ascontiguousarray(crossing.places)
    allowed = np.interp(spots, route.spacing * np.arange(len(route.fastest)), route.fastest)
    slow = np.arange(levels + 1)[:, None] * rise <= np.maximum(allowed, rise)[None, :] + 1e-9
    level = min(round(speed / rise), levels)
    # Too fast for what follows, the robot may brake.
    slow[: level + 1, : level * level + 1] = True
    near = np.full((levels + 1, count), np.inf, dtype=np.float32)
    near[level, 0] = 0.0
    after, compiled = np.full_like(near, np.inf), kernels()
    came: list[NDArray[np.int8]] = []
    best, beside, at = least, 0.0, 0
    for step in range(1, round(LONGEST / dt) + 1):
        if worth.points(step * dt, 0.0) <= best:
            break
        # No place further than at the greatest speed all the time.
        reached = min(count, 2 * levels * step + 1)
        seen = points[: -(-reached // COARSE)]
        if compiled is None:
            blocked, close = crossing.around(step, seen)
            free = None if blocked is None else ~np.repeat(blocked, COARSE)[:reached]
            near, change = _advanced(near, slow, reached, free)
            if close is not None:
                near[:, :reached][:, np.repeat(close, COARSE)[:reached]] += np.float32(dt)
        else:
            change = np.empty((levels + 1, reached), dtype=np.int8)
            now = people[step - 1] if step <= len(people) else NOBODY
            limits = crossing.apart**2, NEAR**2, NEAR
            compiled.advance(near, after, change, slow, now, seen, COARSE, limits, np.float32(dt))
            near, after = after, near
        came.append(change)
        if np.isfinite(near[0, -1]) and worth.points(step * dt, float(near[0, -1])) > best + 1e-9:
            beside, at = float(near[0, -1]), step
            best = worth.points(step * dt, beside)
    if at == 0:
        return None
    places, speeds = _traced(came[:at], spots, rise)
    return Schedule(places, speeds, beside, best)


def _advanced(
    near: NDArray[np.float32], slow: NDArray[np.bool_], reached: int, free: NDArray[np.bool_] | None
) -> tuple[NDArray[np.float32], NDArray[np.int8]]:
    """Return the times near people (levels, places) after a step, and by how many levels the speed changed.

    Args:
        near: before the step; inf where the robot cannot be. slow: where it may have which speed.
        reached: number of places that can be reached. free: which of them no person is near; None for all. At the
            others the robot may only rest on.
    """
    levels, _ = near.shape
    following = np.full_like(near, np.inf)
    came = np.zeros((levels, reached), dtype=np.int8)
    for level in range(levels):
        target, change = following[level, :reached], came[level]
        # Of several ways at the same cost the evenest is taken.
        for step in (0, 1, -1):
            moved = 2 * level - step
            if not 0 <= level - step < levels or moved >= reached:
                continue
            source = near[level - step, : reached - moved]
            better = source < target[moved:]
            if free is not None and (level or step):
                better &= free[moved:]
            np.copyto(target[moved:], source, where=better)
            np.copyto(change[moved:], np.int8(step), where=better)
    following[~slow] = np.inf
    return following, came


def _traced(came: list[NDArray[np.int8]], spots: Array, rise: float) -> tuple[Array, Array]:
    """Return the places and speeds (k,) of the schedule that ends at rest at the last place."""
    level, spot = 0, len(spots) - 1
    states = []
    for change in reversed(came):
        states.append((spot, level))
        last = level - int(change[level, spot])
        level, spot = last, spot - last - level
    states.reverse()
    return np.array([spots[spot] for spot, _ in states]), np.array([rise * level for _, level in states])
