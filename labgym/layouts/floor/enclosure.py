"""Checks that walls enclose the spaces of a floor."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from labgym.geometry import BoxArray, OrientedBox, to_local, to_world
from labgym.geometry.frames import PlanarPose
from labgym.layouts.floor.spaces import CONTACT, Rectangle, Space

REACH = 1.0
"""A wall belongs to the edge of a space if it is at most this far outside, meters: a region of rectangles leaves wedges
along an oblique wall."""
GAP = 0.10
"""Longest part of an edge without a wall, meters: the ends of the steps of a region along an oblique wall have none."""
THIN = 0.015
"""Two spaces that are nearer than this have no wall between them, meters."""

Array = NDArray[np.float64]
Span = tuple[float, float]


def check_enclosed(spaces: Sequence[Space], walls: Sequence[OrientedBox]) -> None:
    """Check that a wall lies outside every edge of every space, and between any two spaces.

    Raises:
        ValueError: names the space and the place of the gap.
    """
    corners = BoxArray.of(walls).corners()
    for space in spaces:
        other = [box for one in spaces if one is not space for box in one.boxes]
        others = BoxArray.of(other).corners()
        for edge, length, own in _edges(space):
            covered = [*own, *_spans(corners, edge, REACH)]
            bare = [span for span in _gaps(covered, length) if span[1] - span[0] > GAP]
            joined = [span for span in _spans(others, edge, THIN) if _free(span, own, length) > GAP]
            for spans, problem, remedy in (
                (joined, "touches another space", "put a wall with a passage between them"),
                (bare, f"has no wall within {REACH:g} m", "add a wall or move the edge of the region"),
            ):
                if spans:
                    start, end = spans[0]
                    x, y = to_world([((start + end) / 2.0, 0.0)], edge)[0].tolist()
                    raise ValueError(
                        f"space {space.id!r} {problem} along {end - start:.2f} m of its edge near ({x:.2f}, {y:.2f}): "
                        f"{remedy}"
                    )


def _edges(space: Space) -> Iterator[tuple[PlanarPose, float, list[Span]]]:
    """Yield the sides of a region: a frame at its start, x along it and y outwards, its length, and inner parts."""
    for r in space.region:
        others = [other for other in space.region if other is not r]
        for corner, length, turn in (
            ((r.x1, r.y0), r.x1 - r.x0, 2),
            ((r.x1, r.y1), r.y1 - r.y0, 3),
            ((r.x0, r.y1), r.x1 - r.x0, 0),
            ((r.x0, r.y0), r.y1 - r.y0, 1),
        ):
            local = (*corner, turn * np.pi / 2.0)
            inner = list(_spans(_corners(others), local, 2.0 * CONTACT)) if others else []
            x, y = to_world([corner], space.frame)[0].tolist()
            yield (x, y, space.yaw + local[2]), length, inner


def _corners(rectangles: Iterable[Rectangle]) -> Array:
    """Return the corners of rectangles, shape (n, 4, 2)."""
    return np.array([((r.x0, r.y0), (r.x1, r.y0), (r.x1, r.y1), (r.x0, r.y1)) for r in rectangles])


def _spans(polygons: Array, edge: PlanarPose, reach: float) -> Iterator[Span]:
    """Yield the intervals of x for which convex polygons (n, 4, 2) lie between y = 1 mm and y = `reach` of a frame."""
    if not len(polygons):
        return
    local = to_local(polygons.reshape(-1, 2), edge).reshape(polygons.shape)
    x, y = local[..., 0], local[..., 1]
    following = np.roll(x, -1, axis=1), np.roll(y, -1, axis=1)
    candidates, valid = [x], [(y >= CONTACT) & (y <= reach)]
    for level in (CONTACT, reach):
        crosses = (y - level) * (following[1] - level) < 0.0
        step = np.where(crosses, following[1] - y, 1.0)
        candidates.append(x + (level - y) / step * (following[0] - x))
        valid.append(crosses)
    at, possible = np.concatenate(candidates, axis=1), np.concatenate(valid, axis=1)
    low, high = np.where(possible, at, np.inf).min(axis=1), np.where(possible, at, -np.inf).max(axis=1)
    for start, end in zip(low.tolist(), high.tolist(), strict=True):
        if end > start:
            yield start, end


def _gaps(spans: Iterable[Span], length: float) -> Iterator[Span]:
    """Yield the parts of [0, length] that a union of intervals leaves out."""
    reached = 0.0
    for start, end in sorted(spans):
        if start > reached:
            yield reached, min(start, length)
        reached = max(reached, end)
        if reached >= length:
            return
    yield reached, length


def _free(span: Span, spans: Sequence[Span], length: float) -> float:
    """Return how much of an interval and of [0, length] no other interval covers."""
    start, end = max(span[0], 0.0), min(span[1], length)
    return sum(max(min(high, end) - max(low, start), 0.0) for low, high in _gaps(spans, length))
