"""The intentions of people compiled by numba, which the extra `fast` installs: `Crowd._preferred`, sooner.

Every operation is that of `crowd`, in the same order and without fast math. So the bits are the same; the tests compare
them.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from labgym.machine_code import entry, inner

Array = NDArray[np.float64]
Marks = NDArray[np.int64]

X, Y, WAITING, GROUP_WAIT, BEYOND, TO_GO, STALLED, COLUMNS = 0, 1, 4, 5, 6, 7, 8, 9
"""Columns of the numbers of people, as in `Walker`; 2 and 3 have the velocity."""
STOP, STANDING, PASSED, POINTS, MARKS = 0, 1, 2, 3, 4
"""Columns of their marks, as in `Walker`; `POINTS` has the number of points of the way, 0 before it is planned."""
SPLIT = 134217729.0
"""Splits a double into halves of 26 bits."""


@inner
def _added(total: float, rest: float, term: float) -> tuple[float, float]:
    """Return a compensated sum and its rest with another term."""
    after = total + term
    return after, rest + ((total - after) + term)


@inner
def distance(ax: float, ay: float, bx: float, by: float) -> float:
    """Return `math.dist` by the algorithm of CPython 3.11, which is not that of `math.hypot`."""
    dx, dy = abs(ax - bx), abs(ay - by)
    largest = max(dx, dy)
    if largest == 0.0:
        return 0.0
    scale = math.ldexp(1.0, -math.frexp(largest)[1])
    total, first, second, third = 1.0, 0.0, 0.0, 0.0
    for side in (dx, dy):
        scaled = side * scale
        wide = scaled * SPLIT
        high = wide - (wide - scaled)
        low = scaled - high
        total, first = _added(total, first, high * high)
        total, second = _added(total, second, 2.0 * high * low)
        third += low * low
    root = math.sqrt(total - 1.0 + (first + second + third))
    wide = root * SPLIT
    high = wide - (wide - root)
    low = root - high
    total, first = _added(total, first, -high * high)
    total, second = _added(total, second, -2.0 * high * low)
    total, third = _added(total, third, -low * low)
    return (root + (total - 1.0 + (first + second + third)) / (2.0 * root)) / scale


@inner
def _square(ax: float, ay: float, bx: float, by: float, two: float) -> float:
    """Return the sum of the squares as Python's `**` computes them, which is not always that of the products."""
    return math.pow(ax - bx, two) + math.pow(ay - by, two)


@inner
def _go_on(one: int, walkers: Array, marks: Marks, stops: int) -> None:
    """As `Crowd._go_on`."""
    marks[one, STOP] = (marks[one, STOP] + 1) % stops
    marks[one, STANDING], marks[one, POINTS] = 0, 0
    walkers[one, TO_GO], walkers[one, STALLED] = math.inf, 0.0


@inner
def _wait(one: int, walkers: Array, marks: Marks, stops: int, groups: Marks, patience: float, dt: float) -> None:
    """As `Crowd._wait`."""
    together = True
    for k in range(len(marks)):
        if groups[k] == groups[one] and not marks[k, STANDING]:
            together = False
    walkers[one, GROUP_WAIT] += 0.0 if together else dt
    if together or walkers[one, GROUP_WAIT] > patience:
        walkers[one, WAITING] -= dt
    if walkers[one, WAITING] <= 0.0:
        _go_on(one, walkers, marks, stops)


@inner
def _taken(one: int, x: float, y: float, walkers: Array, marks: Marks, taken: float, two: float) -> bool:
    """As `Crowd._taken`."""
    for k in range(len(marks)):
        if k != one and marks[k, STANDING] and _square(walkers[k, X], walkers[k, Y], x, y, two) < taken * taken:
            return True
    return False


@inner
def _ahead(one: int, walkers: Array, marks: Marks, way: Array, look: float, two: float) -> tuple[int, float]:
    """Return the number of the point of `Crowd._ahead`, and the way to go."""
    last, place, x, y = marks[one, POINTS] - 1, marks[one, PASSED], walkers[one, X], walkers[one, Y]
    while place < last:
        ax, ay, bx, by = way[place - 1, 0], way[place - 1, 1], way[place, 0], way[place, 1]
        if (x - bx) * (bx - ax) + (y - by) * (by - ay) < 0.0:
            break
        place += 1
    if place != marks[one, PASSED]:
        marks[one, PASSED], walkers[one, BEYOND] = place, way[place, 2]
    rest = distance(x, y, way[place, 0], way[place, 1]) + walkers[one, BEYOND]
    while place < last and _square(way[place, 0], way[place, 1], x, y, two) < look * look:
        place += 1
    return place, rest


@inner
def _watch(
    one: int, to_go: float, walkers: Array, marks: Marks, stops: int, limits: tuple[float, float, float], dt: float
) -> None:
    """As `Crowd._watch`."""
    progress, replan, give_up = limits
    if to_go < walkers[one, TO_GO] - progress:
        walkers[one, TO_GO], walkers[one, STALLED] = to_go, 0.0
        return
    before = walkers[one, STALLED]
    walkers[one, STALLED] = before + dt
    if walkers[one, STALLED] >= give_up:
        _go_on(one, walkers, marks, stops)
    elif before < replan and replan <= walkers[one, STALLED]:
        marks[one, POINTS] = 0


@inner
def _pace(one: int, to_go: float, walkers: Array, marks: Marks, groups: Marks, ahead: float, speed: float) -> float:
    """As `Crowd._pace`."""
    for k in range(len(marks)):
        if k == one or groups[k] != groups[one] or marks[k, STOP] != marks[one, STOP] or marks[k, STANDING]:
            continue
        if to_go + ahead < walkers[k, TO_GO] and walkers[k, TO_GO] < math.inf:
            return speed * 0.5
    return speed


@entry
def intend(
    walkers: Array,
    marks: Marks,
    preferred: Array,
    ways: Array,
    stops: Array,
    counts: Marks,
    groups: Marks,
    first: int,
    planned: bool,
    speed: float,
    near: tuple[float, float, float, float, float],
    times: tuple[float, float, float],
    patience: float,
    right: float,
    dt: float,
    two: float,
) -> int:
    """Write the velocities that people would have alone, advance their intentions, and return their number.

    Return the number of a person who needs a way first: it must be planned before the rest.

    Args:
        walkers: (n, 9) numbers and marks: (n, 4) of the people; see the columns. preferred: (n, 2) velocities, m/s.
        ways: (n, p, 3) points, meters, and the length of the way after each, meters.
        stops: (n, s, 3) x, y, meters, and duration, seconds. counts, groups: (n,) number of stops, and group.
        first: person to begin with. planned: whether that person's way has just been planned. speed: m/s.
        near: `ARRIVED`, `QUEUE`, `TAKEN`, `LOOKAHEAD` and `AHEAD`, meters.
        times: `PROGRESS`, meters, `REPLAN` and `GIVE_UP`, seconds. patience: `PATIENCE`, seconds.
        right: `TO_THE_RIGHT`. dt: seconds. two: the number 2: a power whose exponent the compiler knows is a product.
    """
    arrived, queue, taken, look, ahead = near
    for one in range(first, len(walkers)):
        count = counts[one]
        preferred[one, 0], preferred[one, 1] = 0.0, 0.0
        if count == 0:
            continue
        if marks[one, STANDING]:
            _wait(one, walkers, marks, count, groups, patience, dt)
            continue
        x, y, stay = stops[one, marks[one, STOP], 0], stops[one, marks[one, STOP], 1], stops[one, marks[one, STOP], 2]
        away = math.sqrt(_square(x, y, walkers[one, X], walkers[one, Y], two))
        if away < arrived or (away < queue and _taken(one, x, y, walkers, marks, taken, two)):
            marks[one, STANDING], walkers[one, GROUP_WAIT], walkers[one, WAITING] = 1, 0.0, stay
            continue
        if marks[one, POINTS] == 0:
            if not planned or one != first:
                return one
            _go_on(one, walkers, marks, count)
            continue
        place, to_go = _ahead(one, walkers, marks, ways[one], look, two)
        _watch(one, to_go, walkers, marks, count, times, dt)
        fastest = _pace(one, to_go, walkers, marks, groups, ahead, speed)
        dx, dy = ways[one, place, 0] - walkers[one, X], ways[one, place, 1] - walkers[one, Y]
        length = math.sqrt(dx * dx + dy * dy)
        if length == 0.0:
            continue
        pace = min(fastest, to_go / (2.0 * dt)) / length
        turn = right if to_go > look else 0.0
        preferred[one, 0], preferred[one, 1] = (dx + turn * dy) * pace, (dy - turn * dx) * pace
    return len(walkers)
