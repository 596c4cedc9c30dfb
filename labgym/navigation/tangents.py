"""Tangents of the quarter circles around the corners of rectangles.

A disc of radius r avoids a rectangle if its center stays outside the rectangle dilated by r, whose boundary consists of
four straight edges and four quarter circles. A shortest path consists of straight segments that touch those quarter
circles, and of arcs along them.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labgym.navigation.clearance import Index, Obstacles

Array = NDArray[np.float64]

QUARTER = math.pi / 2.0
PAIRS = 100_000
"""Number of pairs of corners whose tangents are computed at a time; bounds the memory."""


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

    def at(self, chosen: Index) -> Corners:
        """Return the selected corners."""
        return Corners(self.centre[chosen], self.begin[chosen], self.radius)

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

    def at_turn(self, index: Index, turn: Array) -> Array:
        """Return the points at angles (m,) from the beginning of the quarters index (m,), (m, 2)."""
        angle = self.begin[index] + turn
        return self.centre[index] + self.radius * np.column_stack([np.cos(angle), np.sin(angle)])


@dataclass(frozen=True)
class Contacts:
    """Points at which straight pieces touch quarter circles.

    Attributes:
        corner: (m,) corner index. normal: (m, 2) unit vector from the corner to the point.
    """

    corner: Index
    normal: Array

    def at(self, chosen: NDArray[np.bool_] | Index) -> Contacts:
        """Return the selected contacts."""
        return Contacts(self.corner[chosen], self.normal[chosen])


def bitangents(corners: Corners, sectors: Array) -> Iterator[tuple[Contacts, Contacts]]:
    """Yield the segments that touch two quarter circles, each as its two contacts.

    For unit u from circle i to circle j at distance d: the outer tangents touch both at the normals +-left(u), the
    inner ones, if d > 2r, touch i at n and j at -n with n.u = 2r/d.

    Args:
        corners: k corners.
        sectors: (k, 2) part of each quarter in which contacts are of use: begin and end along the quarter, radians.
    """
    middle = corners.begin + sectors.mean(axis=1)
    mx, my = np.cos(middle), np.sin(middle)
    least = np.cos((sectors[:, 1] - sectors[:, 0]) / 2.0 + 2e-6)
    cx, cy = corners.centre.T
    count = len(corners.begin)
    step = max(1, PAIRS // max(1, count))
    for first in range(0, count, step):
        i, j = np.s_[first : first + step, None], np.s_[None, first + 1 :]
        dx, dy = cx[j] - cx[i], cy[j] - cy[i]
        length = np.hypot(dx, dy)
        ahead = np.arange(first + 1, count)[None, :] > np.arange(first, min(first + step, count))[:, None]
        ahead &= length > 1e-9
        with np.errstate(invalid="ignore", divide="ignore"):
            ux, uy = dx / length, dy / length
            along = 2.0 * corners.radius / length
            across = np.sqrt(np.maximum(1.0 - along**2, 0.0))
        crossing = ahead & (length > 2.0 * corners.radius + 1e-9)
        # Components of each sector's middle to the left of u, and inner tangents' share of its component along u.
        left_i, left_j = ux * my[i] - uy * mx[i], ux * my[j] - uy * mx[j]
        on_i, on_j = along * (ux * mx[i] + uy * my[i]), along * (ux * mx[j] + uy * my[j])
        left_i_across, left_j_across = across * left_i, across * left_j
        for side in (1.0, -1.0):
            outer = ahead & (side * left_i >= least[i]) & (side * left_j >= least[j])
            yield from _contacts(corners, first, outer, side, inner=False)
            inner = (on_i + side * left_i_across >= least[i]) & (on_j + side * left_j_across <= -least[j])
            yield from _contacts(corners, first, crossing & inner, side, inner=True)


def _contacts(
    corners: Corners, first: int, chosen: NDArray[np.bool_], side: float, inner: bool
) -> Iterator[tuple[Contacts, Contacts]]:
    """Yield the contacts of the tangents of chosen pairs, [row, column] for corners first + row, first + 1 + column."""
    row, column = np.nonzero(chosen)
    if len(row) == 0:
        return
    i, j = row + first, column + first + 1
    offset = corners.centre[j] - corners.centre[i]
    length = np.hypot(offset[:, 0], offset[:, 1])
    u = offset / length[:, None]
    left = np.column_stack([-u[:, 1], u[:, 0]])
    if inner:
        along = np.minimum(2.0 * corners.radius / length, 1.0)[:, None]
        normal = along * u + side * np.sqrt(1.0 - along**2) * left
        a, b = Contacts(i, normal), Contacts(j, -normal)
    else:
        a, b = Contacts(i, side * left), Contacts(j, side * left)
    valid = corners.on_quarter(a.corner, a.normal) & corners.on_quarter(b.corner, b.normal)
    yield a.at(valid), b.at(valid)


def tangents(corners: Corners, point: Array) -> Contacts:
    """Return the contacts of the tangents from a point (2,): normals n with n.(point - c) = r."""
    index = np.arange(len(corners.begin))
    offset = point - corners.centre
    length = np.hypot(offset[:, 0], offset[:, 1])
    outside = length >= corners.radius - 1e-7
    index, offset, length = index[outside], offset[outside], length[outside]
    u = offset / length[:, None]
    left = np.column_stack([-u[:, 1], u[:, 0]])
    along = np.minimum(corners.radius / length, 1.0)[:, None]
    across = np.sqrt(1.0 - along**2)
    both = stacked([Contacts(index, along * u + side * across * left) for side in (1.0, -1.0)])
    return both.at(corners.on_quarter(both.corner, both.normal))


def stacked(parts: Sequence[Contacts]) -> Contacts:
    """Return contacts in one array."""
    return Contacts(
        np.concatenate([np.empty(0, dtype=np.intp), *(part.corner for part in parts)]),
        np.concatenate([np.empty((0, 2)), *(part.normal for part in parts)]),
    )
