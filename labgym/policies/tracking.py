"""The path tracker: pure pursuit whose speed respects the turns ahead and the robot's limits."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from labgym.envs.robot import ROBOT, RobotSpec, turn_rate
from labgym.errors import OptionError
from labgym.geometry import Array, rotate, wrap_angle
from labgym.navigation import Pose
from labgym.policies.gentle import GentleCommands, GentleLimits


@dataclass(frozen=True)
class TrackingOptions:
    """Options of `PathTracker`.

    Attributes:
        lookahead: distance along the path to the point that is steered for, at rest, meters.
        lookahead_time: time that is multiplied by the speed and added to it, seconds.
        turn_in_place: heading error beyond which the robot stops to turn, radians.
        drive_on: heading error below which it drives on, radians.
        lateral_acceleration: limit on the lateral acceleration in turns, m/s2.
        braking: deceleration before turns and the end of the path, m/s2.
        slowest: speed in the sharpest turn and at the end of the path, m/s.
        window: distance along the path within which the next nearest point is searched, meters.
        rest: whether the robot ends at rest; otherwise it passes the end at the slowest speed.
        last_turn: distance from the end within which a robot that ends at rest no longer turns in place to face it,
            meters.
    """

    lookahead: float = 0.20
    lookahead_time: float = 0.25
    turn_in_place: float = 1.0
    drive_on: float = 0.35
    lateral_acceleration: float = 0.7
    braking: float = 0.8
    slowest: float = 0.15
    window: float = 0.6
    rest: bool = False
    last_turn: float = 0.12


SPACING_M = 0.02
"""Distance between the samples of a path, meters."""
BEND_LENGTH_M = 0.20
"""Length over which the path's curvature is measured, meters."""
APPROACH_GAIN = 3.0
"""Speed per distance in the last centimeters before the robot rests, 1/s."""
END_DISTANCE_M = 0.01
"""Distance ahead of the robot at which it has arrived at the end of its path, meters."""
LAST_STRETCH_M = 0.12
"""Distance from the end within which the place of rest is judged by what is ahead of the robot, meters."""


class PathTracker:
    """Follows one path with the robot's velocities.

    Args:
        path: (n, 2) points in any fixed frame, meters; the robot may be off the path at the start.
        robot: limits of the robot.
        options: options of the tracker.
        turning: whether the robot first turns to face the path; False for a path that replaces one being followed.
        heading: heading to which a robot that rests at the end turns, radians in the path's frame; None for any.
        gentle: limits of a base that carries something, which every command obeys, or commands that another tracker
            has begun; None without.

    Raises:
        OptionError: the path is empty, not finite or not of shape (n, 2).
    """

    def __init__(
        self,
        path: ArrayLike,
        robot: RobotSpec = ROBOT,
        options: TrackingOptions | None = None,
        turning: bool = True,
        heading: float | None = None,
        gentle: GentleLimits | GentleCommands | None = None,
    ) -> None:
        points = np.asarray(path, dtype=np.float64)
        if points.ndim != 2 or points.shape[1] != 2 or len(points) == 0 or not np.isfinite(points).all():
            raise OptionError(f"path has shape {points.shape}; expected finite points of shape (n, 2), n at least 1")
        self._robot, self._options = robot, options or TrackingOptions()
        self._heading = heading
        self._commands: GentleCommands | None = None
        if gentle is not None:
            self._commands = gentle if isinstance(gentle, GentleCommands) else GentleCommands(gentle, robot)
            self._options = replace(
                self._options,
                lateral_acceleration=min(self._options.lateral_acceleration, self._commands.limits.lateral),
                braking=min(self._options.braking, 0.8 * self._commands.limits.acceleration),
            )
        self._points = points[-1:] if lengths_along(points)[-1] < 1e-9 else resampled(points, SPACING_M)
        self._speeds = _speed_limits(self._points, robot, self._options)
        self._place = 0
        self._turning = turning
        self._ended = False

    @property
    def ended(self) -> bool:
        """Whether the robot has come to the end of the path to rest there."""
        return self._ended

    @property
    def path(self) -> Array:
        """The path, (n, 2), at even steps of about 2 cm."""
        return self._points

    def action(self, pose: Pose, speed: float = 0.0) -> Array:
        """Return the action (2,) in [-1, 1] that follows the path from a pose.

        Args:
            pose: (x, y, yaw) in the path's frame.
            speed: forward velocity, m/s; a faster robot looks farther ahead.
        """
        v, curvature, turn = self._wanted(pose, speed)
        if self._commands is not None:
            v = self._commands.command(v)
            # A robot that has to stop before it turns keeps straight until it is slow.
            turn *= max(0.0, 1.0 - v / self._options.slowest)
        return velocities_to_action(v, v * curvature + turn, self._robot)

    def _wanted(self, pose: Pose, speed: float) -> tuple[float, float, float]:
        """Return the wanted forward velocity, m/s, the curvature of the way, 1/m, and the turn rate at rest, rad/s."""
        self._advance(pose)
        options = self._options
        left = self._left(pose) if options.rest else math.inf
        if self._ended:
            error = 0.0 if self._heading is None else wrap_angle(self._heading - pose[2])
            return 0.0, 0.0, turn_rate(error, self._robot)
        ahead = options.lookahead + options.lookahead_time * max(speed, 0.0)
        target = self._points[min(self._place + max(1, round(ahead / SPACING_M)), len(self._points) - 1)]
        x, y = rotate(target[0] - pose[0], target[1] - pose[1], -pose[2])
        bearing = math.atan2(y, x)
        if left > options.last_turn and self._must_turn(bearing):
            return 0.0, 0.0, turn_rate(bearing, self._robot)
        curvature = 2.0 * math.sin(bearing) / max(math.hypot(x, y), options.lookahead / 2.0)
        v = float(self._speeds[self._place]) * max(math.cos(bearing), 0.2)
        v = min(v, 0.9 * self._robot.w_max / max(abs(curvature), 1e-9), approach_speed(left, options.braking))
        return v, curvature, 0.0

    def _left(self, pose: Pose) -> float:
        """Return the distance to the end that is left for braking, meters, and note when the robot is at the end."""
        left = (len(self._points) - 1 - self._place) * SPACING_M
        if left <= LAST_STRETCH_M:
            end = self._points[-1]
            left = rotate(end[0] - pose[0], end[1] - pose[1], -pose[2])[0]
            self._ended = self._ended or left < END_DISTANCE_M
        delay = 0.0 if self._commands is None else self._commands.limits.delay * self._commands.speed
        return left - delay * self._robot.control_dt

    def _advance(self, pose: Pose) -> None:
        """Move the place on the path to the nearest sample within the window after the previous place."""
        end = self._place + max(2, round(self._options.window / SPACING_M))
        nearby = self._points[self._place : end] - np.asarray(pose[:2])
        self._place += int(np.argmin((nearby**2).sum(axis=1)))

    def _must_turn(self, bearing: float) -> bool:
        limit = self._options.drive_on if self._turning else self._options.turn_in_place
        self._turning = abs(bearing) > limit
        return self._turning


def approach_speed(distance: float, braking: float, gain: float = APPROACH_GAIN) -> float:
    """Return the speed from which the robot comes to rest within a distance, m/s.

    It brakes evenly and, over the last braking / gain^2 meters, in proportion to the distance that is left; it never
    brakes harder than `braking`.

    Args:
        distance: to the place of rest, meters; 0 or less gives 0. braking: deceleration, m/s2. gain: 1/s.
    """
    last = braking / gain**2
    if distance < last:
        return gain * max(distance, 0.0)
    return math.sqrt(2.0 * braking * (distance - last / 2.0))


def velocities_to_action(v: float, w: float, robot: RobotSpec = ROBOT) -> Array:
    """Return the action (2,) for v m/s and w rad/s, clipped to the limits; the inverse of `RobotSpec.twist`."""
    forward = v / robot.v_max if v >= 0.0 else v / -robot.v_min
    return np.array([min(max(forward, -1.0), 1.0), min(max(w / robot.w_max, -1.0), 1.0)])


def lengths_along(points: Array) -> Array:
    """Return the length of a polyline (n, 2) up to each of its points, (n,)."""
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])


def points_at(points: Array, lengths: Array) -> Array:
    """Return the points (m, 2) at lengths (m,) along a polyline (n, 2)."""
    along = lengths_along(points)
    return np.column_stack([np.interp(lengths, along, points[:, axis]) for axis in range(2)])


def resampled(points: Array, step: float) -> Array:
    """Return a polyline (n, 2) at even steps of about `step` meters, with the same ends."""
    length = lengths_along(points)[-1]
    return points_at(points, np.linspace(0.0, length, max(2, math.ceil(length / step) + 1)))


def _speed_limits(points: Array, robot: RobotSpec, options: TrackingOptions) -> Array:
    """Return the speed limit at each sample, (n,) m/s: from curvature, then from braking distance."""
    if len(points) < 3:
        return np.full(len(points), options.slowest)
    step = np.diff(points, axis=0)
    heading = np.unwrap(np.arctan2(step[:, 1], step[:, 0]))
    half = max(1, round(BEND_LENGTH_M / SPACING_M / 2.0))
    padded = np.pad(heading, half, mode="edge")
    turning = np.abs(padded[2 * half :] - padded[: -2 * half])
    curvature = np.append(turning, 0.0) / BEND_LENGTH_M
    with np.errstate(divide="ignore"):
        limit = np.minimum(np.sqrt(options.lateral_acceleration / curvature), 0.8 * robot.w_max / curvature)
    limit = np.clip(limit, options.slowest, robot.v_max)
    limit[-1] = options.slowest
    return braked(limit, 2.0 * options.braking * SPACING_M)


def braked(speeds: Array, gain: float) -> Array:
    """Return speeds (n,), m/s, from which every later one can be reached by braking.

    Args:
        speeds: limits at the points of a path. gain: greatest fall of their squares from point to point, m2/s2.
    """
    speeds = speeds.copy()
    for k in range(len(speeds) - 2, -1, -1):
        speeds[k] = min(speeds[k], math.sqrt(speeds[k + 1] ** 2 + gain))
    return speeds
