"""What a policy is: it is told where an episode begins and, at each control step, says how to drive."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from labgym.envs.robot import ROBOT, RobotSpec
from labgym.layouts import Layout
from labgym.navigation import GoalPair, Pose

Observation = Mapping[str, NDArray[Any]]
Sensors = Literal["lidar", "depth", "rgbd"]


@dataclass(frozen=True)
class GroundTruth:
    """What only a privileged policy is given.

    Attributes:
        layout: the room and everything in it.
        pair: the drive; its poses are in the room frame.
        start: the robot's pose in the room frame (x, y, yaw) when the episode begins.
    """

    layout: Layout
    pair: GoalPair
    start: Pose


@dataclass(frozen=True, eq=False)
class EpisodeStart:
    """What a policy is told when an episode begins.

    Attributes:
        goal: (x, y) of the goal in the start frame, metres: origin at the robot, x ahead, y to the left.
        rng: the only source of randomness that a policy may use; the same for the same episode and seed.
        robot: dimensions and limits of the robot.
        truth: the map; None unless the policy is privileged.
    """

    goal: tuple[float, float]
    rng: np.random.Generator
    robot: RobotSpec = ROBOT
    truth: GroundTruth | None = None


class Policy(ABC):
    """Drives the robot of `LabPointNav-v0`.

    The observation is the environment's (`goal`, `velocity` and the sensors that the policy asks for) and, beside it,
    `odometry`: float64 (3,), the robot's pose (x, y, yaw) in the start frame of the episode, without noise, as wheel
    encoders and a gyroscope would give. Nothing else is known to a policy that is not privileged.

    Attributes:
        name: what reports call it; the class's name unless it says otherwise.
        observation: the sensors it needs: "lidar", "depth" or "rgbd".
        privileged: whether it is given the map; reports say so.
        exclusive: whether only one at a time may drive, because all would share what it remembers: a server.
    """

    name: ClassVar[str]
    observation: ClassVar[Sensors] = "lidar"
    privileged: ClassVar[bool] = False
    exclusive: ClassVar[bool] = False

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        if "name" not in cls.__dict__:
            cls.name = cls.__name__

    @abstractmethod
    def reset(self, episode: EpisodeStart) -> None:
        """Begin an episode and forget the one before."""

    @abstractmethod
    def act(self, observation: Observation) -> NDArray[np.floating[Any]]:
        """Return the action for the next control step, shape (2,), in [-1, 1]: forward and turn."""

    def planned_path(self) -> NDArray[np.float64] | None:
        """Return the path that the last action follows, (n, 2) metres in the start frame.

        None where the policy has none, or only acts. `labgym serve` answers with it.
        """
        return None

    def files(self) -> tuple[Path, ...]:
        """Return the files that its actions depend on beside the code, such as weights; results name their hash."""
        return ()

    def close(self) -> None:
        """Free what the policy holds: connections, processes. Called once, after the last episode."""
        return
