"""The free positions of a disc on a floor, and the shortest paths to a goal, as arrays that the kernel reads."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from labgym.navigation.free_space import SAME_ANGLE, TOLERANCE
from labgym.navigation.lengths import LengthsTo
from labgym.navigation.tangents import QUARTER
from labgym.navigation.visibility import ShortestPaths

Array = NDArray[np.float64]
Index = NDArray[np.int64]


class PlanarGround(NamedTuple):
    """The free positions of a disc on a floor.

    Attributes:
        limits: radius of the disc, tolerance of clearances, meters; tolerance of angles, radians.
        bounds: (2, 2) corners of a rectangle that contains the positions, meters.
        center, half, axis: (n, 2) of the rectangles: centers, half extents, unit vectors along their widths.
        low, high: (n, 2) bounds of the rectangles.
        corner, middle: (k, 2) corners with free arcs: positions, and unit vectors to the middles of their quarters.
        begin: (k,) directions at which the quarters begin, radians.
        first: (k + 1,) the first arc of each corner.
        span: (a, 2) begin and end of each arc along its quarter, radians.
        starts, ends: (s, 2) free straight sides of the boundary.
    """

    limits: Array
    bounds: Array
    center: Array
    half: Array
    axis: Array
    low: Array
    high: Array
    corner: Array
    middle: Array
    begin: Array
    first: Index
    span: Array
    starts: Array
    ends: Array


class Routes(NamedTuple):
    """The shortest paths to a goal.

    Attributes:
        goal: (2,) meters.
        first: (a + 1,) the first node of each arc.
        turn, length: (m,) angle of each node along its quarter, radians, and length from it to the goal, meters.
        node: (m, 2) positions of the nodes. least: (k,) the least length at each corner.
    """

    goal: Array
    first: Index
    turn: Array
    length: Array
    node: Array
    least: Array


def ground_of(paths: ShortestPaths) -> PlanarGround:
    """Return the free positions of the disc of shortest paths."""
    space, graph = paths.space, paths.graph
    boxes, corners, arcs = space.obstacles.boxes, graph.corners, graph.arcs
    outline = boxes.corners()
    middle = corners.begin + QUARTER / 2.0
    starts, ends = graph.boundary.starts, graph.boundary.ends
    return PlanarGround(
        np.array([paths.radius, TOLERANCE, SAME_ANGLE]),
        _floats([space.low, space.high]),
        _floats(boxes.centre),
        _floats(boxes.half),
        _floats(np.column_stack([np.cos(boxes.yaw), np.sin(boxes.yaw)])),
        _floats(outline.min(axis=1, initial=np.inf)),
        _floats(outline.max(axis=1, initial=-np.inf)),
        _floats(corners.centre),
        _floats(np.column_stack([np.cos(middle), np.sin(middle)])),
        _floats(corners.begin),
        np.searchsorted(arcs.corner, np.arange(len(corners.begin) + 1)).astype(np.int64),
        _floats(arcs.span),
        _floats(starts),
        _floats(ends),
    )


def routes_of(lengths: LengthsTo) -> Routes | None:
    """Return the shortest paths to a goal; None if the disc does not fit there."""
    if not lengths.reachable:
        return None
    arrays = lengths.turn, lengths.lengths, lengths.points, lengths.least
    return Routes(_floats(lengths.goal), lengths.first, *(_floats(array) for array in arrays))


def _floats(values: object) -> Array:
    return np.ascontiguousarray(values, dtype=np.float64)
