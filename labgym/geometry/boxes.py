"""Upright boxes: oriented rectangles times a z interval, and exact overlaps and distances between them.

Every box is a vertical prism, so the separating-axis test needs only the four side normals and z, and the
3D distance is the hypotenuse of the planar distance and the z gap.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from labgym.geometry.frames import rotate

Array = NDArray[np.float64]
Rows = NDArray[np.intp]

ROUNDING = 1e-6
"""Bounds are compared with this margin where exact penetrations decide, meters."""


@dataclass(frozen=True)
class OrientedBox:
    """An upright box.

    Attributes:
        x, y: center in the plane, meters.
        width, depth: full extents along the box's own x and y, meters.
        yaw: rotation about +Z, radians.
        z0, z1: bottom and top, meters.
    """

    x: float
    y: float
    width: float
    depth: float
    yaw: float = 0.0
    z0: float = 0.0
    z1: float = 1.0

    @property
    def front(self) -> tuple[float, float]:
        """Unit vector that the box faces: +y at yaw 0."""
        return -math.sin(self.yaw), math.cos(self.yaw)

    def corners(self) -> Array:
        """Return the footprint's corners, shape (4, 2), counter-clockwise, the first at local (-, -)."""
        hx, hy = self.width / 2.0, self.depth / 2.0
        local = ((-hx, -hy), (hx, -hy), (hx, hy), (-hx, hy))
        turned = [rotate(px, py, self.yaw) for px, py in local]
        return np.array([(self.x + px, self.y + py) for px, py in turned])

    def bounds(self) -> tuple[float, float, float, float]:
        """Return the axis-aligned bounds (x_min, y_min, x_max, y_max) of the footprint."""
        cosine, sine = abs(math.cos(self.yaw)), abs(math.sin(self.yaw))
        ex = (self.width * cosine + self.depth * sine) / 2.0
        ey = (self.width * sine + self.depth * cosine) / 2.0
        return self.x - ex, self.y - ey, self.x + ex, self.y + ey

    def to_local(self, x: float, y: float) -> tuple[float, float]:
        """Express a world point in the box's frame, origin at its center."""
        return rotate(x - self.x, y - self.y, -self.yaw)

    def to_world(self, x: float, y: float) -> tuple[float, float]:
        """Express a point of the box's frame in the world."""
        px, py = rotate(x, y, self.yaw)
        return self.x + px, self.y + py


@dataclass(frozen=True)
class BoxArray:
    """n upright boxes as arrays, for pairwise measures.

    Attributes:
        centre: (n, 2). half: (n, 2). yaw: (n,). z: (n, 2), bottom and top.
    """

    centre: Array
    half: Array
    yaw: Array
    z: Array

    @classmethod
    def of(cls, boxes: Sequence[OrientedBox]) -> BoxArray:
        """Stack boxes."""
        rows = np.array(
            [(b.x, b.y, b.width / 2.0, b.depth / 2.0, b.yaw, b.z0, b.z1) for b in boxes], dtype=np.float64
        ).reshape(-1, 7)
        return cls(rows[:, 0:2], rows[:, 2:4], rows[:, 4], rows[:, 5:7])

    def __len__(self) -> int:
        return len(self.yaw)

    def merged(
        self, rows: Sequence[int] | Rows, own: Sequence[int] | Rows, others: BoxArray, other_rows: Sequence[int]
    ) -> BoxArray:
        """Return boxes of which some rows are rows of this array, and all others those of another array.

        Args:
            rows: rows of the result that are the rows `own` of this array.
            other_rows: rows of the result that are the rows of `others`, in order.
        """

        def joined(first: Array, second: Array) -> Array:
            values = np.empty((len(rows) + len(other_rows), *first.shape[1:]))
            values[rows], values[other_rows] = first[own], second
            return values

        return BoxArray(
            joined(self.centre, others.centre),
            joined(self.half, others.half),
            joined(self.yaw, others.yaw),
            joined(self.z, others.z),
        )

    def joined(self, others: BoxArray) -> BoxArray:
        """Return these boxes and then others."""
        return BoxArray(*(np.concatenate(pair) for pair in zip(self._arrays, others._arrays, strict=True)))

    def without(self, others: BoxArray) -> BoxArray:
        """Return the boxes that are equal to none of others."""
        rows, unwanted = (np.column_stack(boxes._arrays) for boxes in (self, others))
        equal = (rows[:, None] == unwanted[None]).all(axis=-1).any(axis=1)
        return self.take(np.flatnonzero(~equal))

    @property
    def _arrays(self) -> tuple[Array, Array, Array, Array]:
        return self.centre, self.half, self.yaw, self.z

    def axes(self) -> Array:
        """Return the side normals, shape (n, 2, 2): [i, k] is box i's axis k."""
        cosine, sine = np.cos(self.yaw), np.sin(self.yaw)
        return np.stack([np.stack([cosine, sine], -1), np.stack([-sine, cosine], -1)], axis=1)

    def take(self, rows: Sequence[int] | NDArray[np.intp]) -> BoxArray:
        """Return some of the boxes."""
        return BoxArray(self.centre[rows], self.half[rows], self.yaw[rows], self.z[rows])

    def bounds(self) -> tuple[Array, Array]:
        """Return the least and greatest coordinates of each box, (n, 3) each."""
        return self._bounds

    @cached_property
    def _bounds(self) -> tuple[Array, Array]:
        cosine, sine = np.abs(np.cos(self.yaw)), np.abs(np.sin(self.yaw))
        width, depth = self.half[:, 0], self.half[:, 1]
        extent = np.stack([width * cosine + depth * sine, width * sine + depth * cosine], axis=1)
        low, high = self.centre - extent, self.centre + extent
        return np.column_stack([low, self.z[:, 0]]), np.column_stack([high, self.z[:, 1]])

    def corners(self) -> Array:
        """Return the footprints' corners, shape (n, 4, 2)."""
        signs = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
        local = signs[None, :, :] * self.half[:, None, :]
        turned: Array = np.einsum("nck,nkd->ncd", local, self.axes())
        return self.centre[:, None, :] + turned


def pairwise_penetration(a: BoxArray, b: BoxArray) -> Array:
    """Return the least overlap over all separating axes, shape (n, m): positive if the boxes interpenetrate."""
    return _penetration(*_crossed(a, b))


def interpenetrating(a: BoxArray, b: BoxArray, depth: float = 0.0) -> tuple[Rows, Rows, Array]:
    """Return the pairs that interpenetrate by more than a depth >= 0, by row of a and then of b.

    Only boxes whose bounds overlap are compared. The penetration of a box within another can exceed its thickness.

    Returns:
        Rows of a, rows of b, and their penetration as in `pairwise_penetration`, each (pairs,).
    """
    first, second = overlapping_bounds(a.bounds(), b.bounds(), -ROUNDING)
    depths = _penetration(a.take(first), b.take(second))
    deep = depths > depth
    return first[deep], second[deep], depths[deep]


def overlapping_bounds(a: tuple[Array, Array], b: tuple[Array, Array], depth: float) -> tuple[Rows, Rows]:
    """Return the rows of all pairs of axis-aligned bounds that overlap by more than a depth, by row of a and then of b.

    A sweep along x: each interval of a is compared only with those of b that overlap it.

    Args:
        a, b: least and greatest coordinates of n and of m boxes, (n, 3) and (m, 3) each, meters.
        depth: least overlap along every axis, meters; may be negative.
    """
    (low_a, high_a), (low_b, high_b) = a, b
    order = np.argsort(low_b[:, 0], kind="stable")
    starts = low_b[order, 0]
    longest = float((high_b[:, 0] - low_b[:, 0]).max(initial=0.0))
    begin = np.searchsorted(starts, low_a[:, 0] + depth - longest - ROUNDING, side="left")
    end = np.searchsorted(starts, high_a[:, 0] - depth + ROUNDING, side="right")
    counts = np.maximum(end - begin, 0)
    first = np.repeat(np.arange(len(low_a)), counts)
    second = order[np.arange(len(first)) + np.repeat(begin - np.cumsum(counts) + counts, counts)]
    for axis in range(3):
        overlap = np.minimum(high_a[first, axis], high_b[second, axis])
        overlap -= np.maximum(low_a[first, axis], low_b[second, axis])
        first, second = first[overlap > depth], second[overlap > depth]
    sequence = np.lexsort((second, first))
    return first[sequence], second[sequence]


def pairwise_distance(a: BoxArray, b: BoxArray) -> Array:
    """Return surface-to-surface 3D distances in meters, shape (n, m); 0 if the boxes touch or overlap."""
    planar = np.minimum(_corner_distance(a, b), _corner_distance(b, a).T)
    planar = np.where(_planar_penetration(*_crossed(a, b)) > 0.0, 0.0, planar)
    gap = np.maximum(a.z[:, None, 0], b.z[None, :, 0]) - np.minimum(a.z[:, None, 1], b.z[None, :, 1])
    separation: Array = np.hypot(planar, np.maximum(gap, 0.0))
    return separation


def penetration(a: OrientedBox, b: OrientedBox) -> float:
    """Return the least overlap of two boxes over all separating axes, meters; negative if they are apart."""
    return float(pairwise_penetration(BoxArray.of([a]), BoxArray.of([b]))[0, 0])


def distance(a: OrientedBox, b: OrientedBox) -> float:
    """Return the surface-to-surface 3D distance of two boxes, meters."""
    return float(pairwise_distance(BoxArray.of([a]), BoxArray.of([b]))[0, 0])


def _crossed(a: BoxArray, b: BoxArray) -> tuple[BoxArray, BoxArray]:
    """Return boxes in arrays that broadcast to all pairs (n, m)."""
    columns = BoxArray(a.centre[:, None], a.half[:, None], a.yaw[:, None], a.z[:, None])
    return columns, BoxArray(b.centre[None], b.half[None], b.yaw[None], b.z[None])


def _penetration(a: BoxArray, b: BoxArray) -> Array:
    """Least overlap over all separating axes of boxes in arrays that broadcast."""
    along_z = np.minimum(a.z[..., 1], b.z[..., 1]) - np.maximum(a.z[..., 0], b.z[..., 0])
    least: Array = np.minimum(along_z, _planar_penetration(a, b))
    return least


def _planar_penetration(a: BoxArray, b: BoxArray) -> Array:
    """Least overlap of footprints over the four side normals, of boxes in arrays that broadcast."""
    dx, dy = b.centre[..., 0] - a.centre[..., 0], b.centre[..., 1] - a.centre[..., 1]
    turn = b.yaw - a.yaw
    cosine, sine = np.abs(np.cos(turn)), np.abs(np.sin(turn))
    own = _frame_penetration(dx, dy, a.yaw, a.half, b.half, cosine, sine)
    other = _frame_penetration(dx, dy, b.yaw, b.half, a.half, cosine, sine)
    return np.minimum(own, other)


def _frame_penetration(dx: Array, dy: Array, yaw: Array, own: Array, other: Array, cosine: Array, sine: Array) -> Array:
    """Least overlap over one box's two normals; cosine and sine are those of the angle between the boxes."""
    c, s = np.cos(yaw), np.sin(yaw)
    along_x = own[..., 0] + other[..., 0] * cosine + other[..., 1] * sine - np.abs(c * dx + s * dy)
    along_y = own[..., 1] + other[..., 0] * sine + other[..., 1] * cosine - np.abs(c * dy - s * dx)
    return np.minimum(along_x, along_y)


def _corner_distance(a: BoxArray, b: BoxArray) -> Array:
    """Least planar distance from a's corners to b's rectangles, shape (n, m)."""
    offset = a.corners()[:, None, :, :] - b.centre[None, :, None, :]
    local = np.abs(np.einsum("nmcd,mkd->nmck", offset, b.axes()))
    outside = np.maximum(local - b.half[None, :, None, :], 0.0)
    least: Array = np.linalg.norm(outside, axis=-1).min(axis=-1)
    return least
