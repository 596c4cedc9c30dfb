"""The configurations of the registered environments."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

from labgym.envs.config import PointNavConfig
from labgym.envs.labnav.tasks import HEADLINE, TASKS, config_of
from labgym.envs.parts.discrete import DiscreteActions
from labgym.envs.parts.endings import REST_DISTANCE, RestEnding, StopEnding
from labgym.envs.parts.goals import GoalEnding, GoalTerm
from labgym.envs.parts.measures import EXTENDED
from labgym.envs.parts.rays import LidarSensor
from labgym.envs.parts.vectors import JointSensor, PlaceSensor, PoseSensor, VelocitySensor
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


def _labnav(task: str) -> PointNavConfig:
    return config_of(task, HEADLINE, split=FLOORS_TRAIN, drives=f"labnav-{task}-{HEADLINE}")


def preset(name: str) -> PointNavConfig:
    """Return the configuration of a registered environment.

    Raises:
        UnknownNameError: no environment has that id.
    """
    if name not in presets():
        raise UnknownNameError("configuration (an id, or a .json or .yaml file)", name, presets())
    return presets()[name]
