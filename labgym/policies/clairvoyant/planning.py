"""The fastest way alone: smooth paths with several first headings, and the time that each takes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labgym.envs.robot import ROBOT
from labgym.geometry import wrap_angle
from labgym.navigation import Pose
from labgym.policies.clairvoyant.clearance import ClearanceField
from labgym.policies.clairvoyant.reference import Reference, along_route, standing, turn, turning_time
from labgym.policies.clairvoyant.route import Limits, Route, fastest_times
from labgym.policies.clairvoyant.smoothing import Band, smooth_path

Array = NDArray[np.float64]

TURNS = (0.0, 0.4, 0.8, 1.2, 1.6)
"""Angles that the robot leaves to the path's first bend after a turn in place, radians."""
LEAST = 0.285
"""Least clearance of a smooth path, meters."""
BANDS = (Band(), Band(radius=0.30, bend=0.005, twist=0.001))
"""Weights of paths: the second one for narrow places."""

TAUT = Band(radius=0.305, bend=0.003, sharp=0.05, twist=0.0005)
"""Weights of paths whose length counts, not their time."""


@dataclass(frozen=True, eq=False)
class Way:
    """A way to the goal.

    Attributes:
        yaw: heading to which the robot turns first, radians. route: then. heading: to which it turns at the end; None
            for any. seconds: time that it takes alone.
    """

    yaw: float
    route: Route
    heading: float | None
    seconds: float


def fastest_way(
    points: Array,
    field: ClearanceField,
    pose: Pose,
    limits: Limits,
    heading: float | None = None,
    short: float = 0.0,
    quick: bool = False,
    taut: bool = False,
) -> Way | None:
    """Return the fastest of several ways along a polyline for a robot at rest; None if none is clear.

    Args:
        points: (m, 2) from the robot to the goal, meters. field: of the floor. pose: of the robot.
        limits: of the motion. heading: at the goal, radians; None for any.
        short: radius of the disc around the end at whose edge the way ends, meters.
        quick: whether only the way with a turn in place is made. taut: whether length counts, not time.
    """
    best: Way | None = None
    for band in (TAUT, *BANDS) if taut else BANDS:
        for left, end in [(None, None)] if quick or taut else _ends(points, field, band, pose, heading):
            path = smooth_path(points, field, band, left, end)
            route = Route.of(_cut(path, points[-1], short), limits, left)
            way = way_along(route, pose, limits, heading)
            if (best is None or way.seconds < best.seconds) and is_clear(route, field):
                best = way
        if best is not None:
            break
    return best


def way_along(route: Route, pose: Pose, limits: Limits, heading: float | None) -> Way:
    """Return the way of a robot at rest at a pose along a route."""
    yaw = pose[2] + wrap_angle(float(route.yaw[0]) - pose[2])
    seconds = turning_time(yaw - pose[2], limits) + float(fastest_times(route, limits.acceleration)[1][-1])
    if heading is not None:
        seconds += turning_time(wrap_angle(heading - float(route.yaw[-1])), limits)
    return Way(yaw, route, heading, seconds)


def is_clear(route: Route, field: ClearanceField, least: float = LEAST) -> bool:
    """Return whether a route keeps its distance from barriers."""
    return float(field.barriers.clearance(route.points[::2]).min()) >= least


def _ends(
    points: Array, field: ClearanceField, band: Band, pose: Pose, heading: float | None
) -> Sequence[tuple[float | None, float | None]]:
    """Return the headings at the ends of the paths that are tried."""
    first = smooth_path(points, field, band)
    if len(first) < 3:
        return [(None, None)]
    ahead = math.atan2(*(first[1] - first[0])[::-1].tolist())
    off = wrap_angle(ahead - pose[2])
    starts: list[float | None] = [None]
    for angle in TURNS:
        if abs(off) < math.pi / 2.0 and angle >= abs(off):
            starts.append(pose[2])
            break
        if angle > 0.0 and angle < abs(off):
            starts.append(ahead - math.copysign(angle, off))
    ends: list[float | None] = [None] if heading is None else [None, heading]
    return [(start, end) for start in starts for end in ends]


def reference_of(way: Way, pose: Pose, limits: Limits, time: float, weights: Sequence[float] = (1.0,)) -> Reference:
    """Return the motion of a robot at rest at a pose along a way.

    Args:
        way: the way. pose: of the robot. limits: of the motion. time: at which it begins, seconds.
        weights: of a filter of the motion along the way, newest first, with sum 1.
    """
    dt = ROBOT.control_dt
    reference = standing(time, dt, pose).then(*turn(pose, way.yaw, limits, dt))
    speeds, times = fastest_times(way.route, limits.acceleration)
    count = math.ceil(times[-1] / dt - 1e-9)
    steps = dt * np.arange(1, count + 1)
    along = way.route.spacing * np.arange(len(times))
    places, driven = filtered(np.interp(steps, times, along), np.interp(steps, times, speeds), weights)
    reference = reference.then(*along_route(way.route, places, driven))
    if way.heading is not None:
        last = reference.poses[-1].tolist()
        reference = reference.then(*turn(last, last[2] + wrap_angle(way.heading - last[2]), limits, dt))
    return reference


def filtered(places: Array, speeds: Array, weights: Sequence[float]) -> tuple[Array, Array]:
    """Return places and speeds (k + m,) that are the weighted means of the latest ones; at rest before and after."""
    late = len(weights) - 1
    last = places[-1] if len(places) else 0.0
    s = np.concatenate([np.zeros(late), places, np.full(late, last)])
    v = np.concatenate([np.zeros(late), speeds, np.zeros(late)])
    return np.convolve(s, weights, "valid"), np.convolve(v, weights, "valid")


def _cut(path: Array, goal: Array, short: float) -> Array:
    """Return a path up to where it enters a disc around the goal."""
    if short <= 0.0:
        return path
    outside = np.flatnonzero(np.linalg.norm(path - goal, axis=1) > short)
    if len(outside) == 0 or outside[-1] + 1 >= len(path):
        return path
    k = int(outside[-1])
    a, b = path[k], path[k + 1]
    lo, hi = 0.0, 1.0
    for _ in range(30):
        middle = 0.5 * (lo + hi)
        lo, hi = (middle, hi) if np.linalg.norm(a + (b - a) * middle - goal) > short else (lo, middle)
    return np.vstack([path[: k + 1], a + (b - a) * hi])
