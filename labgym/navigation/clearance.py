"""Exact planar distances between points, segments and oriented rectangles, many at a time."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from labgym.geometry import BoxArray, OrientedBox

Array = NDArray[np.float64]


class Obstacles:
    """The footprints from which a disc must keep its distance.

    Attributes:
        boxes: the n rectangles.
    """

    def __init__(self, boxes: Iterable[OrientedBox]) -> None:
        self.boxes = BoxArray.of(list(boxes))
        self._axes = self.boxes.axes()

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
        a, b = self._local(starts), self._local(ends)
        half = self.boxes.half
        least = np.minimum(_outside(a, half), _outside(b, half))
        direction = b - a
        squared = np.maximum((direction**2).sum(axis=-1), 1e-300)
        for sx, sy in ((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)):
            offset = half * (sx, sy) - a
            along = np.clip((offset * direction).sum(axis=-1) / squared, 0.0, 1.0)
            away = offset - along[..., None] * direction
            least = np.minimum(least, np.hypot(away[..., 0], away[..., 1]))
        return np.where(_crosses(a, direction, half), 0.0, least)

    def _local(self, points: Array) -> Array:
        """Express points (m, 2) in each rectangle's frame, (m, n, 2)."""
        return np.asarray(np.einsum("mnd,nkd->mnk", points[:, None, :] - self.boxes.centre, self._axes))


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
