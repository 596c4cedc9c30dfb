"""Intentions of people: the velocity of each alone, and when they stand, wait, plan anew or give a stop up."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from labgym.machine_code import entry, inner

Array = NDArray[np.float64]
Marks = NDArray[np.int64]

X, Y, WAITING, GROUP_WAIT, BEYOND, TO_GO, STALLED, COLUMNS = 0, 1, 4, 5, 6, 7, 8, 9
"""Columns of the numbers of people: center, meters (2 and 3 have the velocity, m/s); time left to stand and time waited
for the group, seconds; length of the way after its next point, way to go at the latest progress, meters; and time since
then, seconds."""
STOP, STANDING, PASSED, POINTS = 0, 1, 2, 3
"""Columns of their marks: index of the stop to which the person walks or at which they stand, which of the two, number
of points of the way that are passed, and number of its points, 0 before it is planned."""
DT = 0.1
"""Duration of a step, seconds."""

# Assumptions; no source gives them.
LOOKAHEAD = 0.5
"""People walk towards the point of their path that is this far ahead, meters."""
ARRIVED = 0.12
"""A stop is reached within this distance, meters."""
TAKEN = 0.6
"""A stop is taken if somebody else stands this near, meters; others then wait within `QUEUE`."""
QUEUE = 1.0
TO_THE_RIGHT = 0.05
"""Tangent of the angle by which people prefer to walk to the right of their way: two that meet do not block."""
REPLAN, GIVE_UP = 1.5, 4.0
"""Seconds without progress after which a person plans anew, and goes on to the next stop."""
PROGRESS = 0.1
"""Least decrease of the way to go that counts as progress, meters."""
AHEAD = 1.0
"""A member of a group that is this far ahead of the last one walks at half speed, meters."""
PATIENCE = 10.0
"""Longest time for which a member of a group waits for the others at a stop, seconds."""

SPLIT = 134217729.0
"""Splits a double into halves of 26 bits."""


class PeopleMotion(NamedTuple):
    """People as arrays.

    Attributes:
        walkers: (n, 9) numbers and marks: (n, 4) of the people; see the columns.
        ways: (n, p, 3) points, meters, and the length of the way after each, meters.
        stops: (n, s, 3) x, y, meters, and duration, seconds. counts, groups: (n,) number of stops, and group.
    """

    walkers: Array
    marks: Marks
    ways: Array
    stops: Array
    counts: Marks
    groups: Marks


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
def _go_on(one: int, people: PeopleMotion) -> None:
    """Turn to the next stop."""
    walkers, marks = people.walkers, people.marks
    marks[one, STOP] = (marks[one, STOP] + 1) % people.counts[one]
    marks[one, STANDING], marks[one, POINTS] = 0, 0
    walkers[one, TO_GO], walkers[one, STALLED] = math.inf, 0.0


@inner
def _wait(one: int, people: PeopleMotion) -> None:
    """Stand until the time is over and the group is complete, or patience ends."""
    walkers, marks, groups = people.walkers, people.marks, people.groups
    together = True
    for k in range(len(marks)):
        if groups[k] == groups[one] and not marks[k, STANDING]:
            together = False
    walkers[one, GROUP_WAIT] += 0.0 if together else DT
    if together or walkers[one, GROUP_WAIT] > PATIENCE:
        walkers[one, WAITING] -= DT
    if walkers[one, WAITING] <= 0.0:
        _go_on(one, people)


@inner
def _taken(one: int, x: float, y: float, people: PeopleMotion, two: float) -> bool:
    """Return whether somebody else stands at a stop."""
    walkers, marks = people.walkers, people.marks
    for k in range(len(marks)):
        if k != one and marks[k, STANDING] and _square(walkers[k, X], walkers[k, Y], x, y, two) < TAKEN * TAKEN:
            return True
    return False


@inner
def _ahead(one: int, people: PeopleMotion, two: float) -> tuple[int, float]:
    """Pass the points that lie behind; return the number of the point to walk to, and the way to go, meters."""
    walkers, marks, way = people.walkers, people.marks, people.ways[one]
    last, place, x, y = marks[one, POINTS] - 1, marks[one, PASSED], walkers[one, X], walkers[one, Y]
    while place < last:
        ax, ay, bx, by = way[place - 1, 0], way[place - 1, 1], way[place, 0], way[place, 1]
        if (x - bx) * (bx - ax) + (y - by) * (by - ay) < 0.0:
            break
        place += 1
    if place != marks[one, PASSED]:
        marks[one, PASSED], walkers[one, BEYOND] = place, way[place, 2]
    rest = distance(x, y, way[place, 0], way[place, 1]) + walkers[one, BEYOND]
    while place < last and _square(way[place, 0], way[place, 1], x, y, two) < LOOKAHEAD * LOOKAHEAD:
        place += 1
    return place, rest


@inner
def _watch(one: int, to_go: float, people: PeopleMotion) -> None:
    """Plan anew, or give a stop up, after some time without progress."""
    walkers = people.walkers
    if to_go < walkers[one, TO_GO] - PROGRESS:
        walkers[one, TO_GO], walkers[one, STALLED] = to_go, 0.0
        return
    before = walkers[one, STALLED]
    walkers[one, STALLED] = before + DT
    if walkers[one, STALLED] >= GIVE_UP:
        _go_on(one, people)
    elif before < REPLAN and walkers[one, STALLED] >= REPLAN:
        people.marks[one, POINTS] = 0


@inner
def _pace(one: int, to_go: float, people: PeopleMotion, speed: float) -> float:
    """Return the speed of a person, m/s: members of a group wait for the last one."""
    walkers, marks, groups = people.walkers, people.marks, people.groups
    for k in range(len(marks)):
        if k == one or groups[k] != groups[one] or marks[k, STOP] != marks[one, STOP] or marks[k, STANDING]:
            continue
        if to_go + AHEAD < walkers[k, TO_GO] and walkers[k, TO_GO] < math.inf:
            return speed * 0.5
    return speed


@entry
def intend(people: PeopleMotion, preferred: Array, first: int, planned: bool, speed: float, two: float) -> int:
    """Write the velocities that people would have alone, advance their intentions, and return their number.

    Return the number of a person who needs a way first: it must be planned before the rest.

    Args:
        people: the people. preferred: (n, 2) velocities, m/s.
        first: person to begin with. planned: whether that person's way has just been planned. speed: m/s.
        two: the number 2: a power whose exponent the compiler knows is a product.
    """
    walkers, marks, stops, ways = people.walkers, people.marks, people.stops, people.ways
    for one in range(first, len(walkers)):
        preferred[one, 0], preferred[one, 1] = 0.0, 0.0
        if people.counts[one] == 0:
            continue
        if marks[one, STANDING]:
            _wait(one, people)
            continue
        x, y, stay = stops[one, marks[one, STOP], 0], stops[one, marks[one, STOP], 1], stops[one, marks[one, STOP], 2]
        away = math.sqrt(_square(x, y, walkers[one, X], walkers[one, Y], two))
        if away < ARRIVED or (away < QUEUE and _taken(one, x, y, people, two)):
            marks[one, STANDING], walkers[one, GROUP_WAIT], walkers[one, WAITING] = 1, 0.0, stay
            continue
        if marks[one, POINTS] == 0:
            if not planned or one != first:
                return one
            _go_on(one, people)
            continue
        place, to_go = _ahead(one, people, two)
        _watch(one, to_go, people)
        fastest = _pace(one, to_go, people, speed)
        dx, dy = ways[one, place, 0] - walkers[one, X], ways[one, place, 1] - walkers[one, Y]
        length = math.sqrt(dx * dx + dy * dy)
        if length == 0.0:
            continue
        pace = min(fastest, to_go / (2.0 * DT)) / length
        turn = TO_THE_RIGHT if to_go > LOOKAHEAD else 0.0
        preferred[one, 0], preferred[one, 1] = (dx + turn * dy) * pace, (dy - turn * dx) * pace
    return len(walkers)
