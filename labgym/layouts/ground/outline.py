"""The outline of a union of axis-aligned rectangles: its edges, and the rectangles missing from its bounds."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

JOIN = 1e-3
"""Coordinates that are nearer than this count as one, meters."""


class Edge(NamedTuple):
    """A straight edge with the union on its left: start, unit direction along an axis, and length; meters."""

    x: float
    y: float
    dx: int
    dy: int
    length: float


class Span(NamedTuple):
    """An axis-aligned rectangle, meters."""

    x0: float
    y0: float
    x1: float
    y1: float


def outline(rectangles: Sequence[Span]) -> list[Edge]:
    """Return the edges of a union of rectangles, each as long as it is straight, holes included."""
    xs, ys, inside = _cells(rectangles)
    padded = np.pad(inside, 1)
    core = padded[1:-1, 1:-1]
    edges = []
    for row, first, last in _runs(core & ~padded[:-2, 1:-1]):
        edges.append(Edge(xs[first], ys[row], 1, 0, xs[last] - xs[first]))
    for row, first, last in _runs(core & ~padded[2:, 1:-1]):
        edges.append(Edge(xs[last], ys[row + 1], -1, 0, xs[last] - xs[first]))
    for column, first, last in _runs((core & ~padded[1:-1, :-2]).T):
        edges.append(Edge(xs[column], ys[last], 0, -1, ys[last] - ys[first]))
    for column, first, last in _runs((core & ~padded[1:-1, 2:]).T):
        edges.append(Edge(xs[column + 1], ys[first], 0, 1, ys[last] - ys[first]))
    return edges


def missing(rectangles: Sequence[Span]) -> list[Span]:
    """Return disjoint rectangles that fill the bounds of a union of rectangles up."""
    xs, ys, inside = _cells(rectangles)
    growing: dict[tuple[int, int], int] = {}
    filled = []
    for row in range(len(ys)):
        runs = {(first, last) for _, first, last in _runs(~inside[row : row + 1])} if row < len(inside) else set()
        ended = [run for run in growing if run not in runs]
        filled += [Span(xs[run[0]], ys[growing.pop(run)], xs[run[1]], ys[row]) for run in ended]
        for run in sorted(runs):
            growing.setdefault(run, row)
    return filled


def _cells(rectangles: Sequence[Span]) -> tuple[list[float], list[float], NDArray[np.bool_]]:
    """The distinct coordinates, and which cells between them lie in the union, (ny, nx)."""
    xs = _distinct([x for r in rectangles for x in (r.x0, r.x1)])
    ys = _distinct([y for r in rectangles for y in (r.y0, r.y1)])
    inside = np.zeros((len(ys) - 1, len(xs) - 1), dtype=np.bool_)
    for r in rectangles:
        columns = slice(_index(xs, r.x0), _index(xs, r.x1))
        inside[_index(ys, r.y0) : _index(ys, r.y1), columns] = True
    return xs, ys, inside


def _distinct(values: Sequence[float]) -> list[float]:
    distinct: list[float] = []
    for value in sorted(values):
        if not distinct or value - distinct[-1] > JOIN:
            distinct.append(value)
    return distinct


def _index(values: Sequence[float], value: float) -> int:
    return int(np.argmin(np.abs(np.asarray(values) - value)))


def _runs(mask: NDArray[np.bool_]) -> Iterator[tuple[int, int, int]]:
    """Yield (row, first column, last column + 1) of each run of True in each row."""
    steps = np.diff(np.pad(mask, ((0, 0), (1, 1))).astype(np.int8), axis=1)
    for row in range(len(mask)):
        for first, last in zip(np.flatnonzero(steps[row] == 1), np.flatnonzero(steps[row] == -1), strict=True):
            yield row, int(first), int(last)
