"""A route: a path with its headings and the speed that it allows."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from labgym.envs.robot import ROBOT
from labgym.geometry import Array
from labgym.policies.tracking import braked, lengths_along, resampled

SPACING_M = 0.02
"""Distance between the samples of a route, meters."""
LOWEST_SPEED_LIMIT = 0.10
"""Least speed limit, m/s."""


@dataclass(frozen=True)
class DriveLimits:
    """Limits of the motion; less than the robot's, to have some left for corrections.

    Attributes:
        speed: m/s. acceleration: along the way, m/s2. lateral: across it, m/s2.
        turn: rate, rad/s. turn_acceleration: rad/s2.
    """

    speed: float = 1.0
    acceleration: float = 1.4
    lateral: float = 2.0
    turn: float = 1.4
    turn_acceleration: float = 3.2


@dataclass(frozen=True)
class Gait:
    """How speeds follow each other.

    Attributes:
        levels: number of speeds above 0. rise: from one to the next in a control step, m/s.
        weights: of the filter that the speeds pass, newest first, with sum 1.
    """

    levels: int
    rise: float
    weights: tuple[float, ...] = (1.0,)

    @classmethod
    def of(cls, limits: DriveLimits, weights: Sequence[float] = (1.0,)) -> Gait:
        """Return the gait that reaches the greatest speed within the acceleration."""
        levels = math.ceil(limits.speed / (limits.acceleration * ROBOT.control_dt) - 1e-9)
        return cls(levels, limits.speed / levels, tuple(weights))

    @property
    def delay(self) -> float:
        """The delay of the filter, control steps."""
        return sum(age * weight for age, weight in enumerate(self.weights))


@dataclass(frozen=True, eq=False)
class Route:
    """A path at even steps.

    Attributes:
        points: (n, 2) meters. yaw: (n,) headings, radians, without jumps. spacing: of the points, meters.
        curvature: (n,) 1/m. fastest: (n,) speed limits, m/s.
    """

    points: Array
    yaw: Array
    spacing: float
    curvature: Array
    fastest: Array

    @classmethod
    def of(cls, path: Array, limits: DriveLimits, start_yaw: float | None = None) -> Route:
        """Return the route along a polyline (m, 2).

        Args:
            path: meters. limits: of the motion. start_yaw: heading at the first point, radians; None for the path's.
        """
        points = _rounded(path)
        spacing = float(np.linalg.norm(points[1] - points[0]))
        step = np.gradient(points, axis=0)
        yaw = np.unwrap(np.arctan2(step[:, 1], step[:, 0]))
        if start_yaw is not None:
            yaw = yaw + 2.0 * math.pi * round((start_yaw - float(yaw[0])) / (2.0 * math.pi))
        curvature = np.gradient(yaw, spacing)
        twist = np.abs(np.gradient(curvature, spacing))
        with np.errstate(divide="ignore", invalid="ignore"):
            fastest = np.minimum(limits.turn, np.sqrt(limits.lateral * np.abs(curvature))) / np.abs(curvature)
            fastest = np.fmin(fastest, np.sqrt(limits.turn_acceleration / twist))
        return cls(
            points, yaw, spacing, curvature, np.clip(np.nan_to_num(fastest, nan=9.0), LOWEST_SPEED_LIMIT, limits.speed)
        )

    @property
    def length(self) -> float:
        """Meters."""
        return self.spacing * (len(self.points) - 1)

    def at(self, places: Array) -> tuple[Array, Array, Array]:
        """Return the points (k, 2), headings (k,) and curvatures (k,) at lengths along the route (k,), meters."""
        along = self.spacing * np.arange(len(self.points))
        points = np.column_stack([np.interp(places, along, self.points[:, axis]) for axis in range(2)])
        return points, np.interp(places, along, self.yaw), np.interp(places, along, self.curvature)


def fastest_times(route: Route, acceleration: float, speed: float = 0.0) -> tuple[Array, Array]:
    """Return the speeds (n,), m/s, and times (n,), s, at the points of a route, at rest at its end.

    Args:
        route: with its speed limits. acceleration: along the way, m/s2. speed: at its start, m/s.
    """
    speeds = route.fastest.copy()
    speeds[0], speeds[-1] = min(speed, speeds[0]), 0.0
    gain = 2.0 * acceleration * route.spacing
    for k in range(1, len(speeds)):
        speeds[k] = min(speeds[k], math.sqrt(speeds[k - 1] ** 2 + gain))
    speeds = braked(speeds, gain)
    middle = 0.5 * (speeds[1:] + speeds[:-1])
    return speeds, np.concatenate([[0.0], np.cumsum(route.spacing / np.maximum(middle, 1e-3))])


def _rounded(path: Array) -> Array:
    """Return points at even steps of about 2 cm on the cubic spline through a path, (n, 2)."""
    if len(path) < 3:
        return resampled(path, SPACING_M)
    along = lengths_along(path)
    spline = CubicSpline(along, path)
    return resampled(spline(np.linspace(0.0, along[-1], math.ceil(along[-1] / SPACING_M) * 2 + 1)), SPACING_M)
