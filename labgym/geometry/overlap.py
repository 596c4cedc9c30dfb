"""Penetration depth, inset and shared volume of pairs of upright boxes, and the push that separates them."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from labgym.geometry.boxes import BoxArray, OrientedBox, pairwise_penetration

Array = NDArray[np.float64]


def paired_penetration(a: BoxArray, b: BoxArray) -> Array:
    """Return the least overlap of box a[k] with box b[k] over all separating axes, shape (n,).

    Positive if they interpenetrate. The measure of `pairwise_penetration`, for selected pairs only.
    """
    least = np.minimum(a.z[:, 1], b.z[:, 1]) - np.maximum(a.z[:, 0], b.z[:, 0])
    on_a = _extent_along(b.half, b.yaw - a.yaw) + a.half - np.abs(_turned_back(b.centre - a.centre, a.yaw))
    on_b = _extent_along(a.half, a.yaw - b.yaw) + b.half - np.abs(_turned_back(b.centre - a.centre, b.yaw))
    return np.asarray(np.minimum(least, np.minimum(on_a, on_b).min(axis=1)))


def paired_inset(inner: BoxArray, outer: BoxArray) -> Array:
    """Return the inset of footprint inner[k] in footprint outer[k], shape (n,).

    It is the least distance from the corners of inner to the sides of outer, negative if inner extends beyond outer; z
    is ignored.
    """
    local = np.abs(_turned_back(inner.centre - outer.centre, outer.yaw))
    return np.asarray((outer.half - local - _extent_along(inner.half, inner.yaw - outer.yaw)).min(axis=1))


def overlap_volume(a: OrientedBox, b: OrientedBox) -> float:
    """Return the exact volume that two upright boxes share, cubic meters."""
    height = min(a.z1, b.z1) - max(a.z0, b.z0)
    if height <= 0.0:
        return 0.0
    half_width, half_depth = b.width / 2.0, b.depth / 2.0
    polygon = [b.to_local(float(x), float(y)) for x, y in a.corners()]
    for axis, limit in ((0, half_width), (1, half_depth)):
        for sign in (1.0, -1.0):
            polygon = _clip(polygon, axis, sign, limit)
    return _area(polygon) * height


def separating_push(mover: OrientedBox, other: OrientedBox, margin: float = 0.0) -> tuple[float, float] | None:
    """Return the shortest planar translation of `mover` out of `other`, meters; None if they are apart.

    Args:
        margin: added to its length, meters.
    """
    a, b = BoxArray.of([mover]), BoxArray.of([other])
    if pairwise_penetration(a, b)[0, 0] <= 0.0:
        return None
    offset = np.array([mover.x - other.x, mover.y - other.y])
    best: tuple[float, float, float] | None = None
    for normal in np.concatenate([a.axes()[0], b.axes()[0]]):
        reach = sum(float(np.abs(box.axes()[0] @ normal) @ box.half[0]) for box in (a, b))
        along = float(offset @ normal)
        depth = reach - abs(along) + margin
        sign = math.copysign(1.0, along)
        if best is None or depth < best[0] - 1e-9:
            best = (depth, sign * depth * float(normal[0]), sign * depth * float(normal[1]))
    return (best[1], best[2]) if best is not None else None


def _clip(polygon: list[tuple[float, float]], axis: int, sign: float, limit: float) -> list[tuple[float, float]]:
    """Keep the part of a convex polygon where sign * coordinate <= limit."""
    clipped: list[tuple[float, float]] = []
    for start, end in zip(polygon, polygon[1:] + polygon[:1], strict=True):
        inside_start, inside_end = limit - sign * start[axis], limit - sign * end[axis]
        if inside_start >= 0.0:
            clipped.append(start)
        if (inside_start >= 0.0) != (inside_end >= 0.0):
            part = inside_start / (inside_start - inside_end)
            clipped.append((start[0] + part * (end[0] - start[0]), start[1] + part * (end[1] - start[1])))
    return clipped


def _area(polygon: list[tuple[float, float]]) -> float:
    edges = zip(polygon, polygon[1:] + polygon[:1], strict=True)
    return abs(sum(x0 * y1 - x1 * y0 for (x0, y0), (x1, y1) in edges)) / 2.0


def _turned_back(vectors: Array, yaw: Array) -> Array:
    """Express vectors (n, 2) in frames turned by yaw (n,)."""
    cosine, sine = np.cos(yaw), np.sin(yaw)
    x, y = vectors[:, 0], vectors[:, 1]
    return np.column_stack([cosine * x + sine * y, cosine * y - sine * x])


def _extent_along(half: Array, turn: Array) -> Array:
    """Return the half extents (n, 2), along the axes of a frame, of rectangles rotated in it by `turn` (n,)."""
    cosine, sine = np.abs(np.cos(turn)), np.abs(np.sin(turn))
    return np.column_stack([half[:, 0] * cosine + half[:, 1] * sine, half[:, 0] * sine + half[:, 1] * cosine])
