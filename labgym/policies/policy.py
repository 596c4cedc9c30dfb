"""The Policy interface: `reset` at the start of an episode, `act` at each control step."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from labgym.envs.labnav.properties import TRANSITION, TaskProperties
from labgym.envs.robot import ROBOT, RobotSpec
from labgym.errors import LabgymError
from labgym.policies.options import PolicyOptions

if TYPE_CHECKING:
    from labgym.envs.conditions.beaker import Beaker
    from labgym.layouts import Layout
    from labgym.navigation import GoalPair, Pose

RobotPath = Callable[[float], tuple[float, float, float, float, float]]
"""Returns x, y, vx, vy (room frame, m and m/s) and the turn rate (rad/s) of the robot at a time of the episode."""

Observation = Mapping[str, NDArray[Any]]

Sensors = Literal["lidar", "depth", "rgbd"]

GoalKind = Literal["point", "image", "none"]
"""A goal is a point, the picture that the camera would see there, or absent: the robot explores."""


class PeopleForecast(Protocol):
    """People in the future, in steps of 0.1 s."""

    places: NDArray[np.float64]
    """Their centers, (n, 2) meters in the room frame."""
    following: NDArray[np.float64]
    """The same 0.1 s later: certain, whatever the robot does."""

    def step(self, x: float, y: float, vx: float, vy: float, turn: float) -> None:
        """Advance by 0.1 s.

        Args:
            x, y, vx, vy: of the robot after that time, in the room frame, m and m/s. turn: its turn rate, rad/s.
        """
        ...


class Foreknowledge(Protocol):
    """The world of an episode in progress. Poses are in the room frame, meters and radians; times in seconds.

    It can be asked at any time of the episode and answers for the present drive: in a chain of goals, for the present
    leg.
    """

    @property
    def time(self) -> float:
        """Time of the episode."""
        ...

    @property
    def pose(self) -> Pose:
        """The true pose of the robot (x, y, yaw)."""
        ...

    @property
    def velocity(self) -> tuple[float, float]:
        """The true forward velocity, m/s, and turn rate, rad/s."""
        ...

    @property
    def goal(self) -> Pose:
        """The true goal pose: at a station that moved, the docking pose of its true place."""
        ...

    @property
    def radius(self) -> float:
        """Radius of the disc around the goal in which the robot has to rest, meters."""
        ...

    @property
    def wheels(self) -> tuple[float, float, float]:
        """The errors of the wheels: factors on forward velocity and turn rate, and the veer, radians per meter."""
        ...

    def solids(self) -> Layout:
        """Return the true floor: with all that has been moved, with panes, and with things that have yet to come."""
        ...

    @property
    def yields(self) -> NDArray[np.bool_]:
        """Which of the people avoid the robot while it moves, (n,); the others do not see it until it rests."""
        ...

    def forecast(self) -> PeopleForecast | None:
        """Return the people from now on, to be advanced with any motion of the robot; None without people."""
        ...

    def people(self, times: Sequence[float], path: RobotPath | None = None) -> NDArray[np.float64]:
        """Return where the centers of people will be, (t, n, 2) meters: exact if the robot moves as assumed.

        Args:
            times: of the episode, ascending, not before now.
            path: the motion of the robot; None for one that stands where it is from now on.
        """
        ...


@dataclass(frozen=True)
class GroundTruth:
    """The map and the true poses, which only privileged policies receive.

    Attributes:
        layout: the room and everything in it; in the tasks of LabNav the old map, which some things have left.
        pair: the drive; its poses are in the room frame.
        start: the robot's pose (x, y, yaw) in the room frame at the start of the episode; at the start of a later drive
            of it (`Policy.next_goal`) the pose by odometry, with its errors.
    """

    layout: Layout
    pair: GoalPair
    start: Pose


@dataclass(frozen=True, eq=False)
class EpisodeStart:
    """The information that a policy receives at the start of an episode.

    Attributes:
        goal: (x, y) of the goal in the start frame, meters: origin at the robot, x ahead, y to the left; (0, 0) if the
            goal is not a point.
        rng: the only source of randomness that a policy may use; equal for equal episode and seed.
        robot: dimensions and limits of the robot.
        truth: the map; None unless the policy is privileged.
        task: properties of the task, by default those of the paper's transition.
        heading: heading that the robot must have at the goal, radians in the start frame; None if any will do.
        beaker: the liquid that the robot carries; None without one.
        world: the world as it is and will be; None unless the policy foresees it, in the privileged track of LabNav.
        goal_kind: kind of the goal. Instead of `goal`, observations have `goal_image`, uint8 (72, 128, 3), for "image",
            and nothing for "none". Only `labgym serve` has other goals than points.
    """

    goal: tuple[float, float]
    rng: np.random.Generator
    robot: RobotSpec = ROBOT
    truth: GroundTruth | None = None
    task: TaskProperties = TRANSITION
    heading: float | None = None
    beaker: Beaker | None = None
    world: Foreknowledge | None = None
    goal_kind: GoalKind = "point"


class Policy(ABC):
    """Drives the robot of `LabPointNav-v0`.

    The observation is the environment's (`goal`, `velocity` and the policy's sensors) and, in addition, `odometry`:
    float64 (3,), the robot's pose (x, y, yaw) in the start frame of the episode, without noise, as from wheel encoders
    and a gyroscope. A policy that is not privileged receives nothing else. The evaluator runs each episode in a fresh
    process, which ends with the episode: nothing that a policy keeps in memory reaches the next episode.

    Attributes:
        name: shown in reports; the class's name by default.
        observation: the sensors: "lidar", "depth" or "rgbd".
        privileged: whether the policy receives the map; reports show it.
        foresees: whether the policy receives the world as it is and will be (`EpisodeStart.world`). Only LabNav hands
            it out, to built-in policies, which then run in the process that simulates.
        exclusive: whether only one instance may drive at a time, because all would share one state: a server's.
        goal_kinds: the kinds of goal that the policy can drive to; `labgym serve` refuses requests with others.
        latency: declared time from an observation to its action, seconds; LabNav delays actions by it.
        options_type: type of the constructor's argument `options`; None for a policy without options.
    """

    name: ClassVar[str]
    observation: ClassVar[Sensors] = "lidar"
    privileged: ClassVar[bool] = False
    foresees: ClassVar[bool] = False
    exclusive: ClassVar[bool] = False
    goal_kinds: ClassVar[tuple[GoalKind, ...]] = ("point",)
    latency: ClassVar[float] = 0.0
    options_type: ClassVar[type[PolicyOptions] | None] = None

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        if "name" not in cls.__dict__:
            cls.name = cls.__name__

    @abstractmethod
    def reset(self, episode: EpisodeStart) -> None:
        """Begin an episode and forget the previous one."""

    @abstractmethod
    def act(self, observation: Observation) -> NDArray[np.floating[Any]]:
        """Return the action for the next control step, shape (2,), in [-1, 1]: forward and turn."""

    def stop(self, observation: Observation) -> bool:  # noqa: ARG002
        """Whether the robot has arrived: LabNav asks before each action, and True ends the drive.

        A policy that does not define it never stops; the evaluator then brakes the robot near its goal by the
        odometry, and marks the results.
        """
        return False

    @property
    def stops(self) -> bool:
        """Whether the policy decides itself when it has arrived: whether its class defines `stop`."""
        return type(self).stop is not Policy.stop

    def next_goal(self, episode: EpisodeStart) -> None:
        """Begin the next drive of a chain of goals, from where the robot stands.

        The frame of `episode` and of the odometry has its origin at this place by odometry, so that the goal has the
        errors of the odometry of all drives before. By default the policy forgets the drive before, as at the start of
        an episode; a policy that keeps a map or an estimate of its pose overrides it.
        """
        self.reset(episode)

    def planned_path(self) -> NDArray[np.float64] | None:
        """Return the path that the last action follows, (n, 2) meters in the start frame.

        None if the policy has no path. `labgym serve` answers with it.
        """
        return None

    def files(self) -> tuple[Path, ...]:
        """Return the files that the actions depend on, such as weights; results record their hash.

        Files that Python code opens while the policy loads are recorded without it. Those that a compiled library or a
        child process opens, and those that are opened while driving, must be returned here.
        """
        return ()

    def parameters(self) -> Mapping[str, Any] | None:
        """Return the values, by name, that the actions depend on in addition to the class and its files.

        Results in a folder belong to these parameters. None stands for all attributes of the object; define it for an
        object with attributes that do not matter or have no digest, such as connections.
        """
        return None

    def close(self) -> None:
        """Release connections and processes. Called once, after the last episode in this process."""
        return


class Driver(Protocol):
    """The driver of an episode: a `Policy`, or the evaluator's view of one in a separate process."""

    @property
    def observation(self) -> Sensors:
        """The sensors that the policy receives."""
        ...

    @property
    def privileged(self) -> bool:
        """Whether the policy receives the map."""
        ...

    def reset(self, episode: EpisodeStart) -> None:
        """Begin an episode."""
        ...

    def act(self, observation: Observation) -> NDArray[np.floating[Any]]:
        """Return the action for the next control step, shape (2,), in [-1, 1]: forward and turn."""
        ...


class PolicyError(LabgymError):
    """A policy raised an exception, returned an invalid action, died, or exceeded a limit."""
