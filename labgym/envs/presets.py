"""The configurations of the registered environments."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

from labgym.envs.config import LABNAV, PointNavConfig
from labgym.envs.labnav.tasks import HEADLINE, TASKS, config_of
from labgym.envs.parts.discrete import DiscreteActions
from labgym.envs.parts.endings import REST_DISTANCE, RestEnding, StopEnding
from labgym.envs.parts.goals import GoalEnding, GoalTerm
from labgym.envs.parts.joint import JointSensor
from labgym.envs.parts.measures import EXTENDED
from labgym.envs.parts.rays import LidarSensor
from labgym.envs.parts.vectors import PlaceSensor, PoseSensor, VelocitySensor
from labgym.envs.tasks import FLOORS_TRAIN
from labgym.errors import UnknownNameError

FLOORS = "floors-test"
"""The split of version 1."""


@cache
def presets() -> dict[str, PointNavConfig]:
    """Return the configurations by environment id."""
    first = PointNavConfig(
        split=FLOORS,
        distance_to_go="exact",
        endings=(RestEnding(),),
        disc=REST_DISTANCE,
        measures=EXTENDED,
    )
    joint = JointSensor(sensors=(PoseSensor(), VelocitySensor(), LidarSensor()))
    return {
        "LabPointNav-v0": PointNavConfig(),
        "LabPointNav-v1": first,
        "LabPointNavDepth-v1": replace(first, observation="depth"),
        "LabPointNavRGBD-v1": replace(first, observation="rgbd"),
        "LabPointNavDiscrete-v1": replace(first, actions=DiscreteActions(), endings=(StopEnding(),)),
        "LabPointNavGoal-v1": replace(
            first,
            sensors=(joint, PlaceSensor("achieved_goal", "robot"), PlaceSensor("desired_goal", "goal")),
            rewards=(GoalTerm(),),
            endings=(GoalEnding(),),
        ),
        "LabProtocolNav-v1": replace(first, drives="protocol", measures=(*EXTENDED, "leg", "legs")),
        **{labnav_id(task): _labnav(task) for task in TASKS},
    }


def labnav_id(task: str) -> str:
    """Return the id of the environment of a LabNav task."""
    return f"LabNav{task.capitalize()}-v0"


def labnav_config_name(task: str, level: int, observation: str) -> str:
    """Return the name for `preset` of a LabNav task at a level with an observation, such as "labnav-people-3-rgbd"."""
    return f"{LABNAV}{task}-{level}-{observation}"


def _labnav(task: str, level: int = HEADLINE, observation: str = "lidar") -> PointNavConfig:
    return config_of(task, level, observation, split=FLOORS_TRAIN, drives=f"{LABNAV}{task}-{level}")


def preset(name: str) -> PointNavConfig:
    """Return the configuration of a registered environment, or of a LabNav task at any level with any observation.

    Args:
        name: an id, or a name such as "labnav-people-3-rgbd".

    Raises:
        UnknownNameError: no environment has that id, or the task, level or observation does not exist.
    """
    if name in presets():
        return presets()[name]
    task, _, rest = name.removeprefix(LABNAV).partition("-")
    level, _, observation = rest.partition("-")
    if not name.startswith(LABNAV) or not level.isdecimal():
        kind = 'configuration (an id, "labnav-TASK-LEVEL-OBSERVATION", or a .json or .yaml file)'
        raise UnknownNameError(kind, name, presets())
    return _labnav(task, int(level), observation or "lidar")
