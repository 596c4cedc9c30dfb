"""The motion that the robot is to follow, at the control steps: turns in place and routes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labgym.geometry import wrap_angle
from labgym.navigation import Pose
from labgym.policies.clairvoyant.route import Limits, Route

Array = NDArray[np.float64]

GAIN_ALONG, GAIN_ACROSS, GAIN_YAW = 2.0, 8.0, 4.0
"""Speed per deviation along the way, 1/s; turn rate per deviation across it and meter driven, 1/m2; and per deviation
of the heading, 1/s."""
LAG = 0.04
"""Distance behind the reference from which it waits for the robot, meters."""


@dataclass(frozen=True, eq=False)
class Reference:
    """Poses and velocities at even times.

    Attributes:
        start: time of the first, seconds. dt: time between them, seconds.
        poses: (k, 3) meters and radians, headings without jumps. velocities: (k, 2) m/s and rad/s.
    """

    start: float
    dt: float
    poses: Array
    velocities: Array

    @property
    def end(self) -> float:
        """Time of the last pose, seconds."""
        return self.start + self.dt * (len(self.poses) - 1)

    def index(self, time: float) -> int:
        """Return the number of the pose at a time; the last one after the end."""
        return min(max(round((time - self.start) / self.dt), 0), len(self.poses) - 1)

    def at(self, time: float) -> tuple[list[float], list[float]]:
        """Return pose and velocities at a time, interpolated; those of the ends before and after."""
        place = min(max((time - self.start) / self.dt, 0.0), len(self.poses) - 1.0)
        now = min(int(place + 1e-6), len(self.poses) - 2) if len(self.poses) > 1 else 0
        share, after = place - now, min(now + 1, len(self.poses) - 1)
        pose = (1.0 - share) * self.poses[now] + share * self.poses[after]
        velocity = (1.0 - share) * self.velocities[now] + share * self.velocities[after]
        return pose.tolist(), velocity.tolist()

    def wanted(self, time: float, pose: Pose) -> tuple[float, float]:
        """Return the velocities to command at a time, m/s and rad/s, for a robot at a pose (Kanayama et al. 1990)."""
        (x, y, yaw), (v, w) = self.at(time)[0], self.at(time + self.dt)[1]
        cosine, sine = math.cos(pose[2]), math.sin(pose[2])
        dx, dy, off = x - pose[0], y - pose[1], wrap_angle(yaw - pose[2])
        along, across = cosine * dx + sine * dy, cosine * dy - sine * dx
        return v * math.cos(off) + GAIN_ALONG * along, w + GAIN_ACROSS * v * across + GAIN_YAW * math.sin(off)

    def behind(self, time: float, pose: Pose) -> float:
        """Return the time by which a robot at a pose lags further behind than it can catch up, seconds."""
        (x, y, yaw), (v, _) = self.at(time)
        along = math.cos(yaw) * (x - pose[0]) + math.sin(yaw) * (y - pose[1])
        return (along - LAG) / v if v > 0.1 and along > LAG else 0.0

    def then(self, poses: Array, velocities: Array) -> Reference:
        """Return the motion with another after its last pose, which is not repeated; (m, 3) and (m, 2)."""
        return Reference(
            self.start, self.dt, np.concatenate([self.poses, poses]), np.concatenate([self.velocities, velocities])
        )


def standing(start: float, dt: float, pose: Sequence[float]) -> Reference:
    """Return a motion that has one pose, at rest."""
    return Reference(start, dt, np.array([pose], dtype=np.float64), np.zeros((1, 2)))


def turn(pose: Sequence[float], yaw: float, limits: Limits, dt: float) -> tuple[Array, Array]:
    """Return the poses (k, 3) and velocities (k, 2) after each step of a turn in place to a heading, radians."""
    angle = yaw - pose[2]
    duration = turning_time(angle, limits)
    count = math.ceil(duration / dt - 1e-9)
    if count == 0:
        return np.zeros((0, 3)), np.zeros((0, 2))
    # The same turn in a whole number of steps: slower by a little.
    slower = duration / (count * dt)
    times = np.minimum(dt * slower * np.arange(1, count + 1), duration)
    acceleration = limits.turn_acceleration
    peak = min(limits.turn, math.sqrt(abs(angle) * acceleration))
    ramp = peak / acceleration
    rising, falling = np.minimum(times, ramp), np.maximum(times - (duration - ramp), 0.0)
    rate = acceleration * (rising - falling)
    turned = 0.5 * acceleration * rising**2 + peak * np.maximum(times - ramp, 0.0) - 0.5 * acceleration * falling**2
    sign = math.copysign(1.0, angle)
    poses = np.column_stack([np.full(count, pose[0]), np.full(count, pose[1]), pose[2] + sign * turned])
    poses[-1, 2] = yaw
    return poses, np.column_stack([np.zeros(count), sign * slower * rate])


def turning_time(angle: float, limits: Limits) -> float:
    """Return the time of a turn in place by an angle, radians, in seconds."""
    peak = min(limits.turn, math.sqrt(abs(angle) * limits.turn_acceleration))
    return 0.0 if peak == 0.0 else abs(angle) / peak + peak / limits.turn_acceleration


def along_route(route: Route, places: Array, speeds: Array) -> tuple[Array, Array]:
    """Return the poses (k, 3) and velocities (k, 2) at lengths along a route (k,), meters, and speeds (k,), m/s."""
    points, yaw, curvature = route.at(places)
    return np.column_stack([points, yaw]), np.column_stack([speeds, speeds * curvature])
