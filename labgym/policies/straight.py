"""Drive directly at the goal and ignore obstacles: the baseline that knows only the goal."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from labgym.envs.robot import ROBOT, RobotSpec, turn_towards
from labgym.navigation import Pose
from labgym.policies.arrival import ArrivingPolicy
from labgym.policies.options import NonNegative, PolicyOptions
from labgym.policies.policy import Observation
from labgym.policies.tracking import velocities_to_action


class StraightOptions(PolicyOptions):
    """Options of `StraightPolicy`.

    Attributes:
        turn_in_place: bearing of the goal beyond which the robot turns without driving, radians.
    """

    turn_in_place: NonNegative = 0.5


class StraightPolicy(ArrivingPolicy):
    """Turns towards the goal and drives at it.

    Args:
        options: a `StraightOptions` or a mapping of those that differ from the defaults.
    """

    name: ClassVar[str] = "straight"
    options_type: ClassVar[type[PolicyOptions]] = StraightOptions

    def __init__(self, options: StraightOptions | Mapping[str, Any] | None = None) -> None:
        self._options = StraightOptions.of(options)
        self._robot: RobotSpec = ROBOT

    def drive(self, observation: Observation, pose: Pose) -> NDArray[np.floating[Any]]:  # noqa: ARG002
        """Steer by the bearing of the goal."""
        _, cosine, sine = (float(value) for value in observation["goal"])
        bearing = math.atan2(sine, cosine)
        if abs(bearing) > self._options.turn_in_place:
            return turn_towards(bearing, self._robot)
        return velocities_to_action(self._robot.v_max * cosine, 2.0 * bearing, self._robot)
