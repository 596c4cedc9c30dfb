"""Sensors of the robot's own state and of its goal."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from gymnasium import spaces

from labgym.envs.parts.kinds import noises, positive
from labgym.envs.parts.noise import disturbed
from labgym.envs.parts.protocols import Noise, Reading, Sensor
from labgym.envs.robot import ROBOT
from labgym.envs.state import State

GOAL_RANGE = 50.0
"""Largest distance in the goal reading, meters."""


@dataclass(frozen=True)
class GoalSensor(Sensor):
    """The goal in polar form, as the robot sees it: (3,) float32.

    Distance in meters, clipped to `reach`; cosine and sine of the bearing relative to the heading, counter-clockwise.
    """

    name: str = "goal"
    reach: float = GOAL_RANGE
    noise: tuple[Noise, ...] = ()
    kind: str = field(default="goal", init=False)

    def __post_init__(self) -> None:
        positive(self, "reach")
        noises(self)

    @property
    def space(self) -> spaces.Space[Any]:
        """Distance in [0, reach], cosine and sine in [-1, 1]."""
        return spaces.Box(np.array([0, -1, -1], np.float32), np.array([self.reach, 1, 1], np.float32))

    def reading(self, state: State, rng: np.random.Generator) -> Reading:
        """Return distance, cosine and sine."""
        x, y, yaw = state.pose
        dx, dy = state.pair.goal[0] - x, state.pair.goal[1] - y
        bearing = math.atan2(dy, dx) - yaw
        polar = np.array([min(math.hypot(dx, dy), self.reach), math.cos(bearing), math.sin(bearing)], np.float32)
        return disturbed(polar, self, state, rng) if self.noise else polar


@dataclass(frozen=True)
class VelocitySensor(Sensor):
    """The velocity of the robot: (2,) float32, forward in m/s and turn rate in rad/s, counter-clockwise.

    Attributes:
        low, high: limits of both components; readings are clipped to them.
    """

    name: str = "velocity"
    low: tuple[float, float] = (ROBOT.v_min, -ROBOT.w_max)
    high: tuple[float, float] = (ROBOT.v_max, ROBOT.w_max)
    noise: tuple[Noise, ...] = ()
    kind: str = field(default="velocity", init=False)

    def __post_init__(self) -> None:
        noises(self)

    @property
    def space(self) -> spaces.Space[Any]:
        """The limits."""
        return spaces.Box(np.array(self.low, np.float32), np.array(self.high, np.float32))

    def reading(self, state: State, rng: np.random.Generator) -> Reading:
        """Return forward velocity and turn rate."""
        (v, w), low, high = state.velocity, self.low, self.high
        twist = np.array([min(max(v, low[0]), high[0]), min(max(w, low[1]), high[1])], np.float32)
        return disturbed(twist, self, state, rng) if self.noise else twist
