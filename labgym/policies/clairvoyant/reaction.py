"""A drive along a route that gives way: it goes when it can come to rest again before it touches anybody.

It is played through with the people who answer to it, so that it knows who goes around a robot at rest, who turns back,
and when the way is free.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labgym.policies.clairvoyant.reaction_kernel import Line, Terms, next_level, pose_at
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
    line, last = line_of(route, rise / dt), round(LONGEST / dt)
    terms = Terms(gait.levels, float(rise), unit, float(route.length), float(apart), float(gait.delay), LEAST)
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
        if min((math.dist((x, y), each) for each in forecast.places.tolist()), default=math.inf) < NEAR:
            near += dt
        if level == 0 and place >= route.length - 2.5 * unit:
            places, speeds = np.array(raw[len(before) :]).T
            return Reaction(places, speeds, near, worth.points(step * dt, near))
    return None


def line_of(route: Route, acceleration: float) -> Line:
    """Return the arrays of a route for a greatest acceleration, m/s2."""
    along: Array = route.spacing * np.arange(len(route.points), dtype=np.float64)
    values = np.vstack([route.points.T, route.yaw, route.curvature])
    return Line(along, values, _braked(route, acceleration))


def _braked(route: Route, acceleration: float) -> Array:
    """Return the speeds (n,) from which every later limit can be kept."""
    speeds = route.fastest.copy()
    gain = 2.0 * acceleration * route.spacing
    for k in range(len(speeds) - 2, -1, -1):
        speeds[k] = min(speeds[k], math.sqrt(speeds[k + 1] ** 2 + gain))
    return speeds
