"""The table of LabNav's tasks and levels, and the environment of each."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from labgym.envs.config import PointNavConfig
from labgym.envs.labnav.names import known_task
from labgym.envs.parts.actuation import LOCOBOT
from labgym.envs.parts.announced import AnnouncedGoalSensor, OdometryVelocitySensor
from labgym.envs.parts.depth_noise import RedwoodDepth
from labgym.envs.parts.endings import (
    REST_DISTANCE,
    LimitEnding,
    SpillEnding,
    StopEnding,
    StuckEnding,
    TouchedEnding,
)
from labgym.envs.parts.measures import EXTENDED
from labgym.envs.parts.noise import Gaussian
from labgym.envs.parts.odometry import OdometrySensor
from labgym.envs.parts.protocols import Ending, Randomization, Sensor
from labgym.envs.parts.randomizations import SensorPoseRandomization
from labgym.envs.parts.rays import ColorSensor, DepthSensor, LidarSensor
from labgym.envs.parts.slipping import SlippingActions
from labgym.envs.parts.vectors import VelocitySensor
from labgym.errors import OptionError, UnknownNameError

HEADLINE = 2
"""The level whose figure is the headline."""
SECONDS = 120.0
"""Time limit of a drive, seconds."""
PERSON_NEAR, DOCK_NEAR = 1.5, 1.0
"""Distances from a person and from a docking pose within which the clock of a stuck robot stands, meters.

That of a docking pose is an assumption."""
WHEELS = (0.02, 1.0)
"""Errors of the wheels in all tasks but `odometry`: `scale` and `veer` of `SlippingActions`."""
MOUNTING = (0.02, 1.5)
"""Errors of the places of the sensors in `dock`, drawn for each episode."""
MEASURES = (*EXTENDED, "touched", "outcomes")
ONWARD = ("stop", "stuck", "spill", "time")
"""Endings of a drive of `shift` after which the next one begins."""


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


@dataclass(frozen=True)
class LabNavTask:
    """A task.

    Attributes:
        name: of its suites and ids. summary: one line.
        levels: levels 1 to 3.
        touched: beginnings of the names of things whose touch ends a drive; empty for all, None for none.
        radius: of the success disc, meters.
        docks: whether the robot must stand at the heading of the goal.
        chain: whether an episode has several goals in a row.
    """

    name: str
    summary: str
    levels: Mapping[int, Level]
    touched: tuple[str, ...] | None = ()
    radius: float = REST_DISTANCE
    docks: bool = False
    chain: bool = False

    def level(self, number: int) -> Level:
        """Return a level.

        Raises:
            UnknownNameError: there is no such level.
        """
        if isinstance(number, bool) or not isinstance(number, int) or number not in self.levels:
            raise UnknownNameError(f"level of task {self.name!r}", number, map(str, self.levels))
        return self.levels[number]


NOISE: dict[str, Any] = {"lidar": 0.03, "color": 25.5, "redwood": True}
"""Errors of the sensors in `odometry`: 0.1 of the range of colors."""


def _aisle(reaches: float, stops: float) -> Level:
    return Level(({"kind": "parked"},), detour=1.3, neck=(reaches, stops))


STEP, TURN = 0.25, math.radians(30.0)
"""Amounts of the discrete actions to which published errors belong: meters and radians."""


def _robothor(factor: float) -> dict[str, float]:
    """Return RoboTHOR's errors of an action, 5 mm and 0.5 degrees, as variances that add along the way."""
    along, turn = 0.005 * factor / math.sqrt(STEP), math.sqrt(2.0 * math.pi / TURN)
    return {"along": along, "heading": 0.5 * factor / math.sqrt(STEP), "turning": 0.5 * factor * turn}


def _locobot(controller: str, factor: float) -> dict[str, float]:
    """Return the errors of a LoCoBot in Habitat, mean and variance of an action, as means and variances that add."""
    table = LOCOBOT[controller]
    (step, step_variance), (veer, veer_variance) = table.ahead, table.turned
    turn, turn_variance = table.turned_turning
    circle = 2.0 * math.pi / TURN
    return {
        "along": factor * math.sqrt(step_variance / STEP),
        "heading": factor * math.degrees(math.sqrt(veer_variance / STEP)),
        "turning": factor * math.degrees(math.sqrt(turn_variance * circle)),
        "stretch": factor * step / STEP,
        "veer": factor * math.degrees(veer / STEP),
        "overturn": factor * turn / TURN,
    }


def _odometry(errors: Mapping[str, Any], slip: float) -> Level:
    return Level(odometry=errors, slip=(0.03 * slip, 2.0 * slip), **NOISE)


def _carry(freeboard: float) -> Level:
    return Level(({"kind": "payload", "beaker": {"freeboard": freeboard}}, _people(20.0)))


def _people(area: float, group: int = 1) -> dict[str, Any]:
    return {"kind": "people", "density": 1.0 / area, "group": group}


def _crowd(area: float, group: int = 1, lengths: tuple[float, float] = (4.0, 10.0)) -> Level:
    return Level((_people(area, group),), lengths=lengths)


def _moved(**changes: Any) -> Level:
    return Level(({"kind": "changes", **changes},), lengths=(4.0, 25.0))


def _dock(distance: float, degrees: float) -> Level:
    return Level(
        ({"kind": "station", "distance": distance, "angle": math.radians(degrees)},),
        lengths=(4.0, 25.0),
        lidar=0.03,
        mounting=MOUNTING,
    )


def _shift(drift: Level, changes: Level, freeboard: float, people: Level | None) -> Level:
    """Return a level of `shift` with the errors, changes and people of levels of other tasks."""
    payload = {"kind": "leg_payload", "beaker": {"freeboard": freeboard}}
    crowd = () if people is None else people.conditions
    conditions = (*changes.conditions, payload, *crowd)
    return replace(drift, conditions=conditions, lengths=(0.5, 60.0), detour=0.0, goals=(5, 10), rooms=(2, 4))


def _glass(panes: int, framed: bool) -> Level:
    return Level(({"kind": "glass", "panes": panes, "framed": framed},), lengths=(4.0, 25.0))


TASKS: dict[str, LabNavTask] = {
    task.name: task
    for task in (
        LabNavTask(
            "aisle",
            "drive fast through a neck that is little wider than the robot",
            {1: _aisle(0.40, 0.45), 2: _aisle(0.35, 0.40), 3: _aisle(0.31, 0.35)},
        ),
        LabNavTask(
            "moved",
            "drive by a map from before things moved",
            {1: _moved(most=1), 2: _moved(), 3: _moved(late=True)},
        ),
        LabNavTask(
            "people",
            "drive among people, half of whom do not see the robot",
            {1: _crowd(20.0), 2: _crowd(8.0), 3: _crowd(8.0, group=3, lengths=(8.0, 16.0))},
        ),
        LabNavTask(
            "odometry",
            "find a goal that is announced once, by wheels and sensors that err",
            {
                1: _odometry(_robothor(0.5), 0.5),
                2: _odometry(_robothor(1.0), 1.0),
                3: _odometry(_locobot("ilqr", 0.5), 2.0),
            },
        ),
        LabNavTask(
            "dock",
            "dock at a station that is off its mapped pose",
            {1: _dock(0.05, 3.0), 2: _dock(0.10, 6.0), 3: _dock(0.15, 9.0)},
            docks=True,
        ),
        LabNavTask(
            "glass",
            "drive among panes of glass that are on no map",
            {1: _glass(1, True), 2: _glass(1, False), 3: _glass(2, False)},
        ),
        LabNavTask(
            "carry",
            "carry an open beaker without spilling",
            {1: _carry(0.020), 2: _carry(0.010), 3: _carry(0.005)},
        ),
        LabNavTask(
            "shift",
            "drive to all places of a protocol, without a reset",
            {
                1: _shift(_odometry(_robothor(0.5), 0.5), _moved(most=1), 0.020, None),
                2: _shift(_odometry(_robothor(0.5), 0.5), _moved(most=1), 0.020, _crowd(20.0)),
                3: _shift(_odometry(_robothor(1.0), 1.0), _moved(), 0.010, _crowd(8.0)),
            },
            touched=("person",),
            docks=True,
            chain=True,
        ),
    )
}
"""The tasks whose conditions exist, by name."""


def task_of(name: str) -> LabNavTask:
    """Return a task.

    Raises:
        UnknownNameError: no task has that name.
    """
    return TASKS[known_task(name)]


def sensors_of(level: Level, observation: str) -> tuple[Sensor, ...]:
    """Return the sensors of a level for an observation: "lidar", "depth" or "rgbd".

    Raises:
        UnknownNameError: there is no such observation.
    """
    lidar = (Gaussian(level.lidar),) if level.lidar else ()
    depth = (RedwoodDepth(),) if level.redwood else ()
    color = (Gaussian(level.color),) if level.color else ()
    by_observation: dict[str, tuple[Sensor, ...]] = {
        "lidar": (LidarSensor(noise=lidar),),
        "depth": (DepthSensor(noise=depth),),
        "rgbd": (ColorSensor(noise=color), DepthSensor(noise=depth)),
    }
    if observation not in by_observation:
        raise UnknownNameError("observation", observation, by_observation)
    velocity = OdometryVelocitySensor() if level.odometry else VelocitySensor()
    return (OdometrySensor(**level.odometry), AnnouncedGoalSensor(), velocity, *by_observation[observation])


def endings_of(task: LabNavTask, stop: bool) -> tuple[Ending, ...]:
    """Return the endings of a task: contact, STOP if the action has it, stuck; of a drive of a chain also others."""
    touched = () if task.touched is None else (TouchedEnding(task.touched, pushable=False),)
    stopped = (StopEnding(task.radius),) if stop else ()
    stuck = StuckEnding(people=PERSON_NEAR, goal=DOCK_NEAR if task.docks else 0.0)
    chained = (SpillEnding(), LimitEnding(SECONDS)) if task.chain else ()
    return (*touched, *stopped, stuck, *chained)


def randomizations_of(level: Level) -> tuple[Randomization, ...]:
    """Return what is drawn for each episode: the errors of the places of the sensors."""
    place, yaw = level.mounting
    if not place and not yaw:
        return ()
    return (SensorPoseRandomization(forward=place, left=place, height=0.0, yaw=yaw, pitch=0.0, roll=0.0),)


def config_of(
    name: str,
    level: int = HEADLINE,
    observation: str = "lidar",
    stop: bool = True,
    delay: int = 0,
    properties: Level | None = None,
    **fields: Any,
) -> PointNavConfig:
    """Return the environment of a task.

    Args:
        name: of the task. level: 1 to 3.
        observation: "lidar", "depth" or "rgbd".
        stop: whether the action has a third component, STOP, that ends the drive.
        delay: number of control steps by which the robot obeys later.
        properties: those of the drives, by default those of the level.
        fields: further fields of `PointNavConfig`.

    Raises:
        UnknownNameError: there is no such task, level or observation.
    """
    task = task_of(name)
    number = task.level(level) if properties is None else properties
    if not isinstance(stop, bool):
        raise OptionError(f"stop is {stop!r}, expected True or False")
    values: dict[str, Any] = {
        "observation": observation,
        "sensors": sensors_of(number, observation),
        "actions": SlippingActions(stop, delay, *number.slip),
        "endings": endings_of(task, stop),
        "onward": ONWARD if task.chain else (),
        "randomizations": randomizations_of(number),
        "conditions": ({"kind": "contacts"}, *number.conditions),
        "disc": task.radius,
        "distance_to_go": "exact",
        "measures": (*MEASURES, "leg", "legs") if task.chain else MEASURES,
    }
    return PointNavConfig(**(values | fields))


def condition_names(name: str, level: int) -> tuple[str, ...]:
    """Return the names of the conditions of a task at a level whose data an episode has.

    Raises:
        UnknownNameError: there is no such task or level.
    """
    return tuple(condition.name for condition in config_of(name, level).conditions if condition.name != "contacts")
