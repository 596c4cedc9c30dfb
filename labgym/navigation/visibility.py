"""Shortest any-angle paths for a disc among oriented rectangles, exact: L* of the SPL metric."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from labgym.errors import OptionError
from labgym.navigation.clearance import Obstacles
from labgym.navigation.plan import OBSTACLE_HEIGHT, PLANNING_RADIUS, FloorPlan
from labgym.navigation.tangents import Contacts, Corners, FreeSpace, bitangents, free_arcs, tangents

Array = NDArray[np.float64]
Index = NDArray[np.intp]
ARC_STEP = math.radians(5.0)


@dataclass(frozen=True, eq=False)
class ShortestPath:
    """A shortest path.

    Attributes:
        length: meters, with arcs measured as arcs.
        points: (n, 2) from start to goal; arcs are given by points at most 5 degrees apart.
    """

    length: float
    points: Array


class ShortestPaths:
    """Shortest paths in one floor plan; the visibility graph is computed once.

    Nodes are the points at which straight segments touch the rounded corners of the dilated obstacles; edges are those
    segments and the arcs between them. Nothing is sampled, so the lengths are exact up to rounding (1e-7 m of
    clearance): they are the infimum of the lengths that a disc of that radius can drive.

    Args:
        plan: the layout.
        radius: radius of the disc, meters.
        below: objects whose bottom is above this height are ignored, meters.

    Raises:
        OptionError: the radius is not positive.
    """

    def __init__(self, plan: FloorPlan, radius: float = PLANNING_RADIUS, below: float = OBSTACLE_HEIGHT) -> None:
        if not (0.0 < radius < math.inf):
            raise OptionError(f"radius {radius} of the disc must be a length above 0 m")
        self.radius = radius
        self.space = FreeSpace(plan.room, Obstacles(plan.obstacles(below)), radius)
        self._corners = Corners.of(self.space.obstacles, radius)
        self._arc_corner, self._arcs = free_arcs(self._corners, self.space)
        first, second = bitangents(self._corners)
        free = self.space.joins(self._points(first), self._points(second))
        self._first, self._second = first.at(free), second.at(free)

    def path(self, start: Sequence[float], goal: Sequence[float]) -> ShortestPath | None:
        """Return a shortest path between two points, or None if the disc cannot get from one to the other.

        Points are room coordinates in meters; components after x and y, such as a yaw, are ignored.
        """
        ends = np.array([start[:2], goal[:2]], dtype=np.float64)
        if not self.space.holds(ends).all():
            return None
        if self.space.joins(ends[:1], ends[1:])[0]:
            return ShortestPath(float(math.dist(*ends)), ends)
        graph = _Graph(ends, (self._first, self._second, self._visible_from(ends[0]), self._visible_from(ends[1])))
        nodes = graph.contacts
        arcs = self._along_arcs(nodes)
        trail, length = graph.search(self._points(nodes), arcs)
        return None if trail is None else ShortestPath(length, self._drawn(trail, nodes, ends))

    def _visible_from(self, point: Array) -> Contacts:
        """Return the contacts of the free tangents from a point."""
        contacts = tangents(self._corners, point)
        return contacts.at(self.space.joins(np.broadcast_to(point, (len(contacts.corner), 2)), self._points(contacts)))

    def _points(self, contacts: Contacts) -> Array:
        return self._corners.points(contacts.corner, contacts.normal)

    def _along_arcs(self, nodes: Contacts) -> tuple[Index, Index, Array]:
        """Join neighboring contacts on each free arc; return pairs of contacts and the lengths between them."""
        turn = self._corners.turned(nodes.corner, nodes.normal)
        # Quarters are at most pi/2 long: spaced by 4, one sorted line holds the arcs of all corners.
        begin, end = (self._arc_corner * 4.0 + self._arcs[:, k] for k in range(2))
        place = nodes.corner * 4.0 + turn
        arc = np.searchsorted(begin, place + 1e-6, side="right") - 1
        on_arc = arc >= 0
        on_arc[on_arc] = place[on_arc] <= end[arc[on_arc]] + 1e-6
        order = np.flatnonzero(on_arc)
        order = order[np.argsort(place[order], kind="stable")]
        here, there = order[:-1], order[1:]
        same = arc[here] == arc[there]
        here, there = here[same], there[same]
        return here, there, self.radius * (turn[there] - turn[here])

    def _drawn(self, trail: Index, nodes: Contacts, ends: Array) -> Array:
        """Return a trail of nodes as points, arcs subdivided. The trail's first and last are the ends."""
        pieces = [ends[:1]]
        inner = trail[1:-1]
        turn = self._corners.turned(nodes.corner[inner], nodes.normal[inner])
        for k, node in enumerate(inner):
            corner = nodes.corner[node]
            begin = turn[k - 1] if k > 0 and nodes.corner[inner[k - 1]] == corner else turn[k]
            steps = max(1, math.ceil(abs(turn[k] - begin) / ARC_STEP))
            angle = self._corners.begin[corner] + np.linspace(begin, turn[k], steps + 1)[1:]
            circle = np.column_stack([np.cos(angle), np.sin(angle)])
            pieces.append(self._corners.centre[corner] + self.radius * circle)
        return np.concatenate([*pieces, ends[1:]])


class _Graph:
    """Numbered contacts, and the straight edges between them, the start and the goal."""

    def __init__(self, ends: Array, parts: tuple[Contacts, Contacts, Contacts, Contacts]) -> None:
        first, _, near_start, near_goal = parts
        self.ends = ends
        self.contacts = Contacts(
            np.concatenate([part.corner for part in parts]), np.concatenate([part.normal for part in parts])
        )
        m, s, g = len(first.corner), len(near_start.corner), len(near_goal.corner)
        self.start, self.goal = 2 * m + s + g, 2 * m + s + g + 1
        number = np.arange(2 * m + s + g)
        self.sources = np.concatenate([number[:m], np.full(s, self.start), np.full(g, self.goal)])
        self.targets = number[m:]

    def search(self, points: Array, arcs: tuple[Index, Index, Array]) -> tuple[Index | None, float]:
        """Return the nodes of a shortest path from start to goal and its length; None and inf if no path exists."""
        places = np.concatenate([points, self.ends])
        straight = np.linalg.norm(places[self.sources] - places[self.targets], axis=1)
        here, there, along = arcs
        # SciPy drops explicit zeros, so contacts that coincide are connected by a negligible length.
        weights = np.maximum(np.concatenate([straight, along]), 1e-14)
        rows, columns = np.concatenate([self.sources, here]), np.concatenate([self.targets, there])
        graph = csr_matrix((weights, (rows, columns)), shape=(len(places), len(places)))
        lengths, before = dijkstra(graph, directed=False, indices=self.start, return_predecessors=True)
        if not np.isfinite(lengths[self.goal]):
            return None, math.inf
        trail = [self.goal]
        while trail[-1] != self.start:
            trail.append(int(before[trail[-1]]))
        return np.array(trail[::-1], dtype=np.intp), float(lengths[self.goal])


def shortest_path(
    plan: FloorPlan, start: Sequence[float], goal: Sequence[float], radius: float = PLANNING_RADIUS
) -> ShortestPath | None:
    """Return the shortest path for a disc between two points, or None if no path exists.

    For several paths in one layout use one `ShortestPaths`.
    """
    return ShortestPaths(plan, radius).path(start, goal)
