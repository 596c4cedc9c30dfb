"""Gymnasium environments, the robot and its sensors."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from labgym.envs.robot import RobotSpec, robot_spec

if TYPE_CHECKING:
    from labgym.envs.config import PointNavConfig
    from labgym.envs.parts.rewards import RewardWeights
    from labgym.envs.point_nav import LabPointNavEnv
    from labgym.envs.pool import LayoutPool

__all__ = ["LabPointNavEnv", "LayoutPool", "PointNavConfig", "RewardWeights", "RobotSpec", "robot_spec"]


def __getattr__(name: str) -> Any:
    """Import the environment when it is used: policies need the robot alone, in a tenth of the time."""
    if name == "LabPointNavEnv":
        from labgym.envs.point_nav import LabPointNavEnv

        return LabPointNavEnv
    if name == "LayoutPool":
        from labgym.envs.pool import LayoutPool

        return LayoutPool
    if name == "PointNavConfig":
        from labgym.envs.config import PointNavConfig

        return PointNavConfig
    if name == "RewardWeights":
        from labgym.envs.parts.rewards import RewardWeights

        return RewardWeights
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
