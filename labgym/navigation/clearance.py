"""Exact planar distances between points, segments and oriented rectangles, many at a time."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from labgym.geometry import Array, BoxArray, OrientedBox

Index = NDArray[np.intp]

CHUNK = 1_000_000
"""Number of pairs that are compared at a time; bounds the memory."""


class Obstacles:
    """The footprints from which a disc must keep its distance.

    Attributes:
        sources: the n boxes.
        boxes: their rectangles.
    """

    def __init__(self, boxes: Iterable[OrientedBox]) -> None:
        self.sources = tuple(boxes)
        self.boxes = BoxArray.of(self.sources)
        self._axes = self.boxes.axes()
        corners = self.boxes.corners()
        self._low, self._high = corners.min(axis=1), corners.max(axis=1)

    def __len__(self) -> int:
        return len(self.boxes)

    def point_distances(self, points: Array) -> Array:
        """Return the distance from points (m, 2) to each rectangle, (m, n) meters; 0 inside."""
        return _outside(self._local(points), self.boxes.half)

    def nearest(self, points: Array) -> Array:
        """Return the distance from points (m, 2) to the nearest rectangle, (m,) meters; inf without rectangles."""
        return np.asarray(self.point_distances(points).min(axis=1, initial=np.inf))

    def segment_distances(self, starts: Array, ends: Array) -> Array:
        """Return the distance from segments to each rectangle, (m, n) meters; 0 if they intersect.

        Args:
            starts: (m, 2) first points of the segments.
            ends: (m, 2) last points of the segments.
        """
        if len(self) == 0 or len(starts) == 0:
            return np.full((len(starts), len(self)), np.inf)
        return _segment_distance(self._local(starts), self._local(ends), self.boxes.half)

    def near(self, low: Array, high: Array) -> tuple[Index, Index]:
        """Return the pairs of an axis-aligned region and a rectangle whose bounds overlap.

        Args:
            low: (m, 2) least corners of the regions.
            high: (m, 2) greatest corners of the regions.

        Returns:
            region (p,), ascending, and rectangle (p,).
        """
        regions: list[Index] = [np.empty(0, dtype=np.intp)]
        boxes: list[Index] = [np.empty(0, dtype=np.intp)]
        step = max(1, CHUNK // max(1, len(self)))
        for first in range(0, len(low), step):
            a, b = low[first : first + step, None, :], high[first : first + step, None, :]
            overlap = a[..., 0] <= self._high[:, 0]
            for one, other in (
                (self._low[:, 0], b[..., 0]),
                (a[..., 1], self._high[:, 1]),
                (self._low[:, 1], b[..., 1]),
            ):
                overlap &= one <= other
            region, box = np.nonzero(overlap)
            regions.append(region + first)
            boxes.append(box)
        return np.concatenate(regions), np.concatenate(boxes)

    def paired_distances(self, points: Array, box: Index) -> Array:
        """Return the distance from point k of (m, 2) to the rectangle box[k], (m,) meters; 0 inside."""
        return _outside(self._paired_local(points, box), self.boxes.half[box])

    def segments_clear(self, starts: Array, ends: Array, radius: float) -> NDArray[np.bool_]:
        """Whether segments (m, 2)-(m, 2) are at least `radius` away from every rectangle, (m,).

        The same test as `segment_distances(starts, ends).min(axis=1) >= radius`, restricted to rectangles whose bounds
        the segment comes near.
        """
        clear = np.ones(len(starts), dtype=bool)
        if len(self) == 0:
            return clear
        segment, box = self.near(np.minimum(starts, ends) - radius, np.maximum(starts, ends) + radius)
        for first in range(0, len(segment), CHUNK // 4):
            row, column = segment[first : first + CHUNK // 4], box[first : first + CHUNK // 4]
            a, b = self._paired_local(starts[row], column), self._paired_local(ends[row], column)
            half = self.boxes.half[column]
            close = np.flatnonzero(_side_gap(a, b, half) < radius)
            distance = _segment_distance(a[close], b[close], half[close])
            clear[row[close[distance < radius]]] = False
        return clear

    def _paired_local(self, points: Array, box: Index) -> Array:
        """Express point k of (m, 2) in the frame of the rectangle box[k], (m, 2)."""
        offset, axes = points - self.boxes.centre[box], self._axes[box]
        return np.asarray((axes * offset[:, None, :]).sum(axis=-1))

    def _local(self, points: Array) -> Array:
        """Express points (m, 2) in each rectangle's frame, (m, n, 2)."""
        return np.asarray(np.einsum("mnd,nkd->mnk", points[:, None, :] - self.boxes.centre, self._axes))


def _segment_distance(a: Array, b: Array, half: Array) -> Array:
    """Return the distance from segments a-b (..., 2) to centered axis-aligned rectangles; 0 if they intersect."""
    least = np.minimum(_outside(a, half), _outside(b, half))
    direction = b - a
    squared = np.maximum((direction**2).sum(axis=-1), 1e-300)
    for sx, sy in ((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)):
        offset = half * (sx, sy) - a
        along = np.clip((offset * direction).sum(axis=-1) / squared, 0.0, 1.0)
        away = offset - along[..., None] * direction
        least = np.minimum(least, np.hypot(away[..., 0], away[..., 1]))
    return np.where(_crosses(a, direction, half), 0.0, least)


def _side_gap(a: Array, b: Array, half: Array) -> Array:
    """Return a lower bound of the distance from segments a-b (m, 2) to centered rectangles: the gap along a normal.

    The normals are those of the rectangle's sides and of the segment.
    """
    gap = (np.maximum(np.minimum(a, b), -np.maximum(a, b)) - half).max(axis=-1)
    dx, dy = (b - a).T
    length = np.maximum(np.hypot(dx, dy), 1e-300)
    across = np.abs(a[:, 0] * dy - a[:, 1] * dx) - half[:, 0] * np.abs(dy) - half[:, 1] * np.abs(dx)
    # Rounding may lift the bound above the distance by 1e-15 m.
    return np.asarray(np.maximum(gap, across / length) - 1e-12)


def _outside(local: Array, half: Array) -> Array:
    gap = np.maximum(np.abs(local) - half, 0.0)
    return np.asarray(np.hypot(gap[..., 0], gap[..., 1]))


def _crosses(start: Array, direction: Array, half: Array) -> NDArray[np.bool_]:
    """Whether segments intersect centered axis-aligned rectangles (slab method)."""
    steep = np.where(np.abs(direction) < 1e-300, 1e-300, direction)
    first, second = (-half - start) / steep, (half - start) / steep
    enter = np.minimum(first, second).max(axis=-1)
    leave = np.maximum(first, second).min(axis=-1)
    return np.asarray(np.maximum(enter, 0.0) <= np.minimum(leave, 1.0))
