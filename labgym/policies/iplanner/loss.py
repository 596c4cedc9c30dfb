"""The imperative loss: a path is scored by the cost map under it, and the score is differentiated."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import torch
from torch import Tensor

from labgym.policies.data.maps import Maps
from labgym.policies.iplanner.config import IPlannerLossOptions
from labgym.policies.learned.map_stack import MapStack


def cost_maps(maps: Sequence[Maps]) -> MapStack:
    """Return the cost maps of layouts, sampled bicubically and continued by their edge."""
    return MapStack(maps, [each.cost for each in maps], "bicubic", "edge")


class IPlannerLosses(NamedTuple):
    """The loss and its terms before weighting, each a mean over the batch."""

    total: Tensor
    obstacle: Tensor
    motion: Tensor
    goal: Tensor


def planning_loss(
    path: Tensor, costs: Tensor, miss: Tensor, reach: Tensor, options: IPlannerLossOptions
) -> IPlannerLosses:
    """Return the loss of planned paths.

    Args:
        path: (b, n, 2) from the origin, robot frame, meters.
        costs: (b, n) of the cost map at the path's points.
        miss: (b,) distance by which each path's end misses its target, meters.
        reach: (b,) length of the way to the target, meters.
        options: weights of the terms.
    """
    steps = (path[:, 1:] - path[:, :-1]).norm(dim=2)
    even = reach[:, None] / steps.shape[1]
    obstacle = costs.sum(dim=1).mean()
    motion = (steps - even).abs().sum(dim=1).mean()
    goal = torch.log1p(miss).mean()
    total = options.obstacle * obstacle + options.motion * motion + options.goal * goal
    return IPlannerLosses(total, obstacle, motion, goal)
