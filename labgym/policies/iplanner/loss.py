"""The imperative loss: a path is judged by the cost map that it runs over, and the judgement is differentiated."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from torch.nn import functional

from labgym.policies.data.maps import Maps
from labgym.policies.iplanner.config import LossOptions


class CostMaps:
    """Cost maps of many layouts in one tensor, sampled bicubically.

    Args:
        maps: one a layout, all of one resolution; smaller ones are continued by their edge.
    """

    def __init__(self, maps: Sequence[Maps]) -> None:
        rows, columns = (max(each.cost.shape[axis] for each in maps) for axis in range(2))
        self._costs = torch.stack([torch.from_numpy(_continued(each.cost, rows, columns)) for each in maps])[:, None]
        self._origins = torch.tensor([each.origin for each in maps], dtype=torch.float32)
        self._size = torch.tensor([columns, rows]) * maps[0].resolution

    def at(self, points: Tensor, place: Tensor) -> Tensor:
        """Return the cost at points (b, n, 2) of the room frame in the maps of index `place` (b,): (b, n)."""
        grid = 2.0 * (points - self._origins[place][:, None]) / self._size - 1.0
        found = functional.grid_sample(
            self._costs[place], grid[:, None], mode="bicubic", padding_mode="border", align_corners=False
        )
        return found[:, 0, 0]


class Losses(NamedTuple):
    """The loss and its terms before weighting, each a mean over the batch."""

    total: Tensor
    obstacle: Tensor
    motion: Tensor
    goal: Tensor
    fear: Tensor


def planning_loss(
    path: Tensor, fear: Tensor, costs: Tensor, target: Tensor, reach: Tensor, options: LossOptions
) -> Losses:
    """Return the loss of planned paths.

    Args:
        path: (b, n, 2) from the origin, robot frame, metres. fear: (b,) logits.
        costs: (b, n) of the cost map at the path's points.
        target: (b, 2) where the path is to end. reach: (b,) how far the way there is, metres.
    """
    steps = (path[:, 1:] - path[:, :-1]).norm(dim=2)
    even = reach[:, None] / steps.shape[1]
    obstacle = costs.sum(dim=1).mean()
    motion = (steps - even).abs().sum(dim=1).mean()
    goal = torch.log1p((target - path[:, -1]).norm(dim=1)).mean()
    afraid = functional.binary_cross_entropy_with_logits(fear, fear_label(steps, costs, options))
    total = options.obstacle * obstacle + options.motion * motion + options.goal * goal + options.fear * afraid
    return Losses(total, obstacle, motion, goal, afraid)


def fear_label(steps: Tensor, costs: Tensor, options: LossOptions) -> Tensor:
    """Return 1 where the highest cost in the path's first metres is too high, else 0: (b,).

    Args:
        steps: (b, n - 1) lengths between the path's points. costs: (b, n) at them.
    """
    along = functional.pad(steps.detach().cumsum(dim=1), (1, 0))
    near = torch.where(along <= options.fear_length, costs.detach(), torch.zeros_like(costs))
    return (near.amax(dim=1) > options.fear_cost).float()


def in_room(points: Tensor, pose: Tensor) -> Tensor:
    """Return points (b, n, 2) of the robot frame in the room frame, for poses (b, 3)."""
    cosine, sine = pose[:, 2:].cos(), pose[:, 2:].sin()
    x, y = points[..., 0], points[..., 1]
    return torch.stack([pose[:, :1] + cosine * x - sine * y, pose[:, 1:2] + sine * x + cosine * y], dim=2)


def _continued(cost: NDArray[np.float32], rows: int, columns: int) -> NDArray[np.float32]:
    return np.pad(cost, ((0, rows - cost.shape[0]), (0, columns - cost.shape[1])), mode="edge")
