"""Layers that the image encoders share, and the goal as networks read it."""

from __future__ import annotations

import math

import torch
from torch import Tensor, nn


class ImageStage(nn.Module):
    """Halve an image, then apply one residual block: (b, c_in, h, w) -> (b, c_out, ceil(h / 2), ceil(w / 2)).

    Args:
        channels_in, channels_out: channels of the images.
        norm: applied after the halving convolution; None for no normalization.
    """

    def __init__(self, channels_in: int, channels_out: int, norm: nn.Module | None = None) -> None:
        super().__init__()
        self.down = nn.Conv2d(channels_in, channels_out, 3, stride=2, padding=1)
        self.norm = norm or nn.Identity()
        self.first = nn.Conv2d(channels_out, channels_out, 3, padding=1)
        self.second = nn.Conv2d(channels_out, channels_out, 3, padding=1)

    def forward(self, images: Tensor) -> Tensor:
        """Return the features of images."""
        down = torch.relu(self.norm(self.down(images)))
        return torch.relu(down + self.second(torch.relu(self.first(down))))


def polar_goal(goal: Tensor, scale: float, farthest: float = math.inf) -> Tensor:
    """Return goals as distance divided by `scale`, cosine and sine of the bearing: (b, 3).

    Args:
        goal: (b, 2) in the robot frame, meters.
        scale: meters.
        farthest: upper limit of the scaled distance.
    """
    distance = goal.norm(dim=1, keepdim=True)
    return torch.cat([(distance / scale).clamp(max=farthest), goal / distance.clamp(min=1e-6)], dim=1)
