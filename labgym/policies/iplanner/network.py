"""The network: key points from one depth image and a goal, and the cubic path through them."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import torch
from torch import Tensor, nn
from torch.nn import functional

from labgym.envs.sensors import IMAGE_SHAPE, RANGE
from labgym.policies.iplanner.config import IPlannerConfig, IPlannerNetworkOptions
from labgym.policies.learned.encoder import ImageStage, polar_goal
from labgym.policies.learned.weights import CONFIG, check_size, load_weights, save_weights

POOL_PIXELS = 2
"""The image is first averaged over squares of this many pixels, which leaves about one degree per pixel."""


def path_weights(knots: int, points: int) -> Tensor:
    """Return the matrix (points, knots) from knots to points at even parameters of a cubic Hermite spline.

    The tangent at a knot is half the difference of its neighbors (Catmull-Rom), at an end the first difference. The
    spline passes through each knot; if points - 1 is a multiple of knots - 1, every (points - 1) / (knots - 1)-th
    point is a knot.
    """
    slopes = torch.zeros(knots, knots, dtype=torch.float64)
    for k in range(knots):
        before, after = max(k - 1, 0), min(k + 1, knots - 1)
        slopes[k, after] += 1.0 / (after - before)
        slopes[k, before] -= 1.0 / (after - before)
    values = torch.eye(knots, dtype=torch.float64)
    place = torch.linspace(0.0, knots - 1.0, points, dtype=torch.float64)
    piece = place.long().clamp(max=knots - 2)
    t = (place - piece)[:, None]
    return (
        (2 * t**3 - 3 * t**2 + 1) * values[piece]
        + (t**3 - 2 * t**2 + t) * slopes[piece]
        + (3 * t**2 - 2 * t**3) * values[piece + 1]
        + (t**3 - t**2) * slopes[piece + 1]
    ).float()


def path_through(key_points: Tensor, weights: Tensor) -> Tensor:
    """Return paths (b, points, 2) from the origin through key points (b, k, 2).

    Args:
        key_points: (b, k, 2).
        weights: `path_weights(k + 1, points)`.
    """
    knots = torch.cat([torch.zeros_like(key_points[:, :1]), key_points], dim=1)
    return torch.einsum("pk,bkd->bpd", weights, knots)


class IPlannerNetwork(nn.Module):
    """A residual encoder of the depth image, joined with the goal, and a head that predicts key points.

    Each key point is predicted as a step from the previous one, so that gradients from the path's end move all of it.
    """

    weights: Tensor

    def __init__(self, options: IPlannerNetworkOptions) -> None:
        super().__init__()
        self.options = options
        widths = options.channels
        self.encoder = nn.Sequential(
            nn.Conv2d(1, widths[0], 5, stride=2, padding=2),
            nn.ReLU(),
            *(ImageStage(inner, outer) for inner, outer in pairwise(widths)),
        )
        self.goal = nn.Linear(3, options.goal_width)
        joined = widths[-1] + options.goal_width
        self.join = nn.Sequential(
            nn.Conv2d(joined, 96, 3, padding=1), nn.ReLU(), nn.Conv2d(96, 48, 3, stride=2, padding=1), nn.ReLU()
        )
        rows, columns = _halved(IMAGE_SHAPE, len(widths) + 2)
        self.body = nn.Sequential(nn.Flatten(), nn.Linear(48 * rows * columns + 3, 256), nn.ReLU())
        self.points = nn.Sequential(nn.Linear(256, 128), nn.ReLU(), nn.Linear(128, 2 * options.key_points))
        with torch.device("cpu"):  # on "meta", torch would import its compiler for it: two seconds
            weights = path_weights(options.key_points + 1, options.path_points)
        self.register_buffer("weights", weights, persistent=False)

    def forward(self, depth: Tensor, goal: Tensor) -> Tensor:
        """Return paths from the origin: (b, path_points, 2), robot frame, meters.

        Args:
            depth: (b, 72, 128) planar meters; 10 and more means that nothing was hit.
            goal: (b, 2) in the robot frame, meters.
        """
        hits = torch.where(depth < RANGE, depth / RANGE, torch.zeros_like(depth))
        features = self.encoder(functional.avg_pool2d(hits[:, None], POOL_PIXELS))
        polar = polar_goal(goal, RANGE, farthest=1.0)
        spread = self.goal(polar)[:, :, None, None].expand(-1, -1, *features.shape[2:])
        joined = self.join(torch.cat([features, spread], dim=1))
        body = self.body(torch.cat([joined.flatten(1), polar], dim=1))
        steps = self.points(body).view(len(depth), self.options.key_points, 2)
        return path_through(steps.cumsum(dim=1), self.weights)


def save_iplanner(folder: str | Path, network: IPlannerNetwork, config: IPlannerConfig) -> None:
    """Write `config.json` and `weights.safetensors`."""
    config.save(Path(folder) / CONFIG)
    save_weights(network, folder)


def load_iplanner(folder: str | Path) -> IPlannerNetwork:
    """Return a trained network in evaluation mode.

    Raises:
        DocumentError: a file is missing or broken, or the weights belong to another network than the configuration.
    """
    path = Path(folder) / CONFIG
    options = IPlannerConfig.load(path).network
    check_size(lambda: IPlannerNetwork(options), path)
    return load_weights(IPlannerNetwork(options), folder)


def _halved(shape: tuple[int, int], times: int) -> Iterator[int]:
    return (-(-side // 2**times) for side in shape)
