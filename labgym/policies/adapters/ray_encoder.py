"""Features of a scan and a goal: convolutions around the circle of the lidar's rays."""

from __future__ import annotations

import math

import torch
from torch import Tensor, nn

from labgym.envs.sensors import LIDAR_RAYS

ENCODED: tuple[str, ...] = ("goal", "velocity", "lidar")
"""The inputs of the encoder, in their order."""
ENCODED_SIZE = 3 + 2 + LIDAR_RAYS
FAR_M, BODY_M = 6.0, 0.2
"""Distances beyond the first count as it; the second is the radius of the robot, meters."""
NEAR_M = (0.15, 0.8)
"""Distances from the robot over which the two measures of closeness fall, meters."""
GOAL_M = (1.0, 6.0)
"""Distances of the goal beyond which its two vectors have length 1, meters."""
CHANNELS = (16, 32)
"""Channels of the two convolutions."""


class RayEncoder(nn.Module):
    """Features (n, width) of goal, velocity and scan, each as observed, (n, 185).

    A ray enters as its length, as closeness, in which centimeters count near the robot, as the cosine of its angle to
    the goal, and as the length by which it reaches beyond the goal. Weights are shared by all directions; the linear
    layer after the convolutions tells them apart.

    Args:
        width: number of features.
    """

    _axes: Tensor

    def __init__(self, width: int) -> None:
        super().__init__()
        angles = -math.pi + 2.0 * math.pi / LIDAR_RAYS * torch.arange(LIDAR_RAYS)
        self.register_buffer("_axes", torch.stack([angles.cos(), angles.sin()]), persistent=False)
        first, second = CHANNELS
        self.first = nn.Conv1d(5, first, 7, stride=3, padding=3, padding_mode="circular")
        self.second = nn.Conv1d(first, second, 5, stride=2, padding=2, padding_mode="circular")
        self.last = nn.Linear(second * LIDAR_RAYS // 6 + 8, width)

    def forward(self, values: Tensor) -> Tensor:
        """Return the features."""
        goal, velocity, ranges = torch.split(values, [3, 2, LIDAR_RAYS], dim=-1)
        distance, bearing = goal[:, :1], goal[:, 1:]
        gap = (ranges - BODY_M).clamp(0.0, FAR_M)
        beyond = ((ranges - distance) / 2.0).clamp(-1.0, 1.0)
        rays = torch.stack([gap / 3.0, *((-gap / near).exp() for near in NEAR_M), bearing @ self._axes, beyond], dim=1)
        seen = torch.relu(self.second(torch.relu(self.first(rays)))).flatten(1)
        lengths = torch.cat([(distance / most).clamp(max=1.0) for most in GOAL_M], dim=1)
        vectors = (lengths[:, :, None] * bearing[:, None]).flatten(1)
        return torch.tanh(self.last(torch.cat([seen, lengths, vectors, velocity], dim=1)))
