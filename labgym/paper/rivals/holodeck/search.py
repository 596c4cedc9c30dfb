"""Holodeck's depth-first search: one object after the other on grid points, best partial solution kept.

Public repository allenai/Holodeck, `floor_objects.py`, class `DFS_Solver_Floor`: constants and order are its own. The
search is limited by the number of expanded nodes in place of 30 seconds.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from labgym.geometry import Array
from labgym.paper.rivals.chamber import Chamber, footprints
from labgym.paper.rivals.holodeck.vocabulary import (
    EDGE_SCORE,
    FREE_SCORE,
    FRONTS,
    Spots,
    expanded,
    scores,
)
from labgym.paper.rivals.piece import quarter
from labgym.paper.rivals.plan import Constraint, Large

PADDING = 0.10
"""Added to the width and depth of every object, meters (`size_buffer`)."""
CLOSER = 0.045
"""The padded footprint is pushed this far beyond the wall, meters, so that the object stands 5 mm off it."""
FRONT_CLEAR = 0.30
"""Least distance from the middle of an object's front to a wall, meters (`filter_facing_wall`)."""


@dataclass(frozen=True)
class SearchLimits:
    """Size of the search.

    Attributes:
        first: spots of the first object that are tried, at random. later: spots of each later object, best first.
        expansions: number of nodes; the published limit is 30 s, or about 1000 nodes at 30 ms.
        density: number of grid steps on the longer side of the room (`grid_density`).
    """

    first: int = 30
    later: int = 1
    expansions: int = 1000
    density: int = 20


@dataclass(frozen=True)
class Solution:
    """Spots of the objects that were placed, by name; the sum of their scores; and the number of expanded nodes."""

    spots: Mapping[str, Spots]
    score: float
    expansions: int


def grid_step(chamber: Chamber, density: int) -> float:
    """Return the spacing of the grid, meters: whole meters of the longer side, in `density` steps."""
    longer = max(math.floor(chamber.ground.width + 1e-9), math.floor(chamber.ground.depth + 1e-9), 1)
    return longer / density


def search(
    objects: Sequence[Large], chamber: Chamber, generator: np.random.Generator, limits: SearchLimits = SearchLimits()
) -> Solution:
    """Return the best solution that the search finds: the greatest sum of scores over all placed objects.

    An object without a free spot is left out. The published code ends the branch there, with what it has placed: to go
    on is a deviation in its favor.
    """
    return _Search(chamber, generator, limits, grid_step(chamber, limits.density)).run(objects)


@dataclass
class _Search:
    chamber: Chamber
    generator: np.random.Generator
    limits: SearchLimits
    step: float
    expansions: int = 0
    best: Solution | None = None
    candidates: dict[tuple[float, float], tuple[Spots, Spots]] = field(default_factory=dict)

    def run(self, objects: Sequence[Large]) -> Solution:
        self._descend(objects, {}, 0.0, self.limits.first)
        assert self.best is not None
        return Solution(self.best.spots, self.best.score, self.expansions)

    def _descend(self, objects: Sequence[Large], placed: dict[str, Spots], score: float, branches: int) -> None:
        if not objects:
            self._keep(placed, score)
            return
        if self.expansions >= self.limits.expansions:
            self._keep(placed, score)
            return
        self.expansions += 1
        spots = self._ranked(objects[0], placed)
        if not len(spots):
            self._descend(objects[1:], placed, score, branches)
            return
        if branches > 1:
            spots = spots[self.generator.permutation(len(spots))]
        for k in range(min(branches, len(spots))):
            spot = spots[k : k + 1]
            self._descend(
                objects[1:], {**placed, objects[0].name: spot}, score + float(spot.score[0]), self.limits.later
            )

    def _keep(self, placed: dict[str, Spots], score: float) -> None:
        if self.best is None or score > self.best.score + 1e-12:
            self.best = Solution(placed, score, 0)

    def _ranked(self, one: Large, placed: Mapping[str, Spots]) -> Spots:
        """Spots that overlap no placed object, best first; equal ones in random order."""
        size = one.asset.size
        if (size.width, size.depth) not in self.candidates:
            self.candidates[size.width, size.depth] = candidates(self.chamber, size.width, size.depth, self.step)
        free, edge = self.candidates[size.width, size.depth]
        constraints = [part for constraint in one.constraints for part in expanded(constraint)]
        spots = _admitted(constraints, free, edge)
        if placed and len(spots):
            spots = spots[~_overlapping(spots, Spots.joined(list(placed.values())))]
        if not len(spots):
            return spots
        spots = spots[self.generator.permutation(len(spots))]
        ranked = scores(spots, constraints, placed, self.step)
        order = np.argsort(-ranked, kind="stable")
        return Spots(spots.center[order], spots.half[order], spots.turn[order], ranked[order])


def _admitted(constraints: Sequence[Constraint], free: Spots, edge: Spots) -> Spots:
    """Spots that the global constraint admits: edge is hard; "middle" with further constraints admits both kinds."""
    if not any(constraint.relation == "middle" for constraint in constraints):
        return edge
    return Spots.joined([free, edge]) if len(constraints) > 1 else free


def _overlapping(spots: Spots, placed: Spots) -> NDArray[np.bool_]:
    """Whether each spot touches or overlaps a placed footprint, shape (n,)."""
    along = [
        np.abs(spots.center[:, None, k] - placed.center[:, k]) <= spots.half[:, None, k] + placed.half[:, k]
        for k in (0, 1)
    ]
    overlapping: NDArray[np.bool_] = np.any(along[0] & along[1], axis=1)
    return overlapping


def candidates(chamber: Chamber, width: float, depth: float, step: float) -> tuple[Spots, Spots]:
    """Return the spots of an object on the grid, and those of them that a wall attracts, pushed to that wall.

    A spot is on a grid point with one of four orientations. Its padded footprint is clear of everything fixed, and its
    front is `FRONT_CLEAR` from every wall. The wall attracts it if the middle of its back is within one grid step.
    """
    xs = np.arange(step, chamber.ground.width - 1e-9, step)
    ys = np.arange(step, chamber.ground.depth - 1e-9, step)
    points = np.array(np.meshgrid(xs, ys, indexing="ij")).reshape(2, -1).T
    turn = np.repeat(np.arange(4), len(points))
    center = np.tile(points, (4, 1))
    padded = np.array([width + PADDING, depth + PADDING]) / 2.0
    half = np.where((turn % 2 == 0)[:, None], padded, padded[::-1])
    front = FRONTS[turn]
    clear = chamber.free(footprints(center, half, np.zeros(len(turn))))
    clear &= chamber.wall_distance(center + padded[1] * front) >= FRONT_CLEAR
    free = Spots(center[clear], half[clear], turn[clear], np.full(int(clear.sum()), FREE_SCORE))
    return free, _at_walls(chamber, free, padded[1], step)


def _at_walls(chamber: Chamber, free: Spots, half_depth: float, step: float) -> Spots:
    back = chamber.wall_distance(free.center - half_depth * free.front)
    attracted = (back <= step) & (back < chamber.wall_distance(free.center))
    edge = free[attracted]
    center: Array = edge.center - (back[attracted] + CLOSER)[:, None] * edge.front
    inside = chamber.free(footprints(center, edge.half - PADDING / 2.0, np.zeros(len(edge))))
    edge = Spots(center, edge.half, edge.turn, np.full(len(edge), EDGE_SCORE))
    return edge[inside]


def yaw_of(spot: Spots) -> float:
    """Return the yaw of one spot, radians."""
    return quarter(int(spot.turn[0]))
