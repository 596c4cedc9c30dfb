"""How narrow the ways through a floor are: gaps between obstacles that a route passes, and the widest way."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from labgym.geometry import Array, pairwise_penetration
from labgym.navigation.barriers import Barriers
from labgym.navigation.clearance import Index, Obstacles
from labgym.navigation.plan import OBSTACLE_HEIGHT, FloorPlan

WIDEST = 3.0
"""Gaps wider than this count as this wide, meters."""
STEP = 0.05
"""Spacing of the points of a route at which the width across it is measured, meters."""
PIECES = 6
"""Number of consecutive pieces of a route that are compared with the gaps near them at a time."""


@dataclass(frozen=True)
class _Segments:
    """Shortest segments from corners to other rectangles.

    Attributes:
        first, second: (g,) rectangles. start, end: (g, 2) meters. width: (g,) lengths, meters.
    """

    first: Index
    second: Index
    start: Array
    end: Array
    width: Array


class Gaps:
    """The gaps between the obstacles and walls of a floor plan.

    A disc cannot cross a segment between two obstacles that is shorter than its diameter.

    Args:
        plan: the layout.
        below: objects whose bottom is above this height are ignored, meters.
    """

    def __init__(self, plan: FloorPlan, below: float = OBSTACLE_HEIGHT) -> None:
        self._obstacles = Barriers.of(plan, below).obstacles
        self._segments = _corner_segments(self._obstacles)

    def narrowest(self, route: Array) -> float:
        """Return the width of the narrowest gap that a route passes, meters; at most `WIDEST`.

        It is the length of the shortest segment between two obstacles that the route crosses: of those from a corner
        to the nearest point of another obstacle, which include the shortest between any two, and of those
        perpendicular to the route at points 5 cm apart, for a route that begins and ends in one aisle.

        Args:
            route: (n, 2) points of a polyline that keeps clear of obstacles.
        """
        crossed = self._segments.width[self._crossings(route) > 0]
        return float(min(crossed.min(initial=WIDEST), self._across(route).min(initial=WIDEST)))

    def widest(self, route: Array) -> float:
        """Return the width of the narrowest gap on the widest way between the ends of a route; at most `WIDEST`.

        A larger disc cannot get from the first to the last point, on whatever way; a smaller one can, apart from the
        room that it takes at the two ends. By duality: chains of obstacles are joined in the order of the gaps between
        them until a closed chain lies between the ends, that is, crosses the route an odd number of times.

        Args:
            route: (n, 2) points of any polyline between the two ends that keeps clear of obstacles.
        """
        gaps = self._segments
        odd = self._crossings(route) % 2
        flat = replace(self._obstacles.boxes, z=np.tile((0.0, 1.0), (len(self._obstacles), 1)))
        touching = np.argwhere(np.triu(pairwise_penetration(flat, flat) > -1e-9, 1))
        zero = np.zeros(len(touching))
        first = np.concatenate([touching[:, 0], gaps.first])
        second = np.concatenate([touching[:, 1], gaps.second])
        width, parity = np.concatenate([zero, gaps.width]), np.concatenate([zero.astype(int), odd])
        order = np.argsort(width, kind="stable")
        # Of the gaps between the same two obstacles on the same side of the ends only the narrowest matters.
        low, high = np.minimum(first, second)[order], np.maximum(first, second)[order]
        _, unique = np.unique((low * len(self._obstacles) + high) * 2 + parity[order], return_index=True)
        kept = order[np.sort(unique)]
        return _odd_cycle(len(self._obstacles), first[kept], second[kept], parity[kept], width[kept])

    def _crossings(self, route: Array) -> Index:
        """Return how often a route crosses each segment, (g,)."""
        gaps, count = self._segments, np.zeros(len(self._segments.width), dtype=np.intp)
        low, high = np.minimum(gaps.start, gaps.end), np.maximum(gaps.start, gaps.end)
        for first in range(0, len(route) - 1, PIECES):
            part = route[first : first + PIECES + 1]
            near = np.flatnonzero(((low <= part.max(axis=0)) & (high >= part.min(axis=0))).all(axis=1))
            a, b = gaps.start[near, None, :], gaps.end[near, None, :]
            # Points of the route on the line of a gap count as to its left: the parity is that of a nearby route.
            left = _cross(b - a, part[None] - a) >= 0.0
            begin, direction = part[None, :-1], np.diff(part, axis=0)[None]
            between = (_cross(direction, a - begin) >= 0.0) != (_cross(direction, b - begin) >= 0.0)
            count[near] += ((left[:, 1:] != left[:, :-1]) & between).sum(axis=1)
        return count

    def _across(self, route: Array) -> Array:
        """Return the free widths perpendicular to a route at points along it, (p,)."""
        lengths = np.linalg.norm(np.diff(route, axis=0), axis=1)
        pieces = np.flatnonzero(lengths > 0.0)
        counts = np.ceil(lengths[pieces] / STEP).astype(int) + 1
        piece = np.repeat(pieces, counts)
        shares = np.concatenate([np.empty(0), *(np.linspace(0.0, 1.0, count) for count in counts)])
        direction = np.diff(route, axis=0)[piece]
        points = route[piece] + shares[:, None] * direction
        normal = np.column_stack([-direction[:, 1], direction[:, 0]]) / lengths[piece][:, None]
        return self._reach(points, normal) + self._reach(points, -normal)

    def _reach(self, points: Array, directions: Array) -> Array:
        """Return the distance from points (p, 2) along unit vectors to the first obstacle, at most `WIDEST`, (p,)."""
        far = points + WIDEST * directions
        point, box = self._obstacles.near(np.minimum(points, far), np.maximum(points, far))
        boxes = self._obstacles.boxes
        axes = boxes.axes()[box]
        start = (axes * (points[point] - boxes.centre[box])[:, None, :]).sum(axis=-1)
        along = (axes * directions[point][:, None, :]).sum(axis=-1)
        steep = np.where(np.abs(along) < 1e-300, 1e-300, along)
        first, second = (-boxes.half[box] - start) / steep, (boxes.half[box] - start) / steep
        enter, leave = np.minimum(first, second).max(axis=-1), np.maximum(first, second).min(axis=-1)
        hit = (enter <= leave) & (leave >= 0.0)
        reach = np.full(len(points), WIDEST)
        np.minimum.at(reach, point[hit], np.maximum(enter[hit], 0.0))
        return reach


def _corner_segments(obstacles: Obstacles) -> _Segments:
    """Return the segments of up to `WIDEST` from each corner to the nearest point of each other rectangle."""
    boxes = obstacles.boxes
    corners = boxes.corners().reshape(-1, 2)
    corner, box = obstacles.near(corners - WIDEST, corners + WIDEST)
    other = corner // 4 != box
    corner, box = corner[other], box[other]
    axes, start = boxes.axes()[box], corners[corner]
    local = (axes * (start - boxes.centre[box])[:, None, :]).sum(axis=-1)
    nearest = np.clip(local, -boxes.half[box], boxes.half[box])
    end = boxes.centre[box] + (axes * nearest[..., None]).sum(axis=1)
    width = np.linalg.norm(local - nearest, axis=1)
    close = width <= WIDEST
    return _Segments(corner[close] // 4, box[close], start[close], end[close], width[close])


def _odd_cycle(count: int, first: Index, second: Index, odd: Index, width: Array) -> float:
    """Return the width at which edges, in ascending order of width, first close a cycle with an odd sum; or `WIDEST`.

    A forest of the joined nodes holds for each node the parity of its way to the root.
    """
    parent, parity = list(range(count)), [0] * count

    def root(node: int) -> tuple[int, int]:
        path = []
        while parent[node] != node:
            path.append(node)
            node = parent[node]
        sum_ = 0
        for member in reversed(path):
            sum_ ^= parity[member]
            parent[member], parity[member] = node, sum_
        return node, sum_

    for a, b, crosses, gap in zip(first.tolist(), second.tolist(), odd.tolist(), width.tolist(), strict=True):
        (top, up), (other, down) = root(a), root(b)
        if top != other:
            parent[top], parity[top] = other, up ^ down ^ crosses
        elif up ^ down ^ crosses:
            return float(gap)
    return WIDEST


def _cross(a: Array, b: Array) -> Array:
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])
