"""All parts of ours: the interface and the classes of each role."""

from __future__ import annotations

from typing import Any

from labgym.envs.conditions.changes import Changes
from labgym.envs.conditions.contacts import Contacts
from labgym.envs.conditions.glass import Glass
from labgym.envs.conditions.leg_payload import LegPayload
from labgym.envs.conditions.parked import Parked
from labgym.envs.conditions.payload import Payload
from labgym.envs.conditions.people import People
from labgym.envs.conditions.station import Station
from labgym.envs.conditions.wet import WetFloor
from labgym.envs.parts.actions import VelocityActions
from labgym.envs.parts.actuation import ActuationNoise, LoCoBotActuation, RoboThorActuation
from labgym.envs.parts.announced import AnnouncedGoalSensor, OdometryVelocitySensor
from labgym.envs.parts.appearance import AppearanceRandomization
from labgym.envs.parts.depth_noise import RedwoodDepth, RimOcclusion
from labgym.envs.parts.discrete import DiscreteActions
from labgym.envs.parts.endings import (
    ContactEnding,
    LimitEnding,
    RestEnding,
    SpillEnding,
    StopEnding,
    StuckEnding,
    TouchedEnding,
    TouchEnding,
)
from labgym.envs.parts.goals import GoalEnding, GoalTerm
from labgym.envs.parts.maps import OccupancySensor, SegmentationSensor
from labgym.envs.parts.measures import NamedMeasure
from labgym.envs.parts.mjcf import MjcfRobot
from labgym.envs.parts.noise import Dropout, Gaussian, Quantization
from labgym.envs.parts.odometry import BumperSensor, OdometrySensor
from labgym.envs.parts.protocols import (
    Actions,
    Condition,
    Ending,
    Measure,
    Noise,
    Randomization,
    RewardTerm,
    Robot,
    Sensor,
)
from labgym.envs.parts.randomizations import (
    FrictionRandomization,
    MassRandomization,
    NoiseRandomization,
    SensorPoseRandomization,
)
from labgym.envs.parts.rays import ColorSensor, DepthSensor, LidarSensor
from labgym.envs.parts.rewards import (
    ClearanceTerm,
    CollisionTerm,
    FailureTerm,
    FunctionTerm,
    ProgressTerm,
    SuccessTerm,
    TimeTerm,
)
from labgym.envs.parts.robots import DifferentialDrive, HolonomicDrive
from labgym.envs.parts.slipping import SlippingActions
from labgym.envs.parts.vectors import GoalSensor, JointSensor, PlaceSensor, PoseSensor, VelocitySensor
from labgym.envs.parts.wheels import WheeledDrive

ROLES: dict[str, tuple[Any, tuple[type[Any], ...]]] = {
    "sensor": (
        Sensor,
        (
            GoalSensor,
            AnnouncedGoalSensor,
            OdometryVelocitySensor,
            VelocitySensor,
            PoseSensor,
            PlaceSensor,
            JointSensor,
            LidarSensor,
            DepthSensor,
            ColorSensor,
            SegmentationSensor,
            OccupancySensor,
            OdometrySensor,
            BumperSensor,
        ),
    ),
    "noise": (Noise, (Gaussian, Dropout, Quantization, RimOcclusion, RedwoodDepth)),
    "reward term": (
        RewardTerm,
        (
            ProgressTerm,
            SuccessTerm,
            FailureTerm,
            CollisionTerm,
            TimeTerm,
            ClearanceTerm,
            FunctionTerm,
            GoalTerm,
        ),
    ),
    "ending": (
        Ending,
        (
            TouchEnding,
            RestEnding,
            StopEnding,
            ContactEnding,
            TouchedEnding,
            StuckEnding,
            LimitEnding,
            SpillEnding,
            GoalEnding,
        ),
    ),
    "measure": (Measure, (NamedMeasure,)),
    "actions": (Actions, (VelocityActions, SlippingActions, DiscreteActions)),
    "actuation noise": (ActuationNoise, (LoCoBotActuation, RoboThorActuation)),
    "robot": (Robot, (DifferentialDrive, HolonomicDrive, WheeledDrive, MjcfRobot)),
    "condition": (Condition, (Contacts, Parked, Payload, LegPayload, Glass, WetFloor, Changes, Station, People)),
    "randomization": (
        Randomization,
        (
            MassRandomization,
            FrictionRandomization,
            SensorPoseRandomization,
            NoiseRandomization,
            AppearanceRandomization,
        ),
    ),
}
