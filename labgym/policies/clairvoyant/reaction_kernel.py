"""One choice of a drive that gives way.

Poses along a route are those of `Route.at` and `np.interp`, to the bit; a test compares them.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from labgym.machine_code import entry, inner

Array = NDArray[np.float64]


class Line(NamedTuple):
    """A route as arrays.

    Attributes:
        along: (n,) lengths at its points at even steps from 0, meters. values: (4, n) x, y, headings and curvatures.
        braked: (n,) speeds from which every later limit can be kept, m/s.
    """

    along: Array
    values: Array
    braked: Array


class Terms(NamedTuple):
    """The terms of a drive that gives way.

    Attributes:
        levels: greatest speed, as a number of rises. rise: m/s. unit: way for each sum of levels in a step, meters.
        length: of the route, meters. apart: distance to keep, meters. delay: of the filter, steps.
        least: distance to keep even from somebody who is nearer than `apart`, meters.
    """

    levels: int
    rise: float
    unit: float
    length: float
    apart: float
    delay: float
    least: float


@inner
def _interval(place: float, along: Array) -> int:
    """Return the number of the last of ascending lengths at even steps that is not beyond a place; -1 before all."""
    last = len(along) - 1
    if not place >= along[0]:
        return -1
    if place >= along[last]:
        return last
    k = min(int(place / along[1]), last - 1)
    while along[k] > place:
        k -= 1
    while along[k + 1] <= place:
        k += 1
    return k


@inner
def _interpolated(place: float, k: int, along: Array, values: Array) -> float:
    """Return `np.interp` at a place in an interval."""
    value: float = values[max(k, 0)]
    if k >= 0 and k < len(along) - 1 and along[k] != place:
        value = (values[k + 1] - values[k]) / (along[k + 1] - along[k]) * (place - along[k]) + value
    return value


@entry
def pose_at(place: float, line: Line) -> tuple[float, float, float, float]:
    """Return x, y, heading and curvature at a length along a route, as `Route.at`.

    Args:
        place: meters. line: the route.
    """
    along, lines = line.along, line.values
    k = _interval(place, along)
    return (
        _interpolated(place, k, along, lines[0]),
        _interpolated(place, k, along, lines[1]),
        _interpolated(place, k, along, lines[2]),
        _interpolated(place, k, along, lines[3]),
    )


@inner
def _nearest(place: float, step: float, line: Line, now: Array, then: Array) -> float:
    """Return the distance to the nearest person after a number of steps, meters."""
    along, lines = line.along, line.values
    k = _interval(place, along)
    x, y = _interpolated(place, k, along, lines[0]), _interpolated(place, k, along, lines[1])
    least = math.inf
    for one in range(len(now)):
        px = now[one, 0] + (then[one, 0] - now[one, 0]) * step
        py = now[one, 1] + (then[one, 1] - now[one, 1]) * step
        least = min(least, math.hypot(x - px, y - py))
    return least


@inner
def _safe(place: float, level: int, following: int, line: Line, now: Array, then: Array, terms: Terms) -> bool:
    """Return whether the robot may take a speed: whether it then still rests before it touches anybody.

    Its places are reached some steps later, the delay of the filter.
    """
    if len(now) == 0:
        return True
    # Somebody at the robot's side may be left behind, but not approached.
    away = _nearest(min(place + 0.0, terms.length), 0 + terms.delay, line, now, then)
    limit = (terms.apart if away >= terms.apart else max(away, terms.least)) - 1e-9
    before, after, moves, step = level, following, 0, 0
    # Setting off must be worth it: at least half a second of motion.
    held = 2 if following > level and level == 0 else 0
    while True:
        moves, step = moves + before + after, step + 1
        reached = min(place + terms.unit * moves, terms.length)
        if _nearest(reached, step + terms.delay, line, now, then) < limit:
            return False
        before = after
        if held > 0:
            after, held = 2, held - 1
        else:
            after = before - 1
        if after < 0:
            return True


@entry
def next_level(place: float, level: int, line: Line, now: Array, then: Array, terms: Terms) -> int:
    """Return the next speed, as a number of rises: the greatest within the limits that is safe, or the one below.

    Args:
        place: meters. level: the speed now. line: the route.
        now, then: (n, 2) people now and after a step, meters. terms: of the drive.
    """
    unit, rise = terms.unit, terms.rise
    for following in (level + 1, level):
        reach = place + (level + following) * unit
        allowed = _interpolated(reach, _interval(reach, line.along), line.along, line.braked) + 1e-9
        if following > terms.levels or following * rise > max(allowed, rise if following > level else 0.0):
            continue
        if reach + following * following * unit > terms.length + unit:
            continue
        if _safe(place, level, following, line, now, then, terms):
            return following
    return max(level - 1, 0)
