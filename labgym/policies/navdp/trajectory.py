"""Paths as what is denoised: small steps (dx, dy, dtheta), whose running sum is the trajectory."""

from __future__ import annotations

import math

import torch
from torch import Tensor

LEFT_FOR_RIGHT = torch.tensor([1.0, -1.0, -1.0])
"""What mirrors a step."""


def steps_of(path: Tensor, scale: float) -> Tensor:
    """Return paths (b, n, 2) from the origin, robot frame, metres, as steps (b, n - 1, 3), each of them in [-1, 1].

    The heading turns to the path's direction as fast as the bound allows.
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
    """Return the points (b, n, 2) that steps (b, n, 3) lead through, the origin left out."""
    return steps[..., :2].cumsum(dim=1) / scale


def resampled(path: Tensor, length: Tensor, horizon: float, count: int) -> Tensor:
    """Return the first metres of paths as `count` + 1 points at even distances.

    Args:
        path: (b, n, 2) at even distances from the robot to the goal. length: (b,) of the paths, metres.
        horizon: what is returned ends this far along, or at the goal where that is nearer, metres.
    """
    share = (horizon / length.clamp(min=1e-6)).clamp(max=1.0)
    place = share[:, None] * torch.linspace(0.0, 1.0, count + 1) * (path.shape[1] - 1)
    before = place.floor().long().clamp(max=path.shape[1] - 2)
    part = (place - before)[..., None]
    first = torch.gather(path, 1, before[..., None].expand(-1, -1, 2))
    second = torch.gather(path, 1, (before + 1)[..., None].expand(-1, -1, 2))
    return first + part * (second - first)


def turned(path: Tensor, angle: Tensor) -> Tensor:
    """Return paths (b, n, 2) turned about the robot by angles (b,), radians."""
    cosine, sine = angle.cos()[:, None], angle.sin()[:, None]
    x, y = path[..., 0], path[..., 1]
    return torch.stack([cosine * x - sine * y, sine * x + cosine * y], dim=2)
