"""Lengths of exact shortest paths from anywhere to one goal, or to a disc around it."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from labgym.navigation.tangent_graph import places
from labgym.navigation.tangents import tangents
from labgym.navigation.visibility import ShortestPaths

Array = NDArray[np.float64]

BATCH = 8
"""Contacts whose visibility is tested at a time, in the order of the lengths through them."""
END_SPACING_M = 0.02
"""Largest distance between two candidate ends on the circle, meters."""
END_TOLERANCE_M = 1e-4
"""Arc to which the best end is refined, meters."""


class LengthsTo:
    """Lengths of shortest paths to a goal: one search from the goal, then a few tests of visibility per point.

    Args:
        paths: the shortest paths of a floor plan.
        goal: x and y, meters; further components are ignored.

    Attributes:
        paths, goal: as the arguments; the goal is (2,).
        reachable: whether the disc fits at the goal. Without, there are no nodes.
        arc, turn, points, lengths: of the m nodes, in ascending order of arc and angle: the arc of each, (m,); the
            angle along its quarter, (m,) radians; the position, (m, 2); the length from it to the goal, (m,) meters.
    """

    def __init__(self, paths: ShortestPaths, goal: Sequence[float]) -> None:
        self.paths, self.goal, self._graph = paths, np.array(goal[:2], dtype=np.float64), paths.graph
        self.reachable = paths.free(*self.goal.tolist())
        if self.reachable:
            nodes, lengths = self._graph.lengths_from(self.goal)
            order = np.argsort(nodes.place, kind="stable")
            self._line, self.arc, self.turn = nodes.place[order], nodes.arc[order], nodes.turn[order]
            self.points, self.lengths = nodes.points[order], lengths[order]

    @cached_property
    def first(self) -> NDArray[np.int64]:
        """The first node of each of the n arcs, (n + 1,)."""
        return np.searchsorted(self.arc, np.arange(len(self._graph.arcs.corner) + 1)).astype(np.int64)

    @cached_property
    def least(self) -> Array:
        """The least length from a node of each corner, (k,) meters; inf of corners without one."""
        least = np.full(len(self._graph.corners.begin), np.inf)
        np.minimum.at(least, self._graph.arcs.corner[self.arc], self.lengths)
        return least

    @property
    def nbytes(self) -> int:
        """Size of the arrays of this goal, without the shortest paths, bytes."""
        if not self.reachable:
            return 0
        return sum(one.nbytes for one in (self._line, self.arc, self.turn, self.points, self.lengths))

    def at(self, x: float, y: float) -> float:
        """Return the length from a point to the goal, meters; inf if the goal is not free.

        From a point that is not free it is the distance to the nearest free point and the length from there. From a
        region that is not connected to the goal's it is the least sum of the distance to a contact of that region
        and the length from there, or the distance to the goal.
        """
        if not self.reachable:
            return math.inf
        if self.paths.space.holds(np.array([[x, y]]))[0]:
            return self.from_free(x, y)
        nearest = self._graph.boundary.nearest(np.array([x, y]))
        px, py = (x, y) if nearest is None else nearest.tolist()
        return math.dist((x, y), (px, py)) + self.from_free(px, py)

    def from_free(self, x: float, y: float) -> float:
        """Return the length from a free point to a goal that can be reached, as `at`, meters."""
        point = np.array([x, y])
        length = self._from(point)
        if math.isinf(length):
            through = np.linalg.norm(self.points - point, axis=1) + self.lengths
            length = float(min(through.min(initial=math.inf), math.dist(point, self.goal)))
        return length

    def _from(self, point: Array) -> float:
        """Return the length from a free point (2,); inf without a path."""
        space = self.paths.space
        if space.joins(point[None], self.goal[None])[0]:
            return math.dist(point, self.goal)
        ends, lengths = self._ends(point)
        order = np.argsort(lengths)
        order = order[np.isfinite(lengths[order])]
        for first in range(0, len(order), BATCH):
            batch = order[first : first + BATCH]
            visible = space.joins(np.broadcast_to(point, (len(batch), 2)), ends[batch])
            if visible.any():
                return float(lengths[batch[visible.argmax()]])
        return math.inf

    def _ends(self, point: Array) -> tuple[Array, Array]:
        """Return the contacts of tangents from a point, (m, 2), and the lengths through them, (m,)."""
        corners = self._graph.corners
        contacts = tangents(corners, point)
        arc, turn = self._graph.arcs.of(corners, contacts)
        contacts, turn, arc = contacts.at(arc >= 0), turn[arc >= 0], arc[arc >= 0]
        ends = corners.points(contacts.corner, contacts.normal)
        return ends, np.linalg.norm(ends - point, axis=1) + self._along_arcs(arc, turn)

    def _along_arcs(self, arc: NDArray[np.intp], turn: Array) -> Array:
        """Return the lengths from places on arcs (m,): along the arc to the next node on either side, and on."""
        least = np.full(len(arc), np.inf)
        position = np.searchsorted(self._line, places(arc, turn))
        for neighbor, exists in ((position - 1, position > 0), (position, position < len(self._line))):
            row = np.flatnonzero(exists)
            node = neighbor[row]
            same = self.arc[node] == arc[row]
            row, node = row[same], node[same]
            along = self.lengths[node] + self.paths.radius * np.abs(turn[row] - self.turn[node])
            least[row] = np.minimum(least[row], along)
        return least


def length_to_disc(paths: ShortestPaths, start: Sequence[float], goal: Sequence[float], radius: float) -> float:
    """Return the length of the shortest path from a point to a disc around a goal, meters; inf without a path.

    Where the straight line from the circle to the goal is free, the path to the goal is the best one, less the radius.
    Ends on the rest of the circle, such as those around a corner from the goal, are searched: candidates
    `END_SPACING_M` apart, the best one refined to `END_TOLERANCE_M`. The result is exact in the first case, and in the
    second one at most `END_SPACING_M` too long.

    Args:
        paths: the shortest paths of the floor.
        start, goal: x and y, meters; further components are ignored.
        radius: radius of the disc, meters.
    """
    (x, y), center = start[:2], np.array(goal[:2], dtype=np.float64)
    if math.dist((x, y), center) <= radius:
        return 0.0
    path = paths.path((x, y), goal[:2])
    best = math.inf if path is None else path.length - radius
    count = math.ceil(2.0 * math.pi * radius / END_SPACING_M)
    angles: Array = np.arange(count, dtype=np.float64) * (2.0 * math.pi / count)
    ends = _on_circle(center, radius, angles)
    free = paths.space.holds(ends)
    if paths.free(*center.tolist()):
        seen = np.zeros(count, dtype=bool)
        seen[free] = paths.space.joins(ends[free], np.broadcast_to(center, (int(free.sum()), 2)))
        free &= ~seen
    if not free.any() or not paths.free(x, y):
        return best
    lengths_from = LengthsTo(paths, (x, y))

    def length(angle: float) -> float:
        end = _on_circle(center, radius, np.array([angle]))
        connected = paths.space.holds(end)[0] and paths.connected((x, y), end[0].tolist())
        return lengths_from.at(*end[0].tolist()) if connected else math.inf

    around = {float(angle): length(float(angle)) for angle in angles[free]}
    angle = min(around, key=around.__getitem__)
    return min(best, around[angle], _refined(length, angle, 2.0 * math.pi / count, END_TOLERANCE_M / radius))


def _refined(length: Callable[[float], float], angle: float, width: float, tolerance: float) -> float:
    """Return the least length near an angle: the interval shrinks by a third around its best point."""
    least = length(angle)
    while width > tolerance:
        for candidate in (angle - width * 2.0 / 3.0, angle + width * 2.0 / 3.0):
            value = length(candidate)
            if value < least:
                angle, least = candidate, value
        width *= 2.0 / 3.0
    return least


def _on_circle(center: Array, radius: float, angles: Array) -> Array:
    points: Array = center + radius * np.column_stack([np.cos(angles), np.sin(angles)])
    return points
