"""Maneuvers of the camera planners: face the goal, notice being stuck, turn in place, keep to a path for a while."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from labgym.envs.robot import RobotSpec, turn_towards
from labgym.envs.sensors import IMAGE_SHAPE
from labgym.geometry import Array
from labgym.policies.blockage import BlockageDetector
from labgym.policies.learned.weights import CONFIG, WEIGHTS
from labgym.policies.options import NonNegative, PolicyOptions
from labgym.policies.policy import Observation, Policy
from labgym.policies.tracking import PathTracker

ABEAM_RAD = 1.0
"""Bearing beyond which a goal decides the side of a turn, radians."""


Steps = Annotated[int, Field(ge=1)]


class ManeuverOptions(PolicyOptions):
    """Options of the maneuvers around the paths of a camera planner.

    Attributes:
        facing: an episode begins with a turn in place until the goal's bearing is within this angle, radians: the
            camera is 68 degrees wide and the goal may be behind.
        commit: distance for which a path is followed before another is taken, meters: each view gives another path,
            between which the robot would oscillate.
        patience: control steps after which another is taken in any case.
        stuck_steps, stuck_distance: the robot turns in place when it has moved less than `stuck_distance` meters over
            the last `stuck_steps` control steps.
    """

    facing: NonNegative = 0.5
    commit: NonNegative
    patience: Steps
    stuck_steps: Steps = 30
    stuck_distance: NonNegative = 0.10


class CameraPlanner(Policy):
    """A trained planner with a camera: the folder of its weights, and the state of its maneuvers."""

    _folder: Path

    def files(self) -> tuple[Path, ...]:
        """Return the weights and their configuration."""
        return self._folder / CONFIG, self._folder / WEIGHTS

    def _begin_maneuvers(self, robot: RobotSpec, options: ManeuverOptions) -> None:
        """Begin an episode without a path."""
        self._robot = robot
        self._tracker: PathTracker | None = None
        self._commitment = PathCommitment(options.commit, options.patience)
        self._step = 0
        self._facing = FaceGoal(options.facing)
        self._turn: TurnInPlace | None = None
        self._stuck = StuckDetector(options.stuck_steps, options.stuck_distance)
        self._blockage = BlockageDetector(robot)


def goal_point(observation: Observation) -> tuple[float, float]:
    """Return the goal (x, y) of an observation in the robot frame, meters."""
    distance, cosine, sine = (float(value) for value in observation["goal"])
    return distance * cosine, distance * sine


def goal_bearing(observation: Observation) -> float:
    """Return the bearing of an observation's goal, radians."""
    _, cosine, sine = (float(value) for value in observation["goal"])
    return math.atan2(sine, cosine)


def free_side(depth: NDArray[np.floating[Any]], bearing: float) -> float:
    """Return +1 to turn left or -1 to turn right: to the goal's side if it is abeam, else to the freer side.

    Args:
        depth: (72, 128) planar meters.
        bearing: bearing of the goal, radians.
    """
    if abs(bearing) > ABEAM_RAD:
        return math.copysign(1.0, bearing)
    half = IMAGE_SHAPE[1] // 2
    return 1.0 if depth[:, :half].mean() >= depth[:, half:].mean() else -1.0


class FaceGoal:
    """The turn in place towards the goal that begins an episode: the camera is narrow and the goal may be behind.

    Args:
        limit: bearing of the goal at which the turn ends, radians.
    """

    def __init__(self, limit: float) -> None:
        self._limit, self._done = limit, False

    def turning(self, bearing: float) -> bool:
        """Return whether the robot still has to turn towards a goal at this bearing, radians."""
        self._done = self._done or abs(bearing) <= self._limit
        return not self._done


class StuckDetector:
    """Notices that the robot has moved less than `distance` meters over the last `steps` control steps."""

    def __init__(self, steps: int, distance: float) -> None:
        self._steps, self._distance = steps, distance
        self._places: list[Array] = []

    def add(self, place: Array) -> None:
        """Record the place (2,) of this control step, meters."""
        self._places.append(place)

    def clear(self) -> None:
        """Forget all places."""
        self._places.clear()

    @property
    def stuck(self) -> bool:
        """Whether the robot is stuck; never before `steps` places are recorded."""
        if len(self._places) < self._steps:
            return False
        return float(np.linalg.norm(self._places[-1] - self._places[-self._steps])) < self._distance


class PathCommitment:
    """Keeps the robot to a path until it has driven `distance` meters or `patience` control steps have passed."""

    def __init__(self, distance: float, patience: int) -> None:
        self._distance, self._patience = distance, patience
        self._step, self._place = 0, np.zeros(2)
        self._ended = False

    def begin(self, step: int, place: Array, distance: float | None = None) -> None:
        """Commit to a new path at a control step and a place (2,); `distance` replaces the usual one."""
        self._step, self._place, self._ended = step, place, False
        self._distance = self._distance if distance is None else distance

    def end(self) -> None:
        """Allow another path from now on."""
        self._ended = True

    def over(self, step: int, place: Array) -> bool:
        """Return whether another path may be taken."""
        driven = float(np.linalg.norm(place - self._place))
        return self._ended or driven >= self._distance or step - self._step >= self._patience


class TurnInPlace:
    """A turn in place to one side.

    Args:
        side: +1 to turn left, -1 to turn right.
        yaw: heading at which the turn begins, radians.
        angle: angle after which it is over, radians.
        measure: "net" is the angle between the first and the present heading; "swept" sums all changes of heading.
        patience: control steps after which it is over in any case, because something may block it; None for no limit.
    """

    def __init__(
        self,
        side: float,
        yaw: float,
        angle: float,
        measure: Literal["net", "swept"] = "net",
        patience: int | None = None,
    ) -> None:
        self._side, self._angle, self._measure, self._patience = side, angle, measure, patience
        self.begin(yaw)

    def begin(self, yaw: float) -> None:
        """Begin again at this heading, to the same side."""
        self._first = self._last = yaw
        self._swept, self._steps = 0.0, 0

    def over(self, yaw: float) -> bool:
        """Record the heading of this control step and return whether the turn is over."""
        self._swept += abs(math.remainder(yaw - self._last, math.tau))
        self._last = yaw
        self._steps += 1
        net = abs(math.remainder(yaw - self._first, math.tau))
        turned = net if self._measure == "net" else self._swept
        return turned >= self._angle or (self._patience is not None and self._steps >= self._patience)

    def action(self, robot: RobotSpec) -> Array:
        """Return the action (2,) that continues the turn."""
        return turn_towards(self._side, robot)
