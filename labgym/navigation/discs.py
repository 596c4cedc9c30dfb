"""Lengths of shortest paths to a disc around a goal."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from labgym.navigation.lengths import LengthsTo
from labgym.navigation.visibility import ShortestPaths

Array = NDArray[np.float64]

SPACING = 0.02
"""Largest distance between two candidate ends on the circle, meters."""
TOLERANCE = 1e-4
"""Arc to which the best end is refined, meters."""


def length_to_disc(paths: ShortestPaths, start: Sequence[float], goal: Sequence[float], radius: float) -> float:
    """Return the length of the shortest path from a point to a disc around a goal, meters; inf without a path.

    Where the straight line from the circle to the goal is free, the path to the goal is the best one, less the radius.
    Ends on the rest of the circle, such as those around a corner from the goal, are searched: candidates `SPACING`
    apart, the best one refined to `TOLERANCE`. The result is exact in the first case, and in the second one at most
    `SPACING` too long.

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
    count = math.ceil(2.0 * math.pi * radius / SPACING)
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
    return min(best, around[angle], _refined(length, angle, 2.0 * math.pi / count, TOLERANCE / radius))


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
