"""The boundary of a disc's free space: tangents of circles around rectangle corners, and the free arcs on them.

A disc of radius r avoids a rectangle if its center stays outside the rectangle dilated by r, whose boundary consists of
four straight edges and four quarter circles. A shortest path consists of straight segments that touch those quarter
circles, and of arcs along them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labgym.navigation.clearance import Obstacles
from labgym.navigation.plan import Extent

Array = NDArray[np.float64]
Index = NDArray[np.intp]

QUARTER = math.pi / 2.0
TOLERANCE = 1e-7
"""A path may be nearer than the radius by this much, metres: the rounding error of a path that touches."""


@dataclass(frozen=True)
class Corners:
    """Quarter circles of radius r around the corners of the rectangles.

    Attributes:
        centre: (k, 2). begin: (k,) angle at which the quarter begins, counter-clockwise. radius: meters.
    """

    centre: Array
    begin: Array
    radius: float

    @classmethod
    def of(cls, obstacles: Obstacles, radius: float) -> Corners:
        """Return the corners of all rectangles."""
        turns = np.array([2.0, 3.0, 0.0, 1.0]) * QUARTER
        begin = obstacles.boxes.yaw[:, None] + turns[None, :]
        return cls(obstacles.boxes.corners().reshape(-1, 2), begin.ravel(), radius)

    def on_quarter(self, index: Index, normal: Array) -> NDArray[np.bool_]:
        """Whether unit normals (m, 2) point into the quarter of the corners index (m,)."""
        middle = self.begin[index] + QUARTER / 2.0
        return normal[:, 0] * np.cos(middle) + normal[:, 1] * np.sin(middle) >= math.sqrt(0.5) - 1e-9

    def turned(self, index: Index, normal: Array) -> Array:
        """Return the angle of each unit normal from the beginning of its quarter, (m,) radians in [0, pi/2]."""
        angle = np.arctan2(normal[:, 1], normal[:, 0]) - self.begin[index]
        # The offset keeps a normal just before the beginning of the quarter from wrapping to its end.
        return np.clip((angle + 1.0) % (2.0 * math.pi) - 1.0, 0.0, QUARTER)

    def points(self, index: Index, normal: Array) -> Array:
        """Return the points on the circles at unit normals, (m, 2)."""
        return self.centre[index] + self.radius * normal


@dataclass(frozen=True)
class Contacts:
    """Points at which straight pieces touch quarter circles.

    Attributes:
        corner: (m,) corner index. normal: (m, 2) unit vector from the corner to the point.
    """

    corner: Index
    normal: Array

    def at(self, chosen: NDArray[np.bool_]) -> Contacts:
        """Return the selected contacts."""
        return Contacts(self.corner[chosen], self.normal[chosen])


class FreeSpace:
    """The positions of a disc's center: at least r from the walls and from every rectangle."""

    def __init__(self, room: Extent, obstacles: Obstacles, radius: float) -> None:
        self.obstacles, self.radius = obstacles, radius
        self.low = np.array([radius, radius])
        self.high = np.array([room.width - radius, room.depth - radius])

    def holds(self, points: Array) -> NDArray[np.bool_]:
        """Whether points (m, 2) are free."""
        return np.asarray(self.in_room(points) & (self.obstacles.nearest(points) >= self.radius - TOLERANCE))

    def joins(self, starts: Array, ends: Array) -> NDArray[np.bool_]:
        """Whether segments (m, 2)-(m, 2) are free along their whole length."""
        good: NDArray[np.bool_] = self.in_room(starts) & self.in_room(ends)
        inside = np.flatnonzero(good)
        near = self.obstacles.segment_distances(starts[inside], ends[inside]).min(axis=1, initial=np.inf)
        good[inside] = near >= self.radius - TOLERANCE
        return good

    def in_room(self, points: Array) -> NDArray[np.bool_]:
        """Whether the disc at points (m, 2) stays between the walls."""
        return np.asarray(((points >= self.low - TOLERANCE) & (points <= self.high + TOLERANCE)).all(axis=-1))


def bitangents(corners: Corners) -> tuple[Contacts, Contacts]:
    """Return the segments that touch two quarter circles, each as its two contacts.

    For unit u from circle i to circle j at distance d: the outer tangents touch both at the normals +-left(u), the
    inner ones, if d > 2r, touch i at n and j at -n with n.u = 2r/d.
    """
    i, j = np.triu_indices(len(corners.begin), 1)
    offset = corners.centre[j] - corners.centre[i]
    length = np.hypot(offset[:, 0], offset[:, 1])
    apart = length > 1e-9
    i, j, offset, length = i[apart], j[apart], offset[apart], length[apart]
    u = offset / length[:, None]
    left = np.column_stack([-u[:, 1], u[:, 0]])
    along = np.minimum(2.0 * corners.radius / length, 1.0)[:, None]
    across = np.sqrt(1.0 - along**2)
    inner = (length > 2.0 * corners.radius + 1e-9).nonzero()[0]
    pairs: list[tuple[Contacts, Contacts]] = []
    for side in (1.0, -1.0):
        pairs.append((Contacts(i, side * left), Contacts(j, side * left)))
        normal = (along * u + side * across * left)[inner]
        pairs.append((Contacts(i[inner], normal), Contacts(j[inner], -normal)))
    valid = [corners.on_quarter(a.corner, a.normal) & corners.on_quarter(b.corner, b.normal) for a, b in pairs]
    return (
        _stack([a.at(good) for (a, _), good in zip(pairs, valid, strict=True)]),
        _stack([b.at(good) for (_, b), good in zip(pairs, valid, strict=True)]),
    )


def tangents(corners: Corners, point: Array) -> Contacts:
    """Return the contacts of the tangents from a point (2,): normals n with n.(point - c) = r."""
    index = np.arange(len(corners.begin))
    offset = point - corners.centre
    length = np.hypot(offset[:, 0], offset[:, 1])
    outside = length >= corners.radius - TOLERANCE
    index, offset, length = index[outside], offset[outside], length[outside]
    u = offset / length[:, None]
    left = np.column_stack([-u[:, 1], u[:, 0]])
    along = np.minimum(corners.radius / length, 1.0)[:, None]
    across = np.sqrt(1.0 - along**2)
    both = _stack([Contacts(index, along * u + side * across * left) for side in (1.0, -1.0)])
    return both.at(corners.on_quarter(both.corner, both.normal))


def free_arcs(corners: Corners, space: FreeSpace) -> tuple[Index, Array]:
    """Return the maximal free arcs of the quarter circles.

    Each quarter is cut at its intersections with other circles, the lines of dilated edges, and walls; a piece is free
    if its middle is free.

    Returns:
        corner (a,), ascending, and the arcs (a, 2): begin and end along the quarter, radians, ascending.
    """
    count = len(corners.begin)
    if count == 0:
        return np.empty(0, dtype=np.intp), np.empty((0, 2))
    cuts = (_crossings(corners, space) - corners.begin[:, None]) % (2.0 * math.pi)
    cuts = np.sort(np.where(cuts < QUARTER, cuts, np.nan), axis=1)
    cuts = cuts[:, : int(np.isfinite(cuts).sum(axis=1).max(initial=0))]
    edges = np.column_stack([np.zeros(count), np.where(np.isnan(cuts), QUARTER, cuts), np.full(count, QUARTER)])
    angle = corners.begin[:, None] + (edges[:, :-1] + edges[:, 1:]) / 2.0
    middles = corners.centre[:, None, :] + corners.radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    wide = np.diff(edges, axis=1) > 1e-9
    free = np.zeros(wide.shape, dtype=bool)
    free[wide] = space.holds(middles[wide])
    return _merged(edges, wide, free)


def _merged(edges: Array, wide: NDArray[np.bool_], free: NDArray[np.bool_]) -> tuple[Index, Array]:
    corner: list[int] = []
    arcs: list[list[float]] = []
    for row in np.flatnonzero(free.any(axis=1)):
        last = False
        for piece in np.flatnonzero(wide[row]):
            if free[row, piece] and last:
                arcs[-1][1] = float(edges[row, piece + 1])
            elif free[row, piece]:
                corner.append(int(row))
                arcs.append([float(edges[row, piece]), float(edges[row, piece + 1])])
            last = bool(free[row, piece])
    return np.array(corner, dtype=np.intp), np.array(arcs).reshape(-1, 2)


def _crossings(corners: Corners, space: FreeSpace) -> Array:
    """Return the angles at which each circle crosses circles, lines of dilated edges and walls, (k, n) with NaN."""
    radius, boxes = corners.radius, space.obstacles.boxes
    offset = corners.centre[None, :, :] - corners.centre[:, None, :]
    length = np.hypot(offset[..., 0], offset[..., 1])
    with np.errstate(invalid="ignore", divide="ignore"):
        spread = np.arccos(np.where(length > 1e-9, length / (2.0 * radius), np.nan))
        towards = np.arctan2(offset[..., 1], offset[..., 0])
        angles = [towards + spread, towards - spread]
        local = np.einsum("knd,nad->kna", corners.centre[:, None, :] - boxes.centre, boxes.axes())
        for axis in range(2):
            for side in (1.0, -1.0):
                turn = np.arccos((side * (boxes.half[:, axis] + radius) - local[..., axis]) / radius)
                base = boxes.yaw + axis * QUARTER
                angles += [base + turn, base - turn]
            for wall in (space.low, space.high):
                turn = np.arccos((wall[axis] - corners.centre[:, axis]) / radius)[:, None]
                angles += [axis * QUARTER + turn, axis * QUARTER - turn]
    return np.concatenate(angles, axis=1)


def _stack(parts: list[Contacts]) -> Contacts:
    return Contacts(np.concatenate([part.corner for part in parts]), np.concatenate([part.normal for part in parts]))
