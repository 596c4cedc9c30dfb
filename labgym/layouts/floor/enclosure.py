"""Checks that walls enclose the spaces of a floor."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from labgym.geometry import BoxArray, OrientedBox
from labgym.layouts.floor.spaces import CONTACT, Space

REACH = 1.0
"""A wall belongs to the edge of a space if it is at most this far outside, meters: a region of rectangles leaves wedges
along an oblique wall."""
GAP = 0.10
"""Longest part of an edge without a wall, meters: the ends of the steps of a region along an oblique wall have none."""
THIN = 0.015
"""Two spaces that are nearer than this have no wall between them, meters."""

Array = NDArray[np.float64]


def check_enclosed(spaces: Sequence[Space], walls: Sequence[OrientedBox]) -> None:
    """Check that a wall lies outside every edge of every space, and between any two spaces.

    Raises:
        ValueError: names the space and the place of the gap.
    """
    wall_corners = BoxArray.of(walls).corners()
    regions = [BoxArray.of(space.boxes).corners() for space in spaces]
    for index, (space, region) in enumerate(zip(spaces, regions, strict=True)):
        start, end = region.reshape(-1, 2), np.roll(region, -1, axis=1).reshape(-1, 2)
        own = _spans(region, start, end, 2.0 * CONTACT)
        covered = np.concatenate([own, _spans(wall_corners, start, end, REACH)], axis=1)
        others = [other for k, other in enumerate(regions) if k != index]
        if others:
            touching = _spans(np.concatenate(others), start, end, THIN)
            _refuse(space, start, end, touching.reshape(len(start), -1, 2), "touches another space", SEPARATE)
        gaps = _gaps(covered, np.linalg.norm(end - start, axis=1))
        _refuse(space, start, end, gaps, f"has no wall within {REACH:g} m", "add a wall or move the edge of the region")


SEPARATE = "put a wall with a passage between them"


def _refuse(space: Space, start: Array, end: Array, spans: Array, problem: str, remedy: str) -> None:
    """Refuse the first edge, of which an interval (e, k, 2) of more than `GAP` has a problem."""
    lengths = np.linalg.norm(end - start, axis=1)
    low, high = np.maximum(spans[..., 0], 0.0), np.minimum(spans[..., 1], lengths[:, None])
    for edge, k in np.argwhere(high - low > GAP)[:1].tolist():
        middle = (low[edge, k] + high[edge, k]) / 2.0 / lengths[edge]
        x, y = (start[edge] + middle * (end[edge] - start[edge])).tolist()
        length = high[edge, k] - low[edge, k]
        raise ValueError(
            f"space {space.id!r} {problem} along {length:.2f} m of its edge near ({x:.2f}, {y:.2f}): {remedy}"
        )


def _spans(polygons: Array, start: Array, end: Array, reach: float) -> Array:
    """Return the intervals of edges before which convex polygons lie, between 1 mm and `reach` outside.

    Args:
        polygons: (n, 4, 2), counter-clockwise.
        start, end: (e, 2), edges of counter-clockwise polygons, whose outside is on the right.

    Returns:
        (e, n, 2): meters from the start of the edge; inf and -inf for a polygon that lies elsewhere.
    """
    along = (end - start) / np.linalg.norm(end - start, axis=1, keepdims=True)
    outward = np.column_stack([along[:, 1], -along[:, 0]])
    offset = polygons[None] - start[:, None, None]
    x, y = np.einsum("enkd,ed->enk", offset, along), np.einsum("enkd,ed->enk", offset, outward)
    next_x, next_y = np.roll(x, -1, axis=2), np.roll(y, -1, axis=2)
    candidates, valid = [x], [(y >= CONTACT) & (y <= reach)]
    for level in (CONTACT, reach):
        crosses = (y - level) * (next_y - level) < 0.0
        step = np.where(crosses, next_y - y, 1.0)
        candidates.append(x + (level - y) / step * (next_x - x))
        valid.append(crosses)
    at, possible = np.concatenate(candidates, axis=2), np.concatenate(valid, axis=2)
    low, high = np.where(possible, at, np.inf).min(axis=2), np.where(possible, at, -np.inf).max(axis=2)
    return np.stack([low, high], axis=2)


def _gaps(spans: Array, lengths: Array) -> Array:
    """Return the intervals of edges of lengths (e,) that intervals (e, n, 2) leave out, shape (e, n + 1, 2)."""
    low = np.clip(spans[..., 0], 0.0, lengths[:, None])
    order = np.argsort(low, axis=1)
    low = np.take_along_axis(low, order, axis=1)
    high = np.take_along_axis(np.maximum(spans[..., 1], 0.0), order, axis=1)
    edge = np.zeros((len(lengths), 1))
    covered = np.concatenate([edge, np.maximum.accumulate(high, axis=1)], axis=1)
    return np.stack([covered, np.concatenate([low, lengths[:, None]], axis=1)], axis=2)
