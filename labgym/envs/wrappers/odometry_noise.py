"""Dead reckoning in place of the true pose."""

from __future__ import annotations

import math
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium import spaces

from labgym.envs.parts.odometry import OdometrySensor
from labgym.envs.state import Pose
from labgym.envs.wrappers.checks import observed, point_nav

ENTRY = "odometry"


class OdometryNoise(gym.Wrapper[Any, Any, Any, Any], gym.utils.RecordConstructorArgs):
    """Let the agent reckon its pose from noisy odometry, as in PointNav without GPS and compass.

    Adds the entry "odometry", (4,) float32: x and y in meters, cosine and sine of the yaw, in the frame of the start.
    The entry "goal", if there is one, becomes distance and bearing of the goal from the reckoned pose, so that an agent
    which trusts it misses the goal by the drift. Reward, endings and info stay true. The errors are those of
    `labgym.envs.parts.odometry.OdometrySensor`, which adds the entry alone.

    Args:
        env: a point navigation environment.
        along: standard deviation along the way after one meter, m. heading: of the yaw after one meter, degrees.
        turning: of the yaw after one turn of 360 degrees, degrees. By default RoboTHOR's errors, 5 mm and 0.5 degrees
            per 0.25 m.

    Raises:
        OptionError: an argument is negative, or the observation has an entry "odometry".
    """

    def __init__(self, env: gym.Env[Any, Any], along: float = 0.01, heading: float = 1.0, turning: float = 0.0) -> None:
        gym.utils.RecordConstructorArgs.__init__(self, along=along, heading=heading, turning=turning)
        gym.Wrapper.__init__(self, env)
        self._sensor = OdometrySensor(along=along, heading=heading, turning=turning)
        point_nav(env, "OdometryNoise")
        space = observed(env, "OdometryNoise", None, ENTRY)
        self.observation_space = spaces.Dict({**space.spaces, ENTRY: self._sensor.space})
        self._reach = float(space["goal"].high[0]) if "goal" in space.spaces else 0.0  # type: ignore[attr-defined]
        self._rng: np.random.Generator | None = None
        self._start: Pose = (0.0, 0.0, 0.0)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Begin an episode; with a seed, the errors depend on it alone."""
        observation, info = self.env.reset(seed=seed, options=options)
        if seed is not None or self._rng is None:
            entropy = None if seed is None else [seed, *ENTRY.encode()]
            self._rng = np.random.default_rng(np.random.SeedSequence(entropy))
        state = point_nav(self.env, "OdometryNoise").state
        self._start = state.pose
        self._sensor.reset(state, self._rng)
        return self._disturbed(observation), info

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        """Carry out an action, and reckon the pose after it."""
        observation, reward, terminated, truncated, info = self.env.step(action)
        return self._disturbed(observation), reward, terminated, truncated, info

    def _disturbed(self, observation: Any) -> Any:
        if self._rng is None:
            raise gym.error.ResetNeeded("call reset() before step()")
        state = point_nav(self.env, "OdometryNoise").state
        entries = {**observation, ENTRY: self._sensor.reading(state, self._rng)}
        if self._reach:
            entries["goal"] = self._goal(state.goal)
        return entries

    def _goal(self, goal: Pose) -> Any:
        """Return distance, cosine and sine of the bearing of a goal, as seen from the reckoned pose."""
        (start_x, start_y, start_yaw), (x, y, yaw) = self._start, self._sensor.reckoned
        east, north = goal[0] - start_x, goal[1] - start_y
        ahead = math.cos(start_yaw) * east + math.sin(start_yaw) * north - x
        left = math.cos(start_yaw) * north - math.sin(start_yaw) * east - y
        distance, bearing = math.hypot(ahead, left), math.atan2(left, ahead) - yaw
        return np.array([min(distance, self._reach), math.cos(bearing), math.sin(bearing)], np.float32)
