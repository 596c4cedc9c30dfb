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
    along = route.spacing * np.arange(len(route.points))
    fastest = _braked(route, rise / dt)
    raw = before.tolist()
    for step in range(1, round(LONGEST / dt) + 1):
        if worth.points(step * dt, near) <= least:
            return None
        now, then = np.array(forecast.places), np.array(forecast.following)
        best = max(level - 1, 0)
        for following in (level + 1, level):
            reach = place + (level + following) * unit
            allowed = float(np.interp(reach, along, fastest)) + 1e-9
            if following <= gait.levels and following * rise <= max(allowed, rise if following > level else 0.0):
                if reach + following**2 * unit > route.length + unit:
                    continue
                if _safe(route, place, level, following, unit, now, then, apart, gait.delay):
                    best = following
                    break
        place = min(place + (level + best) * unit, route.length)
        level = best
        raw.append([place, level * rise])
        reached, v = (weights @ np.array(raw[: -len(weights) - 1 : -1])).tolist()
        (point,), (yaw,), (curvature,) = route.at(np.array([reached]))
        x, y = point.tolist()
        forecast.step(x, y, v * math.cos(yaw), v * math.sin(yaw), v * float(curvature))
        if min((math.dist((x, y), each) for each in forecast.places), default=math.inf) < NEAR:
            near += dt
        if level == 0 and place >= route.length - 2.5 * unit:
            places, speeds = np.array(raw[len(before) :]).T
            return Reaction(places, speeds, near, worth.points(step * dt, near))
    return None


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
