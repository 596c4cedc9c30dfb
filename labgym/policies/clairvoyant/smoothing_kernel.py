"""The squares that the cost of a path adds up, and its gradient."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from labgym.machine_code import entry, inner

Array = NDArray[np.float64]


@inner
def _within(value: float, high: float) -> float:
    """Return a value that is clipped to 0 and a bound; 0 for NaN."""
    value = value if value > 0.0 else 0.0
    return value if value < high else high


@inner
def _clearance(x: float, y: float, low: Array, node: float, values: Array) -> tuple[float, float, float]:
    """Return the distance at a point and its gradient, as `ClearanceField.at`."""
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
