"""When to be where on a route: the schedule worth most within the acceleration that touches no moving disc.

Path-velocity decomposition of K. Kant and S. W. Zucker, Toward efficient trajectory planning, International Journal of
Robotics Research 5(3), 1986, by dynamic programming over place, speed and time.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labgym.policies.clairvoyant.route import Gait, Route
from labgym.policies.clairvoyant.schedule_kernel import Limits, advance
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
    after = np.full_like(near, np.inf)
    limits = Limits(crossing.apart**2, NEAR**2, NEAR, COARSE, np.float32(dt))
    came: list[NDArray[np.int8]] = []
    best, beside, at = least, 0.0, 0
    for step in range(1, round(LONGEST / dt) + 1):
        if worth.points(step * dt, 0.0) <= best:
            break
        # No place further than at the greatest speed all the time.
        reached = min(count, 2 * levels * step + 1)
        seen = points[: -(-reached // COARSE)]
        change = np.empty((levels + 1, reached), dtype=np.int8)
        now = people[step - 1] if step <= len(people) else NOBODY
        advance(near, after, change, slow, now, seen, limits)
        near, after = after, near
        came.append(change)
        if np.isfinite(near[0, -1]) and worth.points(step * dt, float(near[0, -1])) > best + 1e-9:
            beside, at = float(near[0, -1]), step
            best = worth.points(step * dt, beside)
    if at == 0:
        return None
    places, speeds = _traced(came[:at], spots, rise)
    return Schedule(places, speeds, beside, best)


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
