"""The network: one depth image and a goal in, a path and the fear that it collides out."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import torch
from safetensors.torch import load_file, save_file
from torch import Tensor, nn
from torch.nn import functional

from labgym.envs.sensors import IMAGE_SHAPE, RANGE
from labgym.errors import DocumentError
from labgym.policies.iplanner.config import NetworkOptions, PlannerConfig
from labgym.policies.iplanner.spline import path_through, path_weights

POOL = 2
"""The image is averaged over squares of this many pixels before anything else: a degree a pixel is left."""

CONFIG, WEIGHTS = "config.json", "weights.safetensors"


class Plan(NamedTuple):
    """What the network says.

    Attributes:
        path: (b, points, 2) from the origin, robot frame, metres.
        fear: (b,) logits that the path's beginning collides.
    """

    path: Tensor
    fear: Tensor


class PlannerNetwork(nn.Module):
    """A residual encoder of the depth image, joined with the goal, and two heads: key points and fear.

    A key point is given by the step from the one before: what the path's end learns then moves all of it.
    """

    weights: Tensor

    def __init__(self, options: NetworkOptions) -> None:
        super().__init__()
        self.options = options
        widths = options.channels
        self.encoder = nn.Sequential(
            nn.Conv2d(1, widths[0], 5, stride=2, padding=2),
            nn.ReLU(),
            *(_Stage(here, there) for here, there in pairwise(widths)),
        )
        self.goal = nn.Linear(3, options.goal_width)
        joined = widths[-1] + options.goal_width
        self.join = nn.Sequential(
            nn.Conv2d(joined, 96, 3, padding=1), nn.ReLU(), nn.Conv2d(96, 48, 3, stride=2, padding=1), nn.ReLU()
        )
        rows, columns = _halved(IMAGE_SHAPE, len(widths) + 2)
        self.body = nn.Sequential(nn.Flatten(), nn.Linear(48 * rows * columns + 3, 256), nn.ReLU())
        self.points = nn.Sequential(nn.Linear(256, 128), nn.ReLU(), nn.Linear(128, 2 * options.key_points))
        self.fear = nn.Sequential(nn.Linear(256, 64), nn.ReLU(), nn.Linear(64, 1))
        self.register_buffer("weights", path_weights(options.key_points + 1, options.path_points), persistent=False)

    def forward(self, depth: Tensor, goal: Tensor) -> Plan:
        """Plan.

        Args:
            depth: (b, 72, 128) planar metres; what is not nearer than 10 counts as nothing seen.
            goal: (b, 2) in the robot frame, metres.
        """
        seen = torch.where(depth < RANGE, depth / RANGE, torch.zeros_like(depth))
        features = self.encoder(functional.avg_pool2d(seen[:, None], POOL))
        polar = _polar(goal)
        spread = self.goal(polar)[:, :, None, None].expand(-1, -1, *features.shape[2:])
        joined = self.join(torch.cat([features, spread], dim=1))
        body = self.body(torch.cat([joined.flatten(1), polar], dim=1))
        steps = self.points(body).view(len(depth), self.options.key_points, 2)
        return Plan(path_through(steps.cumsum(dim=1), self.weights), self.fear(body)[:, 0])


class _Stage(nn.Module):
    """Halve the image, then one residual block."""

    def __init__(self, here: int, there: int) -> None:
        super().__init__()
        self.down = nn.Conv2d(here, there, 3, stride=2, padding=1)
        self.first = nn.Conv2d(there, there, 3, padding=1)
        self.second = nn.Conv2d(there, there, 3, padding=1)

    def forward(self, features: Tensor) -> Tensor:
        down = torch.relu(self.down(features))
        return torch.relu(down + self.second(torch.relu(self.first(down))))


def save_planner(folder: str | Path, network: PlannerNetwork, config: PlannerConfig) -> None:
    """Write `config.json` and `weights.safetensors`."""
    folder = Path(folder)
    config.save(folder / CONFIG)
    save_file({name: value.contiguous() for name, value in network.state_dict().items()}, folder / WEIGHTS)


def load_planner(folder: str | Path) -> PlannerNetwork:
    """Return a trained network, ready to plan.

    Raises:
        DocumentError: a file is missing or broken, or the weights are of another network than the configuration's.
    """
    folder = Path(folder)
    network = PlannerNetwork(PlannerConfig.load(folder / CONFIG).network)
    try:
        network.load_state_dict(load_file(folder / WEIGHTS))
    except Exception as error:  # noqa: BLE001 - safetensors and torch each raise types of their own
        raise DocumentError(folder / WEIGHTS, "", " ".join(str(error).split())[:300]) from None
    return network.eval()


def _polar(goal: Tensor) -> Tensor:
    """Return distance (a tenth, at most 1), cosine and sine of the bearing, (b, 3)."""
    distance = goal.norm(dim=1, keepdim=True)
    return torch.cat([(distance / RANGE).clamp(max=1.0), goal / distance.clamp(min=1e-6)], dim=1)


def _halved(shape: tuple[int, int], times: int) -> Iterator[int]:
    return (-(-side // 2**times) for side in shape)
