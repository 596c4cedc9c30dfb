"""The rigid transforms of `labgym.geometry.frames` for batches of torch tensors, differentiable."""

from __future__ import annotations

import torch
from torch import Tensor


def rotated(points: Tensor, angle: Tensor) -> Tensor:
    """Return points (b, n, 2) rotated about the origin by angles (b,), radians."""
    cosine, sine = angle.cos()[:, None], angle.sin()[:, None]
    x, y = points[..., 0], points[..., 1]
    return torch.stack([cosine * x - sine * y, sine * x + cosine * y], dim=2)


def to_world(points: Tensor, pose: Tensor) -> Tensor:
    """Transform points of local frames to the outer frame.

    Args:
        points: (b, n, 2) in the local frames.
        pose: (b, 3), (x, y, yaw) of each local frame in the outer frame.

    Returns:
        (b, n, 2) in the outer frame.
    """
    cosine, sine = pose[:, 2:].cos(), pose[:, 2:].sin()
    x, y = points[..., 0], points[..., 1]
    return torch.stack([pose[:, :1] + cosine * x - sine * y, pose[:, 1:2] + sine * x + cosine * y], dim=2)
