"""Smooth paths: an elastic band in a field of distances that bends no more than a robot at full speed can turn."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize

from labgym.geometry import Array
from labgym.machine_code import entry, inner
from labgym.navigation import FloorPlan
from labgym.navigation.barriers import Barriers
from labgym.navigation.clearance import Obstacles
from labgym.policies.tracking import resampled

NODE_M = 0.05
"""Distance between the nodes, meters."""

FARTHEST_M = 2.0
"""Greatest distance of the field, meters."""

TILE_NODES = 32
"""Side of the tiles that are computed one by one, with the obstacles within reach alone, nodes."""


BAND_STEP_M = 0.10
"""Distance between the points of the band, meters."""

MOST_EVALUATIONS = 300
"""Most evaluations of a path's cost."""


class ClearanceField:
    """Distances from points of a floor to its nearest barrier, up to 2 m; bilinear between nodes 5 cm apart.

    Args:
        plan: the floor.

    Attributes:
        barriers: of the floor. low: (2,) corner of the field, meters. values: (rows, columns) of y and x, meters.
    """

    def __init__(self, plan: FloorPlan) -> None:
        self.barriers = Barriers.of(plan)
        self.low = self.barriers.low - NODE_M
        columns, rows = (np.ceil((self.barriers.high - self.low) / NODE_M).astype(int) + 2).tolist()
        x, y = self.low[0] + NODE_M * np.arange(columns), self.low[1] + NODE_M * np.arange(rows)
        self.values: Array = np.empty((rows, columns))
        for row in range(0, rows, TILE_NODES):
            for column in range(0, columns, TILE_NODES):
                part = slice(row, row + TILE_NODES), slice(column, column + TILE_NODES)
                self.values[part] = self._distances(x[part[1]], y[part[0]])

    def _distances(self, x: Array, y: Array) -> Array:
        """Return the distances at the nodes of a tile, (rows, columns) meters, from its x and y."""
        nodes = np.column_stack([np.tile(x, len(y)), np.repeat(y, len(x))])
        reach, obstacles = FARTHEST_M + NODE_M, self.barriers.obstacles
        _, near = obstacles.near(nodes[:1] - reach, nodes[-1:] + reach)
        within = replace(self.barriers, obstacles=Obstacles(obstacles.sources[k] for k in near.tolist()))
        return np.minimum(within.clearance(nodes), FARTHEST_M).reshape(len(y), len(x))


@inner
def _within(value: float, high: float) -> float:
    """Return a value that is clipped to 0 and a bound; 0 for NaN."""
    value = value if value > 0.0 else 0.0
    return value if value < high else high


@inner
def _clearance(x: float, y: float, low: Array, node: float, values: Array) -> tuple[float, float, float]:
    """Return the distance at a point, bilinear between the nodes, and its gradient."""
    rows, columns = values.shape
    x, y = _within((x - low[0]) / node, columns - 1.001), _within((y - low[1]) / node, rows - 1.001)
    column, row = int(x), int(y)
    u, v = x - column, y - row
    a, b = values[row, column], values[row, column + 1]
    c, d = values[row + 1, column], values[row + 1, column + 1]
    below, above = a + (b - a) * u, c + (d - c) * u
    return below + (above - below) * v, ((b - a) * (1.0 - v) + (d - c) * v) / node, (above - below) / node


@inner
def _add(gradient: Array, first: int, weight: float, pull: Array) -> None:
    """Add weighted pulls to the gradient from a point on."""
    for k in range(len(pull)):
        gradient[first + k, 0] += weight * pull[k, 0]
        gradient[first + k, 1] += weight * pull[k, 1]


@entry
def cost_terms(
    path: Array,
    h: float,
    square: float,
    band: tuple[float, float, float, float, float, float],
    low: Array,
    node: float,
    values: Array,
) -> tuple[Array, Array, Array, Array, Array, Array]:
    """Return the gradient of the cost of a path, (n, 2), and the squares that the cost adds up.

    The squares are of the edges, (n - 1, 2), the curvatures and their excesses over the limit, (n - 2,), the changes of
    curvature, (n - 3, 2), and the missing clearances, (n,).

    Args:
        path: (n, 2) meters. h: step, meters. square: its square. band: radius, curvature, bend, sharp, twist and wall.
        low, node, values: of the field.
    """
    radius, curvature, bend, sharp, twist, wall = band
    count = len(path)
    gradient, edges, second = np.zeros((count, 2)), np.empty((count - 1, 2)), np.empty((count - 2, 2))
    third, size, over = np.empty((count - 3, 2)), np.empty(count - 2), np.empty(count - 2)
    missing, pull = np.empty(count), np.empty((count - 1, 2))
    for k in range(count - 1):
        for axis in range(2):
            edges[k, axis] = path[k + 1, axis] - path[k, axis]
            pull[k, axis] = edges[k, axis] / h
    _add(gradient, 1, 1.0, pull)
    _add(gradient, 0, -1.0, pull)
    for k in range(count - 2):
        for axis in range(2):
            second[k, axis] = (edges[k + 1, axis] - edges[k, axis]) / square
        size[k] = math.sqrt(second[k, 0] * second[k, 0] + second[k, 1] * second[k, 1])
        over[k] = max(size[k] - curvature, 0.0)
        weight = 2.0 / h * (bend + sharp * over[k] / max(size[k], 1e-9))
        for axis in range(2):
            pull[k, axis] = weight * second[k, axis]
    _add(gradient, 0, 1.0, pull[:-1])
    _add(gradient, 1, -2.0, pull[:-1])
    _add(gradient, 2, 1.0, pull[:-1])
    for k in range(count - 3):
        for axis in range(2):
            third[k, axis] = (second[k + 1, axis] - second[k, axis]) / h
            pull[k, axis] = 2.0 * twist / square * third[k, axis]
    _add(gradient, 0, -1.0, pull[:-2])
    _add(gradient, 1, 3.0, pull[:-2])
    _add(gradient, 2, -3.0, pull[:-2])
    _add(gradient, 3, 1.0, pull[:-2])
    for k in range(count):
        distance, along, across = _clearance(path[k, 0], path[k, 1], low, node, values)
        missing[k] = max(radius - distance, 0.0)
        weight = 2.0 * h * wall * missing[k]
        gradient[k, 0] -= weight * along
        gradient[k, 1] -= weight * across
    return gradient, edges * edges, size * size, over * over, third * third, missing * missing


@dataclass(frozen=True)
class BandWeights:
    """Weights of the terms of a path's cost, in meters of length.

    Attributes:
        bend: of curvature squared, m2 for each meter. sharp: of curvature beyond `curvature` squared.
        twist: of the change of curvature squared, m4 for each meter.
        curvature: at which the robot turns at its greatest rate at full speed, 1/m.
        radius: distance to keep from barriers, meters. wall: of what is missing of it squared, 1/m2 for each meter.
        guide: of the distance from the polyline squared, 1/m2 for each meter.
    """

    bend: float = 0.02
    sharp: float = 1.0
    twist: float = 0.004
    curvature: float = 1.3
    radius: float = 0.32
    wall: float = 2e4
    guide: float = 0.0


def smooth_path(
    points: Array,
    field: ClearanceField,
    band: BandWeights,
    start_yaw: float | None = None,
    goal_yaw: float | None = None,
) -> Array:
    """Return a smooth path along a polyline, (n, 2) meters at even steps of about 10 cm.

    Args:
        points: (m, 2), the polyline; its ends stay. field: of the floor. band: the weights.
        start_yaw, goal_yaw: headings with which it begins and ends, radians; None for any.
    """
    path = resampled(points, BAND_STEP_M)
    guide = path.copy()
    count = len(path)
    if count < 6:
        return path
    h = float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum()) / (count - 1)
    first, last = 1, count - 1
    if start_yaw is not None:
        path[1] = path[0] + h * np.array([math.cos(start_yaw), math.sin(start_yaw)])
        first = 2
    if goal_yaw is not None:
        path[-2] = path[-1] - h * np.array([math.cos(goal_yaw), math.sin(goal_yaw)])
        last = count - 2

    def cost(flat: Array) -> tuple[float, Array]:
        path[first:last] = flat.reshape(-1, 2)
        value, gradient = _cost(path, h, field, band)
        if band.guide:
            off = path - guide
            value += h * band.guide * float((off**2).sum())
            gradient += 2.0 * h * band.guide * off
        return value, gradient[first:last].ravel()

    # Without BLAS, whose last bits depend on the processor.
    found = minimize(cost, path[first:last].ravel(), jac=True, method="TNC", options={"maxfun": MOST_EVALUATIONS})
    path[first:last] = found.x.reshape(-1, 2)
    return path


def _cost(path: Array, h: float, field: ClearanceField, band: BandWeights) -> tuple[float, Array]:
    """Return the cost of a path (n, 2) at steps of about h, meters, and its gradient, (n, 2)."""
    weights = band.radius, band.curvature, band.bend, band.sharp, band.twist, band.wall
    gradient, edges, sizes, overs, thirds, misses = cost_terms(path, h, h**2, weights, field.low, NODE_M, field.values)
    value = float(edges.sum()) / (2.0 * h)
    value += h * float(band.bend * sizes.sum() + band.sharp * overs.sum())
    value += h * band.twist * float(thirds.sum())
    value += h * band.wall * float(misses.sum())
    return value, gradient
