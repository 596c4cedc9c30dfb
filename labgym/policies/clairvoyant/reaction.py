"""A drive along a route that gives way: it goes when it can come to rest again before it touches anybody.

It is played through with the people who answer to it, so that it knows who goes around a robot at rest, who turns back,
and when the way is free.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from labgym.policies.clairvoyant.kernels import kernels
from labgym.policies.clairvoyant.route import Gait, Route
from labgym.policies.clairvoyant.worth import NEAR, Worth
from labgym.policies.foreknowledge import Forecast

Array = NDArray[np.float64]

LEAST = 0.60
"""Distance that the robot keeps while it moves even if it has to leave somebody, meters."""
LONGEST = 45.0
"""Longest drive that is played through, seconds."""


@dataclass(frozen=True, eq=False)
class Reaction:
    """A drive that gives way.

    Attributes:
        places: (k,) lengths along the route after each step, meters. speeds: (k,) m/s.
        near: seconds near people. points: of the drive.
    """

    places: Array
    speeds: Array
    near: float
    points: float


def reacting(
    route: Route,
    forecast: Forecast,
    worth: Worth,
    apart: float,
    gait: Gait,
    before: Array,
    dt: float = 0.1,
    least: float = -math.inf,
) -> Reaction | None:
    """Return the drive along a route that gives way to people; None if it is not worth more than `least`.

    Args:
        route: with its speed limits. forecast: the people; it is advanced. worth: of the drive.
        apart: distance that the robot keeps while it moves, meters.
        gait: speeds, and the filter after them. before: (k, 2) places, meters, and speeds, m/s, until now, before the
            filter. dt: seconds. least: points.
    """
    rise, weights = gait.rise, np.array(gait.weights)
    unit = 0.5 * rise * dt
    place, level, near = float(before[-1, 0]), min(round(float(before[-1, 1]) / rise), gait.levels), 0.0
    line, last = Line.of(route, rise / dt), round(LONGEST / dt)
    raw = before.tolist()
    for step in range(1, last + 1):
        # At the greatest speed all the time the drive would end in this step; it is worth no more than that.
        left = (route.length - 2.5 * unit - place) / (2.0 * gait.levels * unit)
        soonest = step + max(math.ceil(left - 1e-6), 1) - 1
        if soonest > last or worth.points(soonest * dt, near) <= least:
            return None
        level_before, level = level, _choice(line, place, level, gait, unit, forecast.places, forecast.following, apart)
        place = min(place + (level_before + level) * unit, route.length)
        raw.append([place, level * rise])
        reached, v = (weights[:, None] * raw[: -len(weights) - 1 : -1]).sum(axis=0).tolist()
        x, y, yaw, curvature = line.at(reached)
        forecast.step(x, y, v * math.cos(yaw), v * math.sin(yaw), v * curvature)
        if min((math.dist((x, y), each) for each in forecast.places.tolist()), default=math.inf) < NEAR:
            near += dt
        if level == 0 and place >= route.length - 2.5 * unit:
            places, speeds = np.array(raw[len(before) :]).T
            return Reaction(places, speeds, near, worth.points(step * dt, near))
    return None


@dataclass(frozen=True, eq=False)
class Line:
    """A route as arrays.

    Attributes:
        route: the route. along: (n,) lengths at its points, meters. values: (4, n) x, y, headings and curvatures.
        braked: (n,) speeds from which every later limit can be kept, m/s.
    """

    route: Route
    along: Array
    values: Array
    braked: Array

    @classmethod
    def of(cls, route: Route, acceleration: float) -> Line:
        """Return the arrays of a route for a greatest acceleration, m/s2."""
        along: Array = route.spacing * np.arange(len(route.points), dtype=np.float64)
        values = np.vstack([route.points.T, route.yaw, route.curvature])
        return cls(route, along, values, _braked(route, acceleration))

    def at(self, place: float) -> tuple[float, float, float, float]:
        """Return x, y, heading and curvature at a length along the route, meters."""
        compiled = kernels()
        if compiled is not None:
            located: tuple[float, float, float, float] = compiled.located(place, self.along, self.values)
            return located
        (point,), (yaw,), (curvature,) = self.route.at(np.array([place]))
        return float(point[0]), float(point[1]), float(yaw), float(curvature)


def _choice(
    line: Line, place: float, level: int, gait: Gait, unit: float, now: Array, then: Array, apart: float
) -> int:
    """Return the next speed: the greatest within the limits that is safe, or the one below.

    Args:
        line: the route. place, level: the robot's. gait: speeds. unit: way for each sum of levels in a step, meters.
        now, then: (n, 2) people now and after a step, meters. apart: distance to keep, meters.
    """
    rise, length, compiled = gait.rise, line.route.length, kernels()
    if compiled is not None:
        terms = unit, length, apart, gait.delay, LEAST
        levels = level, gait.levels
        return compiled.choice(place, *levels, rise, line.along, line.values, line.braked, now, then, terms)
    for following in (level + 1, level):
        reach = place + (level + following) * unit
        allowed = float(np.interp(reach, line.along, line.braked)) + 1e-9
        if following > gait.levels or following * rise > max(allowed, rise if following > level else 0.0):
            continue
        if reach + following**2 * unit > length + unit:
            continue
        if _safe(line.route, place, level, following, unit, now, then, apart, gait.delay):
            return following
    return max(level - 1, 0)


def _safe(
    route: Route,
    place: float,
    level: int,
    following: int,
    unit: float,
    now: Array,
    then: Array,
    apart: float,
    delay: float,
) -> bool:
    """Return whether the robot may take a speed: whether it then still rests before it touches anybody.

    Its places are reached some steps later, the delay of the filter.
    """
    if len(now) == 0:
        return True
    levels = [level, following]
    if following > level == 0:
        # Setting off must be worth it: at least half a second of motion.
        levels += [2, 2]
    levels += list(range(levels[-1] - 1, -1, -1))
    moves = unit * np.cumsum([before + after for before, after in pairwise(levels)])
    spots = np.minimum(place + np.concatenate([[0.0], moves]), route.length)
    points, steps = route.at(spots)[0], np.arange(len(spots))
    people = now[None] + (then - now)[None] * (steps + delay)[:, None, None]
    away = np.hypot(*(points[:, None] - people).transpose(2, 0, 1)).min(axis=1)
    # Somebody at the robot's side may be left behind, but not approached.
    limit = apart if away[0] >= apart else max(float(away[0]), LEAST)
    return bool((away[1:] >= limit - 1e-9).all())


def _braked(route: Route, acceleration: float) -> Array:
    """Return the speeds (n,) from which every later limit can be kept."""
    speeds = route.fastest.copy()
    gain = 2.0 * acceleration * route.spacing
    for k in range(len(speeds) - 2, -1, -1):
        speeds[k] = min(speeds[k], math.sqrt(speeds[k + 1] ** 2 + gain))
    return speeds
