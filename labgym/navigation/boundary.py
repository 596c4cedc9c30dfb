"""The boundary of a disc's free positions: free arcs and free sides of the dilated rectangles."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from labgym.navigation.clearance import Index
from labgym.navigation.free_space import TOLERANCE, Arcs, FreeSpace
from labgym.navigation.tangents import Corners

Array = NDArray[np.float64]


class Boundary:
    """The boundary of the free positions, as pieces of arcs and straight sides.

    Args:
        space: the free positions.
        corners: quarter circles around the corners of the rectangles.
        arcs: the free arcs of those.

    Attributes:
        starts, ends: (s, 2) ends of the straight sides.
    """

    def __init__(self, space: FreeSpace, corners: Corners, arcs: Arcs) -> None:
        self._corners, self._arcs = corners, arcs
        self.starts, self.ends = free_sides(space)

    def nearest(self, point: Array) -> Array | None:
        """Return the point of the boundary (2,) that is nearest to a point (2,); None if there is no boundary."""
        points = np.concatenate([self._on_sides(point), self._on_arcs(point)])
        if len(points) == 0:
            return None
        return np.asarray(points[np.linalg.norm(points - point, axis=1).argmin()])

    def _on_sides(self, point: Array) -> Array:
        """Return the nearest point of each side, (s, 2)."""
        direction = self.ends - self.starts
        squared = np.maximum((direction**2).sum(axis=1), 1e-300)
        along = np.clip(((point - self.starts) * direction).sum(axis=1) / squared, 0.0, 1.0)
        return np.asarray(self.starts + along[:, None] * direction)

    def _on_arcs(self, point: Array) -> Array:
        """Return the nearest point of each arc, (a, 2)."""
        corner, span = self._arcs.corner, self._arcs.span
        offset = point - self._corners.centre[corner]
        middle, half = span.mean(axis=1), np.diff(span, axis=1)[:, 0] / 2.0
        angle = np.arctan2(offset[:, 1], offset[:, 0]) - self._corners.begin[corner] - middle
        angle = (angle + np.pi) % (2.0 * np.pi) - np.pi
        return self._corners.at_turn(corner, middle + np.clip(angle, -half, half))


def free_sides(space: FreeSpace) -> tuple[Array, Array]:
    """Return the free pieces of the straight sides of the dilated rectangles and of the bounds: starts, ends (s, 2)."""
    starts, ends = _sides(space)
    side, enter, leave = _blocked(starts, ends, space)
    pieces: list[tuple[int, float, float]] = []
    begin = np.searchsorted(side, np.arange(len(starts) + 1))
    for k in range(len(starts)):
        blocked = zip(enter[begin[k] : begin[k + 1]].tolist(), leave[begin[k] : begin[k + 1]].tolist(), strict=True)
        pieces += [(k, low, high) for low, high in _rest(sorted(blocked)) if high > low]
    row = np.array([k for k, _, _ in pieces], dtype=np.intp)
    share = np.array([part[1:] for part in pieces]).reshape(-1, 2)
    direction = ends[row] - starts[row]
    first, last = starts[row] + share[:, :1] * direction, starts[row] + share[:, 1:] * direction
    free = space.holds((first + last) / 2.0)
    return first[free], last[free]


def _rest(blocked: list[tuple[float, float]]) -> Iterator[tuple[float, float]]:
    """Yield the parts of [0, 1] that ascending intervals leave."""
    reached = 0.0
    for enter, leave in blocked:
        if enter > reached:
            yield reached, min(enter, 1.0)
        reached = max(reached, leave)
    yield reached, 1.0


def _sides(space: FreeSpace) -> tuple[Array, Array]:
    """Return the sides of the dilated rectangles and of the bounds, starts and ends (s, 2)."""
    boxes = space.obstacles.boxes
    corners, axes = boxes.corners(), boxes.axes()
    normals = np.stack([-axes[:, 1], axes[:, 0], axes[:, 1], -axes[:, 0]], axis=1) * space.radius
    starts, ends = corners + normals, np.roll(corners, -1, axis=1) + normals
    (x0, y0), (x1, y1) = space.low, space.high
    around = np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)])
    return (
        np.concatenate([starts.reshape(-1, 2), around]),
        np.concatenate([ends.reshape(-1, 2), np.roll(around, -1, axis=0)]),
    )


def _blocked(starts: Array, ends: Array, space: FreeSpace) -> tuple[Index, Array, Array]:
    """Return the parts of segments nearer than the radius to a rectangle, or out of bounds.

    Returns:
        segment (p,), ascending, and the shares of its length at which the part begins and ends, (p,) and (p,).
    """
    radius, boxes = space.radius - TOLERANCE / 2.0, space.obstacles.boxes
    segment, box = space.obstacles.near(np.minimum(starts, ends) - radius, np.maximum(starts, ends) + radius)
    axes, half = boxes.axes()[box], boxes.half[box]
    start = (axes * (starts[segment] - boxes.centre[box])[:, None, :]).sum(axis=-1)
    direction = (axes * (ends - starts)[segment][:, None, :]).sum(axis=-1)
    # The dilated rectangle is convex: a segment is inside from the first entry into one of its parts to the last exit.
    parts = [_in_rectangle(start, direction, half + radius * np.array(grown)) for grown in ((1.0, 0.0), (0.0, 1.0))]
    parts += [
        _in_disc(start - half * np.array(sign), direction, radius)
        for sign in ((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0))
    ]
    enter = np.min([np.where(a < b, a, np.inf) for a, b in parts], axis=0)
    leave = np.max([np.where(a < b, b, -np.inf) for a, b in parts], axis=0)
    chosen = (enter < leave) & (leave > 0.0) & (enter < 1.0)
    segment, enter, leave = segment[chosen], enter[chosen], leave[chosen]
    low, high = space.low - TOLERANCE / 2.0, space.high + TOLERANCE / 2.0
    middle, half = (low + high) / 2.0, (high - low) / 2.0
    first, last = np.clip(_in_rectangle(starts - middle, ends - starts, np.broadcast_to(half, starts.shape)), 0.0, 1.0)
    number, zero, one = np.arange(len(starts)), np.zeros(len(starts)), np.ones(len(starts))
    segment = np.concatenate([segment, number, number])
    enter = np.concatenate([enter, zero, np.maximum(first, last)])
    leave = np.concatenate([leave, first, one])
    order = np.argsort(segment, kind="stable")
    return segment[order], enter[order], leave[order]


def _in_rectangle(start: Array, direction: Array, half: Array) -> tuple[Array, Array]:
    """Return the shares at which lines enter and leave centered rectangles (m, 2); enter >= leave for none."""
    steep = np.where(np.abs(direction) < 1e-300, 1e-300, direction)
    first, second = (-half - start) / steep, (half - start) / steep
    return np.minimum(first, second).max(axis=-1), np.maximum(first, second).min(axis=-1)


def _in_disc(start: Array, direction: Array, radius: float) -> tuple[Array, Array]:
    """Return the shares at which lines enter and leave discs around the origin, (m,); NaN for none."""
    a, b = (direction**2).sum(axis=-1), (start * direction).sum(axis=-1)
    with np.errstate(invalid="ignore", divide="ignore"):
        root = np.sqrt(b**2 - a * ((start**2).sum(axis=-1) - radius**2))
        return (-b - root) / a, (-b + root) / a
