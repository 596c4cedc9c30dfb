"""Sensors of contact and of the way driven, and the goal and the velocity as known by odometry."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
from gymnasium import spaces

from labgym.envs.checks import MAX_METERS, finite, positive
from labgym.envs.parts.noise import NoisySensor
from labgym.envs.parts.protocols import Noise, Reading
from labgym.envs.parts.registry import registered
from labgym.envs.parts.vectors import POSITION_RANGE, GoalSensor, VelocitySensor, planar, polar
from labgym.envs.state import Pose, State
from labgym.errors import OptionError
from labgym.geometry import rotate, wrap_angle

DRIFT = ("along", "heading", "turning", "stretch", "veer", "overturn")
"""The fields of `OdometrySensor` that are errors."""
RECKONED = "reckoned"
"""Key of the pose by odometry among what sensors share (`State.views`)."""


@registered("sensor", "bumper")
class BumperSensor(NoisySensor):
    """Whether the robot touched something during the action: (1,) float32, 0 or 1."""

    name: str = "bumper"
    noise: tuple[Noise, ...] = ()

    @property
    def space(self) -> spaces.Space[Any]:
        """From 0 to 1."""
        return spaces.Box(0.0, 1.0, (1,), np.float32)

    def measured(self, state: State) -> Reading:
        """Return 1 after a contact."""
        return np.array([state.collision], np.float32)


@registered("sensor", "odometry", frozen=False)
class OdometrySensor(NoisySensor):
    """The pose by dead reckoning, in the frame of the start: (4,) float32, x and y in m, cosine and sine of the yaw.

    Its errors are independent normal errors of the increments, whose variances grow with the way driven and the angle
    turned, so that the drift does not depend on how often it is read; a robot at rest does not drift. With all
    deviations 0 it is the true pose. RoboTHOR's errors, 5 mm and 0.5 degrees per 0.25 m, are `along=0.01, heading=1.0`.

    Attributes:
        along: standard deviation along the way after one meter, m. heading: of the yaw after one meter, degrees.
        turning: of the yaw after one turn of 360 degrees, degrees.
        stretch: mean error of the way as a share of it. veer: of the yaw, degrees per meter. overturn: of a turn as a
            share of it. These repeat in every episode.
        reach: x and y are clipped to [-reach, reach], meters.
    """

    name: str = "odometry"
    along: float = 0.0
    heading: float = 0.0
    turning: float = 0.0
    reach: float = POSITION_RANGE
    noise: tuple[Noise, ...] = ()
    stretch: float = 0.0
    veer: float = 0.0
    overturn: float = 0.0

    def __post_init__(self) -> None:
        positive(self, "along", "heading", "turning", zero=True)
        positive(self, "reach", most=MAX_METERS)
        finite(self, "stretch", "veer", "overturn")
        super().__post_init__()

    @property
    def space(self) -> spaces.Space[Any]:
        """Position within the reach, cosine and sine in [-1, 1]."""
        high = np.array([self.reach, self.reach, 1.0, 1.0], np.float32)
        return spaces.Box(-high, high)

    def scaled(self, factor: float) -> OdometrySensor:
        """Return the sensor with its drift multiplied by a factor."""
        drift = {name: getattr(self, name) * factor for name in DRIFT}
        return replace(self, **drift)

    @property
    def reckoned(self) -> Pose:
        """The pose of the latest reading: x and y in meters, yaw in radians, without `reach` and `noise`."""
        return self._pose

    def reset(self, state: State, rng: np.random.Generator) -> None:  # noqa: ARG002
        """Begin at the origin."""
        self._last: Pose = state.pose
        self._pose: Pose = (0.0, 0.0, 0.0)

    def reading(self, state: State, rng: np.random.Generator) -> Reading:
        """Return the pose, after the errors of the motion since the last reading."""
        if state.pose != self._last:
            self._advance(state, rng)
        state.views[RECKONED] = self._pose
        return super().reading(state, rng)

    def measured(self, state: State) -> Reading:  # noqa: ARG002
        """Return the pose."""
        return planar(self._pose, self.reach)

    def _advance(self, state: State, rng: np.random.Generator) -> None:
        """Add an increment, with its error, to the reckoned pose."""
        pose = state.pose
        before, self._last = self._last, pose
        dx, dy, turned = pose[0] - before[0], pose[1] - before[1], wrap_angle(pose[2] - before[2])
        ahead = math.cos(before[2]) * dx + math.sin(before[2]) * dy
        left = math.cos(before[2]) * dy - math.sin(before[2]) * dx
        way, angle = math.hypot(dx, dy), abs(turned)
        errors = rng.standard_normal(3) * state.slip
        turned += self.overturn * turned + math.radians(self.veer) * ahead
        ahead += self.stretch * ahead
        ahead += self.along * math.sqrt(way) * float(errors[0])
        turned += math.radians(self.heading) * math.sqrt(way) * float(errors[1])
        turned += math.radians(self.turning) * math.sqrt(angle / (2.0 * math.pi)) * float(errors[2])
        x, y, yaw = self._pose
        self._pose = (
            x + math.cos(yaw) * ahead - math.sin(yaw) * left,
            y + math.sin(yaw) * ahead + math.cos(yaw) * left,
            wrap_angle(yaw + turned),
        )


@registered("sensor", "announced_goal")
class AnnouncedGoalSensor(GoalSensor):
    """The announced goal in polar form, from the pose by odometry: (3,) float32, as `GoalSensor`.

    It needs an odometry sensor before it, whose errors it has. The announced goal is that of the old map.
    """

    def measured(self, state: State) -> Reading:
        """Return distance, cosine and sine.

        Raises:
            OptionError: no odometry sensor has been read before.
        """
        if RECKONED not in state.views:
            raise OptionError("sensor 'announced_goal' needs an odometry sensor before it in `sensors`")
        return polar(announced_goal(state), state.views[RECKONED], self.reach)


@registered("sensor", "odometry_velocity", frozen=False)
class OdometryVelocitySensor(NoisySensor):
    """The mean velocity since the last reading, by odometry: as `VelocitySensor`, with the errors of the odometry.

    It needs an odometry sensor before it. Readings that are added up give its pose.
    """

    name: str = "velocity"
    noise: tuple[Noise, ...] = ()

    @property
    def space(self) -> spaces.Space[Any]:
        """The limits of the differential robot."""
        return VelocitySensor().space

    def reset(self, state: State, rng: np.random.Generator) -> None:  # noqa: ARG002
        """Begin at the origin."""
        self._last: Pose = (0.0, 0.0, 0.0)
        self._time = state.time

    def measured(self, state: State) -> Reading:
        """Return forward velocity and turn rate.

        Raises:
            OptionError: no odometry sensor has been read before.
        """
        if RECKONED not in state.views:
            raise OptionError("sensor 'odometry_velocity' needs an odometry sensor before it in `sensors`")
        (x0, y0, yaw0), (x, y, yaw) = self._last, state.views[RECKONED]
        seconds = state.time - self._time
        self._last, self._time = (x, y, yaw), state.time
        ahead = rotate(x - x0, y - y0, -(yaw0 + wrap_angle(yaw - yaw0) / 2.0))[0]
        twist = (ahead / seconds, wrap_angle(yaw - yaw0) / seconds) if seconds > 0.0 else (0.0, 0.0)
        return np.clip(twist, VelocitySensor.low, VelocitySensor.high).astype(np.float32)


def announced_goal(state: State) -> Pose:
    """Return the announced goal pose of the drive in progress, in the frame of the episode's start: meters and radians.

    The goals of later drives are in that frame, too, so that the errors of the odometry add up over all drives.
    """
    task = state.task
    first = task.pair if task.announced is None else task.announced
    (x, y, yaw), goal = first.start, state.pair.goal if state.leg else first.goal
    return *rotate(goal[0] - x, goal[1] - y, -yaw), wrap_angle(goal[2] - yaw)
