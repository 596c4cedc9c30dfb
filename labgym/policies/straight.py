"""Straight at the goal, blind to what is in between: the lower bound of what knowing the goal is worth."""

from __future__ import annotations

import math
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from labgym.envs.robot import ROBOT, RobotSpec
from labgym.policies.policy import EpisodeStart, Observation, Policy
from labgym.policies.tracking import turn_towards, velocities_to_action


class StraightPolicy(Policy):
    """Turns towards the goal and drives at it.

    Args:
        turn_in_place: bearing beyond which it turns without driving, radians.
    """

    name: ClassVar[str] = "straight"

    def __init__(self, turn_in_place: float = 0.5) -> None:
        self._turn_in_place = turn_in_place
        self._robot: RobotSpec = ROBOT

    def reset(self, episode: EpisodeStart) -> None:
        """Note the robot's limits."""
        self._robot = episode.robot

    def act(self, observation: Observation) -> NDArray[np.floating[Any]]:
        """Steer by the bearing of the goal."""
        _, cosine, sine = (float(value) for value in observation["goal"])
        bearing = math.atan2(sine, cosine)
        if abs(bearing) > self._turn_in_place:
            return turn_towards(bearing, self._robot)
        return velocities_to_action(self._robot.v_max * cosine, 2.0 * bearing, self._robot)
