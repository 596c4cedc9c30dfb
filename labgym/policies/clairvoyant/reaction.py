"""A drive along a route that gives way: it goes when it can come to rest again before it touches anybody.

It is played through with the people who answer to it, so that it knows who goes around a robot at rest, who turns back,
and when the way is free.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from labgym.envs.robot import ROBOT
from labgym.geometry import Array
from labgym.machine_code import entry, inner
from labgym.policies.clairvoyant.route import Gait, Route
from labgym.policies.clairvoyant.worth import NEAR_PEOPLE_M, Worth
from labgym.policies.policy import PeopleForecast
from labgym.policies.tracking import braked

LEAVING_DISTANCE_M = 0.60
"""Least distance between the centers of a person and of a robot that drives away from them, meters."""

LONGEST_DRIVE_S = 45.0
"""Longest drive that is played through, seconds."""


class RouteLine(NamedTuple):
    """A route as arrays.

    Attributes:
        along: (n,) lengths at its points at even steps from 0, meters. values: (4, n) x, y, headings and curvatures.
        braked: (n,) speeds from which every later limit can be kept, m/s.
    """

    along: Array
    values: Array
    braked: Array


class YieldTerms(NamedTuple):
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
def pose_at(place: float, line: RouteLine) -> tuple[float, float, float, float]:
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
def _nearest(place: float, step: float, line: RouteLine, now: Array, then: Array) -> float:
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
def _safe(
    place: float, level: int, following: int, line: RouteLine, now: Array, then: Array, terms: YieldTerms
) -> bool:
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
def next_level(place: float, level: int, line: RouteLine, now: Array, then: Array, terms: YieldTerms) -> int:
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


@dataclass(frozen=True, eq=False)
class YieldingDrive:
    """A drive that gives way.

    Attributes:
        places: (k,) lengths along the route after each step, meters. speeds: (k,) m/s.
        near: seconds near people. points: of the drive.
    """

    places: Array
    speeds: Array
    near: float
    points: float


def yielding_drive(
    route: Route,
    forecast: PeopleForecast,
    worth: Worth,
    apart: float,
    gait: Gait,
    before: Array,
    least: float = -math.inf,
) -> YieldingDrive | None:
    """Return the drive along a route that gives way to people; None if it is not worth more than `least`.

    Args:
        route: with its speed limits. forecast: the people; it is advanced. worth: of the drive.
        apart: distance that the robot keeps while it moves, meters.
        gait: speeds, and the filter after them. before: (k, 2) places, meters, and speeds, m/s, until now, before the
            filter. least: points.
    """
    dt = ROBOT.control_dt
    rise, weights = gait.rise, np.array(gait.weights)
    unit = 0.5 * rise * dt
    place, level, near = float(before[-1, 0]), min(round(float(before[-1, 1]) / rise), gait.levels), 0.0
    line, last = line_of(route, rise / dt), round(LONGEST_DRIVE_S / dt)
    terms = YieldTerms(
        gait.levels, float(rise), unit, float(route.length), float(apart), float(gait.delay), LEAVING_DISTANCE_M
    )
    raw = before.tolist()
    for step in range(1, last + 1):
        # At the greatest speed all the time the drive would end in this step; it is worth no more than that.
        left = (route.length - 2.5 * unit - place) / (2.0 * gait.levels * unit)
        soonest = step + max(math.ceil(left - 1e-6), 1) - 1
        if soonest > last or worth.points(soonest * dt, near) <= least:
            return None
        level_before = level
        level = next_level(place, level, line, forecast.places, forecast.following, terms)
        place = min(place + (level_before + level) * unit, route.length)
        raw.append([place, level * rise])
        reached, v = (weights[:, None] * raw[: -len(weights) - 1 : -1]).sum(axis=0).tolist()
        x, y, yaw, curvature = pose_at(reached, line)
        forecast.step(x, y, v * math.cos(yaw), v * math.sin(yaw), v * curvature)
        if min((math.dist((x, y), each) for each in forecast.places.tolist()), default=math.inf) < NEAR_PEOPLE_M:
            near += dt
        if level == 0 and place >= route.length - 2.5 * unit:
            places, speeds = np.array(raw[len(before) :]).T
            return YieldingDrive(places, speeds, near, worth.points(step * dt, near))
    return None


def line_of(route: Route, acceleration: float) -> RouteLine:
    """Return the arrays of a route for a greatest acceleration, m/s2."""
    along: Array = route.spacing * np.arange(len(route.points), dtype=np.float64)
    values = np.vstack([route.points.T, route.yaw, route.curvature])
    return RouteLine(along, values, braked(route.fastest, 2.0 * acceleration * route.spacing))
