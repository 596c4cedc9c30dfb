"""When to be where on a route: the schedule worth most within the acceleration that touches no moving disc.

Path-velocity decomposition of K. Kant and S. W. Zucker, Toward efficient trajectory planning, International Journal of
Robotics Research 5(3), 1986, by dynamic programming over place, speed and time.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from labgym.envs.robot import ROBOT
from labgym.geometry import Array
from labgym.machine_code import entry, inner
from labgym.policies.clairvoyant.route import Gait, Route
from labgym.policies.clairvoyant.worth import NEAR_PEOPLE_M, Worth

Times = NDArray[np.float32]


class StepLimits(NamedTuple):
    """StepLimits of a step of the program.

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
def _around(people: Array, points: Array, limits: StepLimits) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
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
    limits: StepLimits,
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


PLACES_PER_LOOKUP = 4
"""Number of places on a route for each one at which people are looked up."""

NOBODY = np.zeros((0, 2))

LONGEST_SCHEDULE_S = 60.0
"""Longest schedule, seconds."""


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
        least: points.
    """
    dt = ROBOT.control_dt
    levels, rise = gait.levels, gait.rise
    unit = 0.5 * rise * dt
    count = max(math.ceil((route.length - place) / unit - 1e-6), 0) + 1
    spots = np.minimum(place + unit * np.arange(count), route.length)
    # People are looked up at every fourth place, 2.5 cm apart.
    points, people = route.at(spots[::PLACES_PER_LOOKUP])[0], np.ascontiguousarray(crossing.places)
    allowed = np.interp(spots, route.spacing * np.arange(len(route.fastest)), route.fastest)
    slow = np.arange(levels + 1)[:, None] * rise <= np.maximum(allowed, rise)[None, :] + 1e-9
    level = min(round(speed / rise), levels)
    # Too fast for what follows, the robot may brake.
    slow[: level + 1, : level * level + 1] = True
    near = np.full((levels + 1, count), np.inf, dtype=np.float32)
    near[level, 0] = 0.0
    after = np.full_like(near, np.inf)
    limits = StepLimits(crossing.apart**2, NEAR_PEOPLE_M**2, NEAR_PEOPLE_M, PLACES_PER_LOOKUP, np.float32(dt))
    came: list[NDArray[np.int8]] = []
    best, beside, at = least, 0.0, 0
    for step in range(1, round(LONGEST_SCHEDULE_S / dt) + 1):
        if worth.points(step * dt, 0.0) <= best:
            break
        # No place further than at the greatest speed all the time.
        reached = min(count, 2 * levels * step + 1)
        seen = points[: -(-reached // PLACES_PER_LOOKUP)]
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
