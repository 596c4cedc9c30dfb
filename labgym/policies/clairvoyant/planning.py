"""A drive to make, and its fastest way alone: the best of smooth paths with several first headings."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from labgym.envs.robot import ROBOT
from labgym.geometry import Array, wrap_angle
from labgym.navigation import Pose, ShortestPaths
from labgym.policies.clairvoyant.reference import ReferenceMotion, along_route, standing, turn, turning_time
from labgym.policies.clairvoyant.route import DriveLimits, Route, fastest_times
from labgym.policies.clairvoyant.smoothing import BandWeights, ClearanceField, smooth_path
from labgym.policies.policy import Foreknowledge

FIRST_BENDS_RAD = (0.0, 0.4, 0.8, 1.2, 1.6)
"""Angles of the bend with which the path begins after a turn in place, radians."""

LEAST_CLEARANCE_M = 0.285
"""Least clearance of a smooth path, meters."""

BANDS = (BandWeights(), BandWeights(radius=0.30, bend=0.005, twist=0.001))
"""Weights of paths: the second one for narrow places."""

TAUT_BAND = BandWeights(radius=0.305, bend=0.003, sharp=0.05, twist=0.0005)
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


@dataclass(frozen=True, eq=False, kw_only=True)
class WayRequest:
    """Requirements of a way.

    Attributes:
        field: of the true floor. limits: of the motion. heading: at the goal, radians; None for any.
        short: radius of the disc around the goal at whose edge the way ends, meters.
        taut: whether the length of the way counts, not its time.
    """

    field: ClearanceField
    limits: DriveLimits
    heading: float | None = None
    short: float = 0.0
    taut: bool = False


def fastest_way(points: Array, pose: Pose, request: WayRequest, quick: bool = False) -> Way | None:
    """Return the fastest of several ways along a polyline for a robot at rest; None if none is clear.

    Args:
        points: (m, 2) from the robot to the goal, meters. pose: of the robot. request: requirements of the way.
        quick: whether only the way with a turn in place is made.
    """
    best: Way | None = None
    field, limits, heading = request.field, request.limits, request.heading
    for band in (TAUT_BAND, *BANDS) if request.taut else BANDS:
        for left, end in [(None, None)] if quick or request.taut else _ends(points, field, band, pose, heading):
            path = smooth_path(points, field, band, left, end)
            route = Route.of(_cut(path, points[-1], request.short), limits, left)
            way = way_along(route, pose, limits, heading)
            if (best is None or way.seconds < best.seconds) and is_clear(route, field):
                best = way
        if best is not None:
            break
    return best


def way_along(route: Route, pose: Pose, limits: DriveLimits, heading: float | None) -> Way:
    """Return the way of a robot at rest at a pose along a route."""
    yaw = pose[2] + wrap_angle(float(route.yaw[0]) - pose[2])
    seconds = turning_time(yaw - pose[2], limits) + float(fastest_times(route, limits.acceleration)[1][-1])
    if heading is not None:
        seconds += turning_time(wrap_angle(heading - float(route.yaw[-1])), limits)
    return Way(yaw, route, heading, seconds)


def is_clear(route: Route, field: ClearanceField, least: float = LEAST_CLEARANCE_M) -> bool:
    """Return whether a route keeps its distance from barriers."""
    return float(field.barriers.clearance(route.points[::2]).min()) >= least


def _ends(
    points: Array, field: ClearanceField, band: BandWeights, pose: Pose, heading: float | None
) -> Sequence[tuple[float | None, float | None]]:
    """Return the headings at the ends of the paths that are tried."""
    first = smooth_path(points, field, band)
    if len(first) < 3:
        return [(None, None)]
    ahead = math.atan2(*(first[1] - first[0])[::-1].tolist())
    off = wrap_angle(ahead - pose[2])
    starts: list[float | None] = [None]
    for angle in FIRST_BENDS_RAD:
        if abs(off) < math.pi / 2.0 and angle >= abs(off):
            starts.append(pose[2])
            break
        if angle > 0.0 and angle < abs(off):
            starts.append(ahead - math.copysign(angle, off))
    ends: list[float | None] = [None] if heading is None else [None, heading]
    return [(start, end) for start in starts for end in ends]


def reference_of(
    way: Way, pose: Pose, limits: DriveLimits, time: float, weights: Sequence[float] = (1.0,)
) -> ReferenceMotion:
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


NUDGES = tuple((0.02 * ring, math.pi / 8.0 * k) for ring in range(1, 11) for k in range(16))
"""Distances, meters, and directions, radians, in which a free place is looked for."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Errand(WayRequest):
    """A drive to make.

    Attributes:
        world: the foreknowledge. paths: of the true floor. weights: of the filter of the motion.
    """

    world: Foreknowledge
    paths: ShortestPaths
    weights: Sequence[float]

    def points(self, pose: Pose) -> Array | None:
        """Return the shortest path from a pose to the goal, (n, 2) meters; None without a way.

        A robot that stands a little too near to something leaves for the nearest free place.
        """
        goal = self.world.goal[:2]
        path = self.paths.path(pose[:2], goal)
        if path is not None:
            return path.points
        for distance, angle in NUDGES:
            place = pose[0] + distance * math.cos(angle), pose[1] + distance * math.sin(angle)
            if self.paths.free(*place) and (path := self.paths.path(place, goal)) is not None:
                return np.vstack([pose[:2], path.points])
        return None

    def way(self, pose: Pose, quick: bool = False) -> Way | None:
        """Return the fastest way alone for a robot at rest; None without one."""
        points = self.points(pose)
        return None if points is None else fastest_way(points, pose, self, quick)
