"""The motion that the robot is to follow, turns in place and routes, and the motion of a robot that follows it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from labgym.envs.robot import ROBOT, RobotSpec
from labgym.geometry import Array, wrap_angle
from labgym.machine_code import entry, inner
from labgym.navigation import Pose
from labgym.policies.clairvoyant.route import DriveLimits, Route

GAIN_ALONG, GAIN_ACROSS, GAIN_YAW = 2.0, 8.0, 4.0
"""Speed per deviation along the way, 1/s; turn rate per deviation across it and meter driven, 1/m2; and per deviation
of the heading, 1/s."""

WAIT_LAG_M = 0.04
"""Distance behind the reference from which it waits for the robot, meters."""


@inner
def _clipped(value: float, low: float, high: float) -> float:
    """Return `min(max(value, low), high)` as Python does, also for zeros with a sign."""
    if low > value:
        value = low
    return high if high < value else value


@inner
def _wrapped(angle: float) -> float:
    """As `labgym.geometry.wrap_angle`."""
    return math.pi - (math.pi - angle) % (2.0 * math.pi)


@inner
def _place(time: float, start: float, dt: float, count: int) -> tuple[int, int, float]:
    """Return the numbers of the poses before and after a time, and the share of the second; as `ReferenceMotion.at`."""
    place = _clipped((time - start) / dt, 0.0, count - 1.0)
    now = min(int(place + 1e-6), count - 2) if count > 1 else 0
    return now, min(now + 1, count - 1), place - now


class Base(NamedTuple):
    """The limits of the robot and its simulation, as in `RobotSpec`."""

    v_min: float
    v_max: float
    w_max: float
    acceleration: float
    turn_acceleration: float
    lag: float
    timestep: float
    substeps: int


@entry
def follow(
    poses: Array,
    velocities: Array,
    span: tuple[float, float, float],
    first: tuple[float, float, float, float, float],
    steps: int,
    gains: tuple[float, float, float],
    base: Base,
) -> Array:
    """Return x, y, yaw, v and w at the start and after each step of a robot that follows a reference, (steps + 1, 5).

    Args:
        poses: (k, 3) and velocities: (k, 2) of the reference.
        span: start and time step of the reference, and the time now, seconds.
        first: x, y, yaw, v and w now. steps: number of control steps. gains: along, across and of the heading.
        base: the robot.
    """
    start, dt, begin = span
    along_gain, across_gain, yaw_gain = gains
    v_min, v_max, w_max, timestep = base.v_min, base.v_max, base.w_max, base.timestep
    count = len(poses)
    motion = np.empty((steps + 1, 5))
    x, y, yaw, v, w = first
    motion[0] = first
    for step in range(steps):
        time = begin + step * dt
        now, after, share = _place(time, start, dt, count)
        there_x = (1.0 - share) * poses[now, 0] + share * poses[after, 0]
        there_y = (1.0 - share) * poses[now, 1] + share * poses[after, 1]
        there_yaw = (1.0 - share) * poses[now, 2] + share * poses[after, 2]
        now, after, share = _place(time + dt, start, dt, count)
        forward = (1.0 - share) * velocities[now, 0] + share * velocities[after, 0]
        turn = (1.0 - share) * velocities[now, 1] + share * velocities[after, 1]
        cosine, sine = math.cos(yaw), math.sin(yaw)
        dx, dy, off = there_x - x, there_y - y, _wrapped(there_yaw - yaw)
        along, across = cosine * dx + sine * dy, cosine * dy - sine * dx
        turn = turn + across_gain * forward * across + yaw_gain * math.sin(off)
        forward = forward * math.cos(off) + along_gain * along
        forward = _clipped(forward / v_max if forward >= 0.0 else forward / -v_min, -1.0, 1.0)
        forward = forward * (v_max if forward >= 0.0 else -v_min)
        turn = _clipped(turn / w_max, -1.0, 1.0) * w_max
        for _ in range(base.substeps):
            rise, swing = base.acceleration * timestep, base.turn_acceleration * timestep
            v += _clipped((forward - v) * timestep / (base.lag + timestep), -rise, rise)
            w += _clipped((turn - w) * timestep / (base.lag + timestep), -swing, swing)
            yaw += w * timestep
            x, y = x + v * math.cos(yaw) * timestep, y + v * math.sin(yaw) * timestep
        yaw = _wrapped(yaw)
        motion[step + 1] = x, y, yaw, v, w
    return motion


@dataclass(frozen=True, eq=False)
class Rehearsal:
    """The motion at even times.

    Attributes:
        start: time of the first pose, seconds. dt: time between them, seconds.
        poses: (k, 3) meters and radians. velocities: (k, 2) m/s and rad/s.
    """

    start: float
    dt: float
    poses: Array
    velocities: Array

    def at(self, time: float) -> tuple[float, float, float, float, float]:
        """Return x, y, vx, vy (m and m/s) and the turn rate (rad/s) at a time; at rest at the end after it."""
        index = round((time - self.start) / self.dt)
        last = len(self.poses) - 1
        x, y, yaw = self.poses[min(max(index, 0), last)].tolist()
        v, w = self.velocities[max(index, 0)].tolist() if index <= last else (0.0, 0.0)
        return x, y, v * math.cos(yaw), v * math.sin(yaw), w


def rehearsed(
    reference: ReferenceMotion,
    pose: Pose,
    velocity: tuple[float, float],
    time: float,
    robot: RobotSpec = ROBOT,
) -> Rehearsal:
    """Return the motion that follows a reference from a pose and a velocity at a time until its end.

    Args:
        reference: the motion to follow. pose, velocity, time: of the robot now.
        robot: its limits.
    """
    motion = follow(
        reference.poses,
        reference.velocities,
        (reference.start, reference.dt, time),
        (float(pose[0]), float(pose[1]), float(pose[2]), float(velocity[0]), float(velocity[1])),
        max(0, round((reference.end - time) / reference.dt)),
        (GAIN_ALONG, GAIN_ACROSS, GAIN_YAW),
        Base(
            robot.v_min,
            robot.v_max,
            robot.w_max,
            robot.acceleration,
            robot.turn_acceleration,
            robot.lag,
            robot.timestep,
            robot.substeps,
        ),
    )
    return Rehearsal(time, reference.dt, motion[:, :3], motion[:, 3:])


@dataclass(frozen=True, eq=False)
class ReferenceMotion:
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
        return (along - WAIT_LAG_M) / v if v > 0.1 and along > WAIT_LAG_M else 0.0

    def then(self, poses: Array, velocities: Array) -> ReferenceMotion:
        """Return the motion with another after its last pose, which is not repeated; (m, 3) and (m, 2)."""
        return ReferenceMotion(
            self.start, self.dt, np.concatenate([self.poses, poses]), np.concatenate([self.velocities, velocities])
        )


def standing(start: float, dt: float, pose: Sequence[float]) -> ReferenceMotion:
    """Return a motion that has one pose, at rest."""
    return ReferenceMotion(start, dt, np.array([pose], dtype=np.float64), np.zeros((1, 2)))


def turn(pose: Sequence[float], yaw: float, limits: DriveLimits, dt: float) -> tuple[Array, Array]:
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


def turning_time(angle: float, limits: DriveLimits) -> float:
    """Return the time of a turn in place by an angle, radians, in seconds."""
    peak = min(limits.turn, math.sqrt(abs(angle) * limits.turn_acceleration))
    return 0.0 if peak == 0.0 else abs(angle) / peak + peak / limits.turn_acceleration


def along_route(route: Route, places: Array, speeds: Array) -> tuple[Array, Array]:
    """Return the poses (k, 3) and velocities (k, 2) at lengths along a route (k,), meters, and speeds (k,), m/s."""
    points, yaw, curvature = route.at(places)
    return np.column_stack([points, yaw]), np.column_stack([speeds, speeds * curvature])
