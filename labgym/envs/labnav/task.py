"""A task of LabNav: its levels, rules, score and text; each module of `labgym.envs.labnav.tasks` registers one."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, get_args

from labgym.counts import is_whole
from labgym.envs.parts.actions import SlippingActions
from labgym.envs.parts.braking import BrakingActions
from labgym.envs.parts.endings import (
    REST_DISTANCE,
    LimitEnding,
    SpillEnding,
    StopEnding,
    StuckEnding,
    TouchedEnding,
)
from labgym.envs.parts.noise import Gaussian, RedwoodDepth
from labgym.envs.parts.odometry import AnnouncedGoalSensor, OdometrySensor, OdometryVelocitySensor
from labgym.envs.parts.protocols import Ending, Randomization, Sensor
from labgym.envs.parts.randomizations import SensorPoseRandomization
from labgym.envs.parts.rays import ColorSensor, DepthSensor, LidarSensor
from labgym.envs.parts.rewards import RewardWeights
from labgym.envs.parts.vectors import VelocitySensor
from labgym.errors import LabgymError, UnknownNameError, check_name

Stop = Literal["brake", "action"]
"""How an agent ends a drive: the brake parks the robot near its goal, or the action has STOP as third component."""
STOPS: tuple[Stop, ...] = get_args(Stop)
STOP_THRESHOLD, STOP_HOLD = 0.5, 5
"""STOP is the third component above this in that many control steps in a row: an untrained Gaussian policy says so once
in some hundred steps."""
FULL_SPEED = 1.0
"""Speed of the ideal robot, m/s."""
SLOWEST = 8.0
"""Times OT beyond which being slower costs nothing more."""
DOCK_POSITION, DOCK_HEADING = 0.10, 0.10
"""Errors at which docking scores 0: meters and radians."""
PRECISE = (0.05, 0.05)
"""Errors below which a robot has docked by Nav2's criterion: meters and radians."""


def spl(success: bool, shortest: float, driven: float) -> float:
    """Return success weighted by path length, in [0, 1].

    Args:
        success: whether the goal was reached.
        shortest: L*, meters, positive.
        driven: P, meters.
    """
    return shortest / max(driven, shortest) if success else 0.0


def ideal_time(shortest: float) -> float:
    """Return OT, seconds, for L* in meters."""
    return shortest / FULL_SPEED


def timed(success: bool, shortest: float, time: float) -> float:
    """Return S OT / clip(T, OT, 8 OT), for L* in meters and T in seconds."""
    ideal = ideal_time(shortest)
    return ideal / min(max(time, ideal), SLOWEST * ideal) if success else 0.0


def docking_error(position: float, heading: float) -> float:
    """Return e = max(position error / 0.10 m, heading error / 0.10 rad)."""
    return max(position / DOCK_POSITION, abs(heading) / DOCK_HEADING)


def leg_score(success: bool, docked: bool, shortest: float, driven: float) -> float:
    """Return S L* / max(P, L*) of a drive of a chain, half of it out of the dock; 0 if it begins in its goal's disc."""
    if shortest <= 0.0:
        return 0.0
    return spl(success, shortest, driven) * (1.0 if docked else 0.5)


@dataclass(frozen=True)
class ScoreWeights:
    """Amounts that a score counts besides the success of a drive.

    Attributes:
        time: weight of OT / max(T, OT). people: of the distance from people. length: of L* / max(P, L*).
    """

    time: float = 1.0
    people: float = 0.1
    length: float = 0.0


DEFAULT_WEIGHTS = ScoreWeights()


@dataclass(frozen=True)
class TaskProperties:
    """The properties of a task at a level that a policy receives at the start of a drive.

    Attributes:
        rests: whether the robot must come to rest at its goal, and whether its actions come late by the policy's
            latency; False where touching the goal's disc ends the episode.
        drift: whether the odometry drifts. noise: whether the depth camera has errors.
        people: whether people may walk. glass: whether there may be panes, which rays pass.
        mounting: whether the sensors are off their nominal places.
        weights: what the score counts.
        dock_slack: distance from a docking pose within which the robot may end without a loss, meters.
    """

    rests: bool = False
    drift: bool = False
    noise: bool = False
    people: bool = False
    glass: bool = False
    mounting: bool = False
    weights: ScoreWeights = DEFAULT_WEIGHTS
    dock_slack: float = 0.0


TRANSITION = TaskProperties()
"""The paper's transition: an episode ends when the robot touches the goal's disc, and sensors are exact."""


SECONDS = 120.0
"""Time limit of a drive, seconds."""
PERSON_NEAR, DOCK_NEAR = 1.5, 1.0
"""Distances from a person and from a docking pose within which the clock of a stuck robot stands, meters.

That of a docking pose is an assumption."""
BRAKING_SHARE = 0.7
"""Share of the success radius within which the brake stops a robot that does not stop itself."""
DOCK_RADIUS = 0.05
"""Distance from a docking pose within which it does so, meters."""
DOCK_STAY = 10
"""Control steps that the robot must rest at a docking pose: 1 s."""
REWARD = RewardWeights(collision=0.0, time=-0.005, failure=-5.0)
"""Weights of the reward. A drive of 1200 control steps costs less than success and failure differ, so that no failure
of a drive, early or late, returns as much as a success."""
WHEELS = (0.02, 1.0)
"""Errors of the wheels in all tasks but `odometry`: `scale` and `veer` of `SlippingActions`."""


@dataclass(frozen=True)
class LegResult:
    """The results of a drive of a chain on which the score depends.

    Attributes:
        success: whether the robot rested in the goal's disc. docked: whether within 0.10 m and 0.10 rad of the pose.
        shortest: L* from where the drive began, meters. path_length: P, meters.
    """

    success: bool
    docked: bool
    shortest: float
    path_length: float


@dataclass(frozen=True)
class Result:
    """The results of an episode on which its score depends.

    Attributes:
        success: S, whether the robot rested in the goal's disc without a contact that ends the drive.
        shortest, path_length: L* and P, meters. time: T, seconds.
        final_distance, final_heading: from the goal pose at the end, meters and radians.
        legs: of a chain, the drives that were begun. goals: number of drives.
    """

    success: bool
    shortest: float
    path_length: float
    time: float
    final_distance: float
    final_heading: float
    legs: tuple[LegResult, ...] = ()
    goals: int = 1


Score = Callable[[Result, Mapping[str, Any], Mapping[str, Any]], float]
"""Returns the score of an episode, in [0, 1], from its results, and from outcomes and data of conditions by name."""


@dataclass(frozen=True)
class Level:
    """Properties of the episodes of a task at a level.

    Attributes:
        conditions: conditions in their order, as plain data.
        odometry: errors of the odometry, by the arguments of `OdometrySensor`.
        lidar, color: standard deviations of the ranges, meters, and of the colors, of 255. redwood: whether depth
            images have the errors of Redwood.
        mounting: greatest errors of the places of lidar and camera along each axis, meters, and of their yaw, degrees.
        slip: `scale` and `veer` of `SlippingActions`.
        lengths: least and greatest length L* of the shortest path, meters.
        detour: least ratio of L* to the straight distance.
        neck: radii of a disc that reaches the goal and of one that does not, meters; None without a neck.
        goals, rooms: least and greatest number of goals in a row, and of rooms in which they are.
    """

    conditions: tuple[Mapping[str, Any], ...] = ()
    odometry: Mapping[str, Any] = field(default_factory=dict)
    lidar: float = 0.0
    color: float = 0.0
    redwood: bool = False
    mounting: tuple[float, float] = (0.0, 0.0)
    slip: tuple[float, float] = WHEELS
    lengths: tuple[float, float] = (8.0, 25.0)
    detour: float = 1.0
    neck: tuple[float, float] | None = None
    goals: tuple[int, int] = (1, 1)
    rooms: tuple[int, int] = (1, 1)

    def has(self, kind: str) -> bool:
        """Whether a condition of a kind belongs to the level."""
        return any(condition["kind"] == kind for condition in self.conditions)

    def sensors(self, observation: str) -> tuple[Sensor, ...]:
        """Return the sensors for an observation: "lidar", "depth" or "rgbd".

        Raises:
            UnknownNameError: there is no such observation.
        """
        lidar = (Gaussian(self.lidar),) if self.lidar else ()
        depth = (RedwoodDepth(),) if self.redwood else ()
        color = (Gaussian(self.color),) if self.color else ()
        by_observation: dict[str, tuple[Sensor, ...]] = {
            "lidar": (LidarSensor(noise=lidar),),
            "depth": (DepthSensor(noise=depth),),
            "rgbd": (ColorSensor(noise=color), DepthSensor(noise=depth)),
        }
        check_name("observation", observation, by_observation)
        velocity = OdometryVelocitySensor() if self.odometry else VelocitySensor()
        return (OdometrySensor(**self.odometry), AnnouncedGoalSensor(), velocity, *by_observation[observation])

    @property
    def randomizations(self) -> tuple[Randomization, ...]:
        """Return the randomization of each episode: errors of the places of the sensors."""
        place, yaw = self.mounting
        if not place and not yaw:
            return ()
        return (SensorPoseRandomization(forward=place, left=place, height=0.0, yaw=yaw, pitch=0.0, roll=0.0),)


EASY_LENGTHS = (2.0, 10.0)
"""Least and greatest length L* at level 0, meters."""


@dataclass(frozen=True)
class LabNavTask:
    """A task.

    Attributes:
        name: of its suites and ids, lower case. summary: one line.
        levels: levels 1 to 3.
        score: of an episode.
        easy: level 0, for learners: drives of 2 to 10 m on which the task's nuisance is almost off. No suite has it.
        touched: beginnings of the names of things whose touch ends a drive; empty for all, None for none.
        radius: of the success disc, meters.
        docks: whether the robot must stand at the heading of the goal.
        chain: whether an episode has several goals in a row.
        weights: what the score counts, which policies know. dock_slack: see `TaskProperties`.
    """

    name: str
    summary: str
    levels: Mapping[int, Level]
    score: Score
    easy: Level = field(default_factory=Level)
    touched: tuple[str, ...] | None = ()
    radius: float = REST_DISTANCE
    docks: bool = False
    chain: bool = False
    weights: ScoreWeights = DEFAULT_WEIGHTS
    dock_slack: float = 0.0

    def level(self, number: int) -> Level:
        """Return a level, 0 to 3.

        Raises:
            UnknownNameError: there is no such level.
        """
        levels = {0: self.easy, **self.levels}
        if not is_whole(number) or number not in levels:
            raise UnknownNameError(f"level of task {self.name!r}", number, map(str, levels))
        return levels[number]

    def announced(self, number: int) -> TaskProperties:
        """Return the properties of a level that policies know.

        Raises:
            UnknownNameError: there is no such level.
        """
        level = self.level(number)
        return TaskProperties(
            rests=True,
            drift=bool(level.odometry),
            noise=level.redwood,
            people=level.has("people"),
            glass=level.has("glass"),
            mounting=any(level.mounting),
            weights=self.weights,
            dock_slack=self.dock_slack,
        )

    @property
    def seconds(self) -> float:
        """Time limit of an episode, seconds."""
        return SECONDS * max((level.goals[1] for level in self.levels.values()), default=1)

    @property
    def braking_distance(self) -> float:
        """Distance from the goal by odometry at which the brake takes over, meters."""
        return DOCK_RADIUS if self.docks else BRAKING_SHARE * self.radius

    def stay(self, delay: int) -> int:
        """Return the number of control steps that a robot must rest at its goal.

        In a chain of goals no action that comes late, by `delay` control steps, may reach the next drive.
        """
        if self.chain:
            return delay
        return DOCK_STAY if self.docks else 0

    def actions(self, stop: Stop | None, delay: int, slip: tuple[float, float]) -> SlippingActions:
        """Return the actions that end a drive by the brake, by STOP, or not at all.

        Args:
            stop: "brake", "action" or None. delay: control steps by which the robot obeys later.
            slip: `scale` and `veer` of `SlippingActions`.
        """
        scale, veer = slip
        if stop == "brake":
            return BrakingActions(
                delay=delay,
                scale=scale,
                veer=veer,
                distance=self.braking_distance,
                docks=self.docks,
                stay=self.stay(delay),
            )
        return SlippingActions(stop == "action", delay, STOP_THRESHOLD, STOP_HOLD, scale, veer)

    def endings(self, stop: bool) -> tuple[Ending, ...]:
        """Return the endings: contact, STOP of the agent or the brake, stuck; of a drive of a chain also others."""
        touched = () if self.touched is None else (TouchedEnding(self.touched, pushable=False),)
        stopped = (StopEnding(self.radius),) if stop else ()
        stuck = StuckEnding(people=PERSON_NEAR, goal=DOCK_NEAR if self.docks else 0.0)
        chained = (SpillEnding(), LimitEnding(SECONDS)) if self.chain else ()
        return (*touched, *stopped, stuck, *chained)


TASKS: dict[str, LabNavTask] = {}
"""The registered tasks by name."""


def register(task: LabNavTask) -> LabNavTask:
    """Register a task under its name and return it.

    Raises:
        LabgymError: another task has that name, or it is not one of lower case letters.
    """
    if not (task.name.isascii() and task.name.isalpha() and task.name.islower()):
        raise LabgymError(f"LabNav task {task.name!r}: its name must consist of lower case letters")
    if TASKS.setdefault(task.name, task) is not task:
        raise LabgymError(f"LabNav task {task.name!r} is registered twice: choose another name")
    return task
