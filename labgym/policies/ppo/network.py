"""The actor's network: convolutions over scan and picture, then what is known of goal, velocity and past."""

from __future__ import annotations

import math

import torch
from torch import Tensor, nn

from labgym.envs.sensors import LIDAR_RAYS, RANGE
from labgym.policies.ppo.inputs import GOAL, KNOWN, SMALL_IMAGE, VELOCITY, Sensor

FEATURES = 192
"""Width of what the encoder returns."""
HIDDEN = 128
"""Width of the layer between it and the action."""

NEAR = 0.5
"""Length over which nearness fades, metres."""
TRAIL_SCALE = 3.0
"""Length that the remembered positions are divided by, metres."""


class Encoder(nn.Module):
    """Vectors of `DriveMemory`, (n, SIZES[sensor]), to features, (n, 192).

    Each ray has four channels: its range, its nearness exp(-range / 0.5 m), the cosine of its angle to the goal's
    bearing, and whether it ends before or beyond the goal's distance. Three circular convolutions take the 180 rays to
    15 directions; their order is kept, since what lies ahead differs from what lies behind. The
    picture of a depth camera has two channels, depth and nearness exp(-depth / 1 m), and two convolutions.

    Args:
        sensor: whose vectors they are.
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
        width = 48 * 15 + KNOWN + 1
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
        parts = [GOAL, VELOCITY, KNOWN - GOAL - VELOCITY, LIDAR_RAYS, vectors.shape[1] - KNOWN - LIDAR_RAYS]
        goal, velocity, trail, ranges, picture = torch.split(vectors, parts, dim=1)
        distance, cosine, sine = torch.split(goal, 1, dim=1)
        towards = torch.cos(self.angles) * cosine + torch.sin(self.angles) * sine
        channels = [ranges / RANGE, torch.exp(-ranges / NEAR), towards, torch.tanh(ranges - distance)]
        seen = self.scan(torch.stack(channels, dim=1))
        known = [distance / RANGE, torch.exp(-distance), cosine, sine, velocity, trail / TRAIL_SCALE]
        if self.picture is not None:
            depth = picture.view(-1, 1, *SMALL_IMAGE)
            known.append(self.picture(torch.cat([depth / RANGE, torch.exp(-depth)], dim=1)))
        features: Tensor = self.join(torch.cat([seen, *known], dim=1))
        return features


class Actor(nn.Module):
    """Vectors, (n, SIZES[sensor]), to actions, (n, 2): forward and turn, not yet clipped to [-1, 1].

    Args:
        sensor: whose vectors they are.
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
