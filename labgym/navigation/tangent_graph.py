"""The tangent visibility graph of a disc's free space: contacts, the segments and the arcs between them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components, dijkstra

from labgym.navigation.boundary import Boundary
from labgym.navigation.clearance import Index
from labgym.navigation.free_space import SPACING, Arcs, FreeSpace, free_arcs
from labgym.navigation.tangents import Contacts, Corners, bitangents, stacked, tangents

Array = NDArray[np.float64]

TOUCHING = 1e-14
"""Least length of an edge, meters: SciPy drops explicit zeros, so contacts that coincide need a length."""
GOALS = 256
"""Number of goals whose tangents are kept."""


@dataclass(frozen=True)
class Nodes:
    """Contacts on free arcs.

    Attributes:
        contacts: m contacts. points: (m, 2). arc: (m,) index of the arc. turn: (m,) angle along the quarter, radians.
    """

    contacts: Contacts
    points: Array
    arc: Index
    turn: Array

    def __len__(self) -> int:
        return len(self.arc)

    @property
    def place(self) -> Array:
        """Position on a line that has all arcs one after the other, (m,)."""
        return places(self.arc, self.turn)


def places(arc: Index, turn: Array) -> Array:
    """Return the positions of angles `turn` on arcs `arc`, (m,), on a line that has all arcs one after the other."""
    return np.asarray(arc * SPACING + turn)


@dataclass(frozen=True)
class Edges:
    """Undirected edges: numbers of the nodes that they join (e,), (e,), and lengths (e,), meters."""

    first: Index
    second: Index
    length: Array

    def matrix(self, count: int) -> csr_matrix:
        """Return the edges between `count` nodes as a sparse matrix, each once."""
        return csr_matrix((self.length, (self.first, self.second)), shape=(count, count))


class TangentGraph:
    """Nodes are the points at which straight segments touch the rounded corners of the dilated rectangles.

    Only contacts on free arcs are nodes, so corners without a free arc, such as those inside a row of cabinets, are
    dropped before pairs are formed. The rest grows with the number of pairs of corners, in pieces of bounded memory;
    segments are tested against the rectangles near them.

    Attributes:
        space: the free positions of the disc.
        corners: the quarter circles that have free arcs.
        arcs: their free arcs.
        nodes: contacts k and k + len / 2 are the ends of one free segment.
        edges: the segments, and the arcs between neighboring contacts.
    """

    def __init__(self, space: FreeSpace) -> None:
        self.space = space
        corners = Corners.of(space.obstacles, space.radius)
        arcs = free_arcs(corners, space)
        useful, first, count = np.unique(arcs.corner, return_index=True, return_counts=True)
        self.corners = corners.at(useful)
        self.arcs = Arcs(np.searchsorted(useful, arcs.corner), arcs.span)
        sectors = np.column_stack([arcs.span[first, 0], arcs.span[first + count - 1, 1]])
        pairs = [self._free(a, b) for a, b in bitangents(self.corners, sectors)]
        self.nodes = self._nodes(stacked([a for a, _ in pairs] + [b for _, b in pairs]))
        self._order = np.argsort(self.nodes.place, kind="stable")
        self._line = self.nodes.place[self._order]
        self._goals: dict[bytes, Nodes] = {}
        half = np.arange(len(self.nodes) // 2)
        self.edges = self._joined([self._segments(half, half + len(half)), self._along_arcs(self._order, self.nodes)])

    def visible_from(self, point: Array) -> Nodes:
        """Return the contacts of the free tangents from a point (2,)."""
        contacts = tangents(self.corners, point)
        contacts = contacts.at(self.arcs.of(self.corners, contacts)[0] >= 0)
        ends = self._points(contacts)
        return self._nodes(contacts.at(self.space.joins(np.broadcast_to(point, ends.shape), ends)))

    def _from_goal(self, goal: Array) -> Nodes:
        """Return `visible_from` a goal; people walk to the same ones again and again."""
        key = goal.tobytes()
        near = self._goals.get(key)
        if near is None:
            if len(self._goals) >= GOALS:
                self._goals.clear()
            near = self._goals[key] = self.visible_from(goal)
        return near

    def groups(self, point: Array) -> NDArray[np.int32]:
        """Return the groups of arcs, joined by segments, that are visible from a free point (2,), ascending.

        A path with at least one contact leads from one point to another if and only if a group is visible from both.
        """
        return np.unique(self._group[self.visible_from(point).arc])

    @cached_property
    def _group(self) -> NDArray[np.int32]:
        """Number of the group of each arc, (a,)."""
        half, count = len(self.nodes) // 2, len(self.arcs.corner)
        pairs = self.nodes.arc[:half], self.nodes.arc[half:]
        graph = csr_matrix((np.ones(half, dtype=np.int32), pairs), shape=(count, count))
        return np.asarray(connected_components(graph, directed=False)[1])

    @cached_property
    def boundary(self) -> Boundary:
        """The boundary of the free positions."""
        return Boundary(self.space, self.corners, self.arcs)

    def lengths_from(self, point: Array) -> tuple[Nodes, Array]:
        """Return nodes, those visible from a free point (2,) included, and the lengths of shortest paths to them, (m,).

        Lengths are in meters, inf without a path.
        """
        near, m = self.visible_from(point), len(self.nodes)
        number = m + np.arange(len(near))
        sight = Edges(np.full(len(near), m + len(near)), number, np.linalg.norm(near.points - point, axis=1))
        edges = self._joined([self.edges, sight, *self._attached(near, m)])
        lengths = dijkstra(edges.matrix(m + len(near) + 1), directed=False, indices=m + len(near))
        return self._nodes(stacked([self.nodes.contacts, near.contacts])), np.asarray(lengths[:-1])

    def trail(self, start: Array, goal: Array) -> tuple[Nodes, float] | None:
        """Return the contacts of a shortest path with at least one contact and its length; None if none exists."""
        near_start, near_goal = self.visible_from(start), self._from_goal(goal)
        s, g, m = len(near_start), len(near_goal), len(self.nodes)
        extra = self._nodes(stacked([near_start.contacts, near_goal.contacts]))
        number = m + np.arange(s + g)
        ends = np.concatenate([np.full(s, m + s + g), np.full(g, m + s + g + 1)])
        origins = np.concatenate([np.broadcast_to(start, (s, 2)), np.broadcast_to(goal, (g, 2))])
        sight = Edges(ends, number, np.linalg.norm(origins - extra.points, axis=1))
        edges = self._joined([self.edges, sight, *self._attached(extra, m)])
        size = m + s + g + 2
        lengths, before = dijkstra(edges.matrix(size), directed=False, indices=size - 2, return_predecessors=True)
        if not np.isfinite(lengths[size - 1]):
            return None
        passed = [int(before[size - 1])]
        while passed[-1] != size - 2:
            passed.append(int(before[passed[-1]]))
        chosen = np.array(passed[-2::-1], dtype=np.intp)
        contacts = stacked([self.nodes.contacts, extra.contacts]).at(chosen)
        return self._nodes(contacts), float(lengths[size - 1])

    def _free(self, a: Contacts, b: Contacts) -> tuple[Contacts, Contacts]:
        """Return those of the segments a-b that touch free arcs and are free."""
        for contacts in (0, 1):
            on_arc = self.arcs.of(self.corners, (a, b)[contacts])[0] >= 0
            a, b = a.at(on_arc), b.at(on_arc)
        free = self.space.joins(self._points(a), self._points(b))
        return a.at(free), b.at(free)

    def _points(self, contacts: Contacts) -> Array:
        return self.corners.points(contacts.corner, contacts.normal)

    def _nodes(self, contacts: Contacts) -> Nodes:
        return Nodes(contacts, self._points(contacts), *self.arcs.of(self.corners, contacts))

    def _segments(self, first: Index, second: Index) -> Edges:
        points = self.nodes.points
        return Edges(first, second, np.linalg.norm(points[first] - points[second], axis=1))

    def _along_arcs(self, order: Index, nodes: Nodes, offset: int = 0) -> Edges:
        """Join neighbors on an arc; `order` sorts the nodes by place, `offset` is the number of the first."""
        here, there = order[:-1], order[1:]
        same = nodes.arc[here] == nodes.arc[there]
        here, there = here[same], there[same]
        return Edges(here + offset, there + offset, self.space.radius * (nodes.turn[there] - nodes.turn[here]))

    def _attached(self, extra: Nodes, offset: int) -> list[Edges]:
        """Join further nodes, numbered from `offset`, to each other and to their neighbors on the same arc."""
        edges = [self._along_arcs(np.argsort(extra.place, kind="stable"), extra, offset)]
        position = np.searchsorted(self._line, extra.place)
        for neighbor, exists in ((position - 1, position > 0), (position, position < len(self._line))):
            row = np.flatnonzero(exists)
            node = self._order[neighbor[row]]
            same = self.nodes.arc[node] == extra.arc[row]
            row, node = row[same], node[same]
            edges.append(Edges(row + offset, node, self.space.radius * np.abs(extra.turn[row] - self.nodes.turn[node])))
        return edges

    @staticmethod
    def _joined(parts: list[Edges]) -> Edges:
        return Edges(
            np.concatenate([part.first for part in parts]),
            np.concatenate([part.second for part in parts]),
            np.maximum(np.concatenate([part.length for part in parts]), TOUCHING),
        )
