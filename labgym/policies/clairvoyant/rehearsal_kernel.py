"""The motion of a robot that follows a reference.

Every operation is that of `Reference.wanted`, `velocities_to_action` and `DeadReckoning.drive`, in the same order:
a test compares the bits.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from labgym.machine_code import entry, inner

Array = NDArray[np.float64]


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
    """Return the numbers of the poses before and after a time, and the share of the second; as `Reference.at`."""
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
