"""The goal and the velocity as an agent knows them by its odometry."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from gymnasium import spaces

from labgym.envs.checks import MAX_METERS, positive
from labgym.envs.parts.noise import disturbed, noises
from labgym.envs.parts.odometry import RECKONED
from labgym.envs.parts.protocols import Noise, Reading, Sensor
from labgym.envs.parts.registry import registered
from labgym.envs.parts.vectors import GOAL_RANGE, VelocitySensor, polar, polar_space
from labgym.envs.state import Pose, State
from labgym.errors import OptionError
from labgym.geometry import rotate, wrap_angle


@registered("sensor")
@dataclass(frozen=True)
class AnnouncedGoalSensor(Sensor):
    """The announced goal in polar form, from the pose by odometry: (3,) float32, as `GoalSensor`.

    It needs an odometry sensor before it, whose errors it has. The announced goal is that of the old map.
    """

    name: str = "goal"
    reach: float = GOAL_RANGE
    noise: tuple[Noise, ...] = ()
    kind: str = field(default="announced_goal", init=False)

    def __post_init__(self) -> None:
        positive(self, "reach", most=MAX_METERS)
        noises(self)

    @property
    def space(self) -> spaces.Space[Any]:
        """Distance in [0, reach], cosine and sine in [-1, 1]."""
        return polar_space(self.reach)

    def reading(self, state: State, rng: np.random.Generator) -> Reading:
        """Return distance, cosine and sine.

        Raises:
            OptionError: no odometry sensor has been read before.
        """
        if RECKONED not in state.views:
            raise OptionError("sensor 'announced_goal' needs an odometry sensor before it in `sensors`")
        goal = polar(announced_goal(state), state.views[RECKONED], self.reach)
        return disturbed(goal, self, state, rng) if self.noise else goal


@registered("sensor")
@dataclass
class OdometryVelocitySensor(Sensor):
    """The mean velocity since the last reading, by odometry: as `VelocitySensor`, with the errors of the odometry.

    It needs an odometry sensor before it. Readings that are added up give its pose.
    """

    name: str = "velocity"
    noise: tuple[Noise, ...] = ()
    kind: str = field(default="odometry_velocity", init=False)

    def __post_init__(self) -> None:
        noises(self)

    @property
    def space(self) -> spaces.Space[Any]:
        """The limits of the differential robot."""
        return VelocitySensor().space

    def reset(self, state: State, rng: np.random.Generator) -> None:  # noqa: ARG002
        """Begin at the origin."""
        self._last: Pose = (0.0, 0.0, 0.0)
        self._time = state.time

    def reading(self, state: State, rng: np.random.Generator) -> Reading:
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
        reading = np.clip(twist, VelocitySensor.low, VelocitySensor.high).astype(np.float32)
        return disturbed(reading, self, state, rng) if self.noise else reading


def announced_goal(state: State) -> Pose:
    """Return the announced goal pose of the drive in progress, in the frame of the episode's start: meters and radians.

    The goals of later drives are in that frame, too, so that the errors of the odometry add up over all drives.
    """
    task = state.task
    first = task.pair if task.announced is None else task.announced
    (x, y, yaw), goal = first.start, state.pair.goal if state.leg else first.goal
    return *rotate(goal[0] - x, goal[1] - y, -yaw), wrap_angle(goal[2] - yaw)
