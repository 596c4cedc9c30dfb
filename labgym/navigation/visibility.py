"""Shortest any-angle paths for a disc among oriented rectangles, exact: L* of the SPL metric."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from labgym.errors import OptionError
from labgym.navigation.barriers import Barriers
from labgym.navigation.clearance import Index
from labgym.navigation.free_space import FreeSpace
from labgym.navigation.plan import OBSTACLE_HEIGHT, PLANNING_RADIUS, FloorPlan
from labgym.navigation.tangent_graph import Nodes, TangentGraph

Array = NDArray[np.float64]
ARC_STEP = math.radians(5.0)
POINTS = 256
"""Number of points of which it is kept whether they are free and what is seen from them."""
Point = tuple[float, float]
Value = TypeVar("Value")


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
    """Shortest paths in one floor plan; the visibility graph is computed once, when it is first used.

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
        self.space = FreeSpace(Barriers.of(plan, below), radius)
        self._free: dict[Point, bool] = {}
        self._groups: dict[Point, NDArray[np.int32]] = {}
        self._regions: dict[Point, Index] = {}

    @cached_property
    def graph(self) -> TangentGraph:
        """The visibility graph."""
        return TangentGraph(self.space)

    def path(self, start: Sequence[float], goal: Sequence[float]) -> ShortestPath | None:
        """Return a shortest path between two points, or None if the disc cannot get from one to the other.

        Points are in the floor's frame, in meters; components after x and y, such as a yaw, are ignored.
        """
        ends = np.array([start[:2], goal[:2]], dtype=np.float64)
        if not self.space.holds(ends).all():
            return None
        if self.space.joins(ends[:1], ends[1:])[0]:
            return ShortestPath(float(math.dist(*ends)), ends)
        trail = self.graph.trail(*ends)
        return None if trail is None else ShortestPath(trail[1], self._drawn(trail[0], ends))

    def free(self, x: float, y: float) -> bool:
        """Whether the disc fits at a point, meters."""
        return _kept(self._free, (x, y), lambda point: bool(self.space.holds(point[None])[0]))

    def connected(self, start: Sequence[float], goal: Sequence[float]) -> bool:
        """Whether the disc can get from one point to another, without searching for the path; as `path`.

        The cells of the floor show ways that are a few centimeters wider than the disc; the graph decides the rest.
        """
        (ax, ay), (bx, by) = start[:2], goal[:2]
        if not (self.free(ax, ay) and self.free(bx, by)):
            return False
        near, there = (_kept(self._regions, end, self.space.regions) for end in ((ax, ay), (bx, by)))
        if np.isin(near, there).any():
            return True
        ends = np.array([(ax, ay), (bx, by)], dtype=np.float64)
        if self.space.joins(ends[:1], ends[1:])[0]:
            return True
        from_here, from_there = (_kept(self._groups, end, self.graph.groups) for end in ((ax, ay), (bx, by)))
        return bool(np.isin(from_here, from_there).any())

    def _drawn(self, trail: Nodes, ends: Array) -> Array:
        """Return a trail of contacts as points between the ends, arcs subdivided."""
        pieces = [ends[:1]]
        corners, corner, turn = self.graph.corners, trail.contacts.corner, trail.turn
        for k in range(len(trail)):
            begin = turn[k - 1] if k > 0 and corner[k - 1] == corner[k] else turn[k]
            steps = max(1, math.ceil(abs(turn[k] - begin) / ARC_STEP))
            along = np.linspace(begin, turn[k], steps + 1)[1:]
            pieces.append(corners.at_turn(np.full(steps, corner[k]), along))
        return np.concatenate([*pieces, ends[1:]])


def _kept(values: dict[Point, Value], point: Point, find: Callable[[Array], Value]) -> Value:
    """Return what is known of a point, or find it; some values are kept."""
    if point not in values:
        if len(values) >= POINTS:
            values.clear()
        values[point] = find(np.array(point, dtype=np.float64))
    return values[point]


def shortest_path(
    plan: FloorPlan, start: Sequence[float], goal: Sequence[float], radius: float = PLANNING_RADIUS
) -> ShortestPath | None:
    """Return the shortest path for a disc between two points, or None if no path exists.

    For several paths in one layout use one `ShortestPaths`.
    """
    return ShortestPaths(plan, radius).path(start, goal)
