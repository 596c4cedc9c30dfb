"""Features of goal environments: goal and sensors as the robot sees them."""

from __future__ import annotations

import torch
from gymnasium import spaces
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from torch import Tensor

from labgym.envs.sensors import LIDAR_RAYS
from labgym.policies.adapters.inputs import NEAR_GOAL_M, NEAR_GOAL_SCALE

INPUTS: tuple[str, ...] = ("goal", "near_goal", "velocity", "lidar")
"""The features, in their order, as inputs of a policy."""
CLIP = 1.5
"""Features are clipped to [-1.5, 1.5] after normalization, as in the training of `ppo`."""
MEANS = {"goal": (2.0, 0.0, 0.0), "lidar": (1.5,) * LIDAR_RAYS}
VARIANCES = {"goal": (4.0, 1.0, 1.0), "lidar": (1.0,) * LIDAR_RAYS}
"""Fixed normalization of distances, meters: it must hold for goals that were relabeled, too."""
WIDTH = 3 + 3 + 2 + LIDAR_RAYS


def statistics() -> dict[str, tuple[Tensor, Tensor]]:
    """Return mean and variance of each normalized feature."""
    return {name: (torch.tensor(MEANS[name]), torch.tensor(VARIANCES[name])) for name in MEANS}


class RobotFrame(BaseFeaturesExtractor):
    """The observation of a goal environment in the robot's frame, (n, 188).

    A pose and a goal in the start frame become distance, cosine and sine of the bearing, which depend on their
    difference alone. So a goal that hindsight experience replay relabels is the goal of the features, and the policy
    needs the same inputs as one of `labgym train ppo`.

    Args:
        observation_space: with `observation`, (x, y, cosine, sine, velocity, lidar), and `desired_goal`.
    """

    def __init__(self, observation_space: spaces.Dict) -> None:
        super().__init__(observation_space, WIDTH)
        for name, (mean, variance) in statistics().items():
            self.register_buffer(f"{name}_mean", mean, persistent=False)
            self.register_buffer(f"{name}_deviation", variance.sqrt(), persistent=False)

    def forward(self, observations: dict[str, Tensor]) -> Tensor:
        """Return the features."""
        joint = observations["observation"]
        position, axis, velocity, lidar = joint[:, :2], joint[:, 2:4], joint[:, 4:6], joint[:, 6:]
        ahead = observations["desired_goal"] - position
        distance = ahead.norm(dim=1, keepdim=True)
        along = (ahead * axis).sum(dim=1, keepdim=True)
        left = axis[:, :1] * ahead[:, 1:] - axis[:, 1:] * ahead[:, :1]
        bearing = torch.cat([along, left], dim=1) / distance.clamp_min(1e-6)
        goal = torch.cat([distance, bearing], dim=1)
        near = NEAR_GOAL_SCALE / NEAR_GOAL_M * distance.clamp_max(NEAR_GOAL_M)
        parts = [self._normal("goal", goal), near, near * bearing, velocity, self._normal("lidar", lidar)]
        return torch.cat(parts, dim=1)

    def _normal(self, name: str, value: Tensor) -> Tensor:
        mean, deviation = getattr(self, f"{name}_mean"), getattr(self, f"{name}_deviation")
        normal: Tensor = ((value - mean) / deviation).clamp(-CLIP, CLIP)
        return normal
