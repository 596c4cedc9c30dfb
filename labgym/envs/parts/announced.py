"""The goal as an agent knows it: announced once, at the start, and then followed by odometry."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from gymnasium import spaces

from labgym.envs.parts.kinds import noises, positive
from labgym.envs.parts.noise import disturbed
from labgym.envs.parts.odometry import RECKONED
from labgym.envs.parts.protocols import Noise, Reading, Sensor
from labgym.envs.parts.vectors import GOAL_RANGE
from labgym.envs.state import Pose, State
from labgym.errors import OptionError
from labgym.geometry import rotate, wrap_angle


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
        positive(self, "reach")
        noises(self)

    @property
    def space(self) -> spaces.Space[Any]:
        """Distance in [0, reach], cosine and sine in [-1, 1]."""
        return spaces.Box(np.array([0, -1, -1], np.float32), np.array([self.reach, 1, 1], np.float32))

    def reading(self, state: State, rng: np.random.Generator) -> Reading:
        """Return distance, cosine and sine.

        Raises:
            OptionError: no odometry sensor has been read before.
        """
        if RECKONED not in state.views:
            raise OptionError("sensor 'announced_goal' needs an odometry sensor before it in `sensors`")
        (x, y, _), (rx, ry, yaw) = announced_goal(state), state.views[RECKONED]
        away, bearing = math.hypot(x - rx, y - ry), math.atan2(y - ry, x - rx) - yaw
        polar = np.array([min(away, self.reach), math.cos(bearing), math.sin(bearing)], np.float32)
        return disturbed(polar, self, state, rng) if self.noise else polar


def announced_goal(state: State) -> Pose:
    """Return the announced goal pose of a drive in the frame of its start: meters and radians."""
    pair = state.pair if state.task.announced is None or state.leg else state.task.announced
    (x, y, yaw), goal = pair.start, pair.goal
    return *rotate(goal[0] - x, goal[1] - y, -yaw), wrap_angle(goal[2] - yaw)
