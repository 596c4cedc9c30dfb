"""Gymnasium environments, the robot and its sensors."""

from labgym.envs.point_nav import LabPointNavEnv
from labgym.envs.rewards import RewardWeights
from labgym.envs.robot import RobotSpec, robot_spec

__all__ = ["LabPointNavEnv", "RewardWeights", "RobotSpec", "robot_spec"]
