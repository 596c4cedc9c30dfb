"""The cubic path through the robot and the key points; it is linear in them, so a constant matrix computes it."""

from __future__ import annotations

import torch
from torch import Tensor


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
