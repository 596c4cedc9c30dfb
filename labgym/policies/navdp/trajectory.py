"""Paths as the network denoises them: small steps (dx, dy, dtheta) whose running sum is the trajectory."""

from __future__ import annotations

import math

import torch
from torch import Tensor

MIRROR_STEP = torch.tensor([1.0, -1.0, -1.0])
"""Mirrors a step (dx, dy, dtheta): left becomes right."""


def steps_of(path: Tensor, scale: float) -> Tensor:
    """Return paths as steps (b, n - 1, 3), each in [-1, 1].

    The heading turns to the path's direction as fast as the bound allows.

    Args:
        path: (b, n, 2) from the origin, robot frame, meters.
        scale: meters and radians are multiplied by this.
    """
    moves = path[:, 1:] - path[:, :-1]
    headings = torch.atan2(moves[..., 1], moves[..., 0])
    heading = torch.zeros(len(path), dtype=path.dtype)
    turns = []
    for k in range(moves.shape[1]):
        error = torch.remainder(headings[:, k] - heading + math.pi, 2.0 * math.pi) - math.pi
        turn = error.clamp(-1.0 / scale, 1.0 / scale)
        turns.append(turn)
        heading = heading + turn
    steps = torch.cat([moves, torch.stack(turns, dim=1)[..., None]], dim=2)
    return (scale * steps).clamp(-1.0, 1.0)


def points_of(steps: Tensor, scale: float) -> Tensor:
    """Return the points (b, n, 2), meters, that steps (b, n, 3) lead through, without the origin."""
    return steps[..., :2].cumsum(dim=1) / scale


def first_part(path: Tensor, length: Tensor, horizon: float, count: int) -> Tensor:
    """Return the first meters of paths as `count` + 1 points at even distances, (b, count + 1, 2).

    Args:
        path: (b, n, 2) at even distances from the robot to the goal.
        length: (b,) of the paths, meters.
        horizon: where the part ends along the path, meters; at the goal if that is nearer.
        count: number of steps.
    """
    share = (horizon / length.clamp(min=1e-6)).clamp(max=1.0)
    place = share[:, None] * torch.linspace(0.0, 1.0, count + 1) * (path.shape[1] - 1)
    before = place.floor().long().clamp(max=path.shape[1] - 2)
    part = (place - before)[..., None]
    first = torch.gather(path, 1, before[..., None].expand(-1, -1, 2))
    second = torch.gather(path, 1, (before + 1)[..., None].expand(-1, -1, 2))
    return first + part * (second - first)
