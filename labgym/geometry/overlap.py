"""How deep and how much upright boxes overlap, pair by pair: the narrow phase after a broad one."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from labgym.geometry.boxes import BoxArray, OrientedBox

Array = NDArray[np.float64]


def paired_penetration(a: BoxArray, b: BoxArray) -> Array:
    """Return the least overlap of box a[k] with box b[k] over all separating axes, shape (n,).

    Positive where they interpenetrate. Same measure as `pairwise_penetration`, for chosen pairs only.
    """
    least = np.minimum(a.z[:, 1], b.z[:, 1]) - np.maximum(a.z[:, 0], b.z[:, 0])
    offset = b.centre - a.centre
    turn = b.yaw - a.yaw
    cosine, sine = np.abs(np.cos(turn)), np.abs(np.sin(turn))
    cross = np.stack([np.stack([cosine, sine], -1), np.stack([sine, cosine], -1)], axis=1)  # |axis_a[k] . axis_b[l]|
    reach_on_a = a.half + np.einsum("nkl,nl->nk", cross, b.half)
    reach_on_b = b.half + np.einsum("nkl,nk->nl", cross, a.half)
    gap_on_a = np.abs(np.einsum("nd,nkd->nk", offset, a.axes()))
    gap_on_b = np.abs(np.einsum("nd,nkd->nk", offset, b.axes()))
    planar = np.minimum((reach_on_a - gap_on_a).min(axis=1), (reach_on_b - gap_on_b).min(axis=1))
    return np.asarray(np.minimum(least, planar))


def overlap_volume(a: OrientedBox, b: OrientedBox) -> float:
    """Return the exact volume that two upright boxes share, cubic metres."""
    height = min(a.z1, b.z1) - max(a.z0, b.z0)
    if height <= 0.0:
        return 0.0
    half_width, half_depth = b.width / 2.0, b.depth / 2.0
    polygon = [b.to_local(float(x), float(y)) for x, y in a.corners()]
    for axis, limit in ((0, half_width), (1, half_depth)):
        for sign in (1.0, -1.0):
            polygon = _clip(polygon, axis, sign, limit)
    return _area(polygon) * height


def _clip(polygon: list[tuple[float, float]], axis: int, sign: float, limit: float) -> list[tuple[float, float]]:
    """Keep the part of a convex polygon where sign * coordinate <= limit."""
    kept: list[tuple[float, float]] = []
    for start, end in zip(polygon, polygon[1:] + polygon[:1], strict=True):
        inside_start, inside_end = limit - sign * start[axis], limit - sign * end[axis]
        if inside_start >= 0.0:
            kept.append(start)
        if (inside_start >= 0.0) != (inside_end >= 0.0):
            part = inside_start / (inside_start - inside_end)
            kept.append((start[0] + part * (end[0] - start[0]), start[1] + part * (end[1] - start[1])))
    return kept


def _area(polygon: list[tuple[float, float]]) -> float:
    turned = zip(polygon, polygon[1:] + polygon[:1], strict=True)
    return abs(sum(x0 * y1 - x1 * y0 for (x0, y0), (x1, y1) in turned)) / 2.0
