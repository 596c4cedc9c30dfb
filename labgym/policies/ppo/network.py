"""The actor's network: convolutions over scan and depth image, joined with goal, velocity and past positions."""

from __future__ import annotations

import math

import torch
from torch import Tensor, nn

from labgym.envs.sensors import LIDAR_RAYS, RANGE
from labgym.policies.ppo.inputs import GOAL, SMALL_IMAGE, STATE, VELOCITY, Sensor

FEATURES = 192
"""Number of features that the encoder returns."""
HIDDEN = 128
"""Width of the layer between encoder and action."""

NEARNESS_LENGTH_M = 0.5
"""Decay length of nearness, meters."""
TRAIL_SCALE_M = 3.0
"""Scale of the past positions, meters."""


class Encoder(nn.Module):
    """Vectors of `DriveMemory`, (n, SIZES[sensor]), to features, (n, 192).

    Each ray has four channels: its range, its nearness exp(-range / 0.5 m), the cosine of its angle to the goal's
    bearing, and whether it ends before or beyond the goal's distance. Three circular convolutions reduce the 180 rays
    to 15 directions, whose order is kept, because ahead differs from behind. A depth image has two channels, depth and
    nearness exp(-depth / 1 m), and two convolutions.

    Args:
        sensor: source of the vectors.
    """

    angles: Tensor

    def __init__(self, sensor: Sensor) -> None:
        super().__init__()
        angles = -math.pi + 2.0 * math.pi / LIDAR_RAYS * torch.arange(LIDAR_RAYS)
        self.register_buffer("angles", angles, persistent=False)
        self.scan = nn.Sequential(
            nn.Conv1d(4, 32, 7, stride=3, padding=3, padding_mode="circular"),
            nn.ReLU(),
            nn.Conv1d(32, 48, 5, stride=2, padding=2, padding_mode="circular"),
            nn.ReLU(),
            nn.Conv1d(48, 48, 5, stride=2, padding=2, padding_mode="circular"),
            nn.ReLU(),
            nn.Flatten(),
        )
        width = 48 * 15 + STATE + 1
        self.picture: nn.Sequential | None = None
        if sensor == "depth":
            self.picture = nn.Sequential(
                nn.Conv2d(2, 16, 5, stride=2, padding=2),
                nn.ReLU(),
                nn.Conv2d(16, 32, 3, stride=2, padding=1),
                nn.ReLU(),
                nn.Flatten(),
            )
            width += 32 * math.prod(-(-side // 4) for side in SMALL_IMAGE)
        self.join = nn.Sequential(nn.Linear(width, FEATURES), nn.ReLU())

    def forward(self, vectors: Tensor) -> Tensor:
        """Return the features of vectors."""
        sizes = [GOAL, VELOCITY, STATE - GOAL - VELOCITY, LIDAR_RAYS, vectors.shape[1] - STATE - LIDAR_RAYS]
        goal, velocity, trail, ranges, picture = torch.split(vectors, sizes, dim=1)
        distance, cosine, sine = torch.split(goal, 1, dim=1)
        towards = torch.cos(self.angles) * cosine + torch.sin(self.angles) * sine
        channels = [ranges / RANGE, torch.exp(-ranges / NEARNESS_LENGTH_M), towards, torch.tanh(ranges - distance)]
        scan = self.scan(torch.stack(channels, dim=1))
        parts = [distance / RANGE, torch.exp(-distance), cosine, sine, velocity, trail / TRAIL_SCALE_M]
        if self.picture is not None:
            depth = picture.view(-1, 1, *SMALL_IMAGE)
            parts.append(self.picture(torch.cat([depth / RANGE, torch.exp(-depth)], dim=1)))
        features: Tensor = self.join(torch.cat([scan, *parts], dim=1))
        return features


class Actor(nn.Module):
    """Vectors, (n, SIZES[sensor]), to actions, (n, 2): forward and turn, not clipped to [-1, 1].

    Args:
        sensor: source of the vectors.
    """

    def __init__(self, sensor: Sensor) -> None:
        super().__init__()
        self.encoder = Encoder(sensor)
        self.hidden = nn.Sequential(nn.Linear(FEATURES, HIDDEN), nn.ReLU())
        self.action = nn.Linear(HIDDEN, 2)

    def forward(self, vectors: Tensor) -> Tensor:
        """Return the mean actions."""
        actions: Tensor = self.action(self.hidden(self.encoder(vectors)))
        return actions
