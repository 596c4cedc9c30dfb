"""Walks of people in a room: where they stand, and the lengths of their ways, quickly bounded or exact."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.csgraph import dijkstra

from labgym.layouts.placement import FLOOR, WALL
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.regulations.premises import OUTWARD, PERSON, Premises
from labgym.navigation import goal_pose
from labgym.navigation.barriers import Barriers
from labgym.navigation.free_space import FreeSpace
from labgym.navigation.plan import OBSTACLE_HEIGHT

ARM_REACH_M = 0.8
"""A person reaches equipment from this far in front of it, meters (ISO 7250-3: forward grip reach 0.65 to 0.8 m)."""
STEP_M = 0.2
"""Spacing of the places that are tried before equipment, meters."""
FINE_STEP_M, FINE_PLACES = 0.05, 16
"""Spacing of the places before an extinguisher, which may hang in a corner, meters; number of free ones used."""
INSIDE_M = 0.6
"""Distance from a door of the places next to it, meters."""
Array = NDArray[np.float64]


@dataclass(frozen=True)
class Roadmap:
    """Walks of a person, a disc of 0.25 m, that pass no door; movable objects are left out.

    Attributes:
        rooms: room of each space, as in `Site.rooms`.
    """

    arrangement: Arrangement
    rooms: NDArray[np.intp]

    @cached_property
    def premises(self) -> Premises:
        """Exact walks."""
        return Premises(self.arrangement, through_doors=False)

    @cached_property
    def _space(self) -> FreeSpace:
        return FreeSpace(Barriers.of(self.premises.walked, OBSTACLE_HEIGHT), PERSON)

    def stands(self, rows: Sequence[int]) -> list[tuple[float, float, bool]]:
        """Return where people stand before objects, and whether that place is free: the first free place in front."""
        new = [row for row in dict.fromkeys(rows) if row not in self._stands]
        if new:
            places = [self._front(row) for row in new]
            free = self._space.holds(np.concatenate(places)).reshape(len(new), len(OUTWARD))
            for row, own, fits in zip(new, places, free, strict=True):
                x, y = own[int(fits.argmax())].tolist()
                self._stands[row] = x, y, bool(fits.any())
        return [self._stands[row] for row in rows]

    @cached_property
    def _stands(self) -> dict[int, tuple[float, float, bool]]:
        """Places that have been found, by row."""
        return {}

    def _ends(self, goals: Sequence[int], anywhere: bool) -> list[tuple[float, float]]:
        """Return free places from which people use equipment: in front of each piece, or anywhere in an arm's reach."""
        ends = [(x, y) for x, y, free in self.stands(goals) if free]
        for goal in goals if anywhere else ():
            within = self._within_reach(goal)
            ends += [(x, y) for x, y in within[self._space.holds(within)].tolist()]
        return ends

    def _front(self, row: int) -> Array:
        """Return the places in front of an object, or of what carries it, shape (k, 2)."""
        layout, placement = self.arrangement.layout, self.arrangement.placements[row]
        root = placement if placement.support in (FLOOR, WALL) else layout.root(placement.id)
        box = layout.box(root.id)
        x, y, _ = goal_pose(box)
        return np.array([(x + out * box.front[0], y + out * box.front[1]) for out in OUTWARD])

    def _within_reach(self, row: int, step: float = STEP_M) -> Array:
        """Return places from which an arm reaches an object, the nearest first, shape (k, 2)."""
        box = self.arrangement.box(row)
        (fx, fy), half = box.front, box.depth / 2.0
        sides = np.arange(-ARM_REACH_M, ARM_REACH_M + 1e-9, step)
        outs = np.arange(PERSON, ARM_REACH_M + 1e-9, step)
        out, side = (grid.ravel() for grid in np.meshgrid(outs, sides, indexing="ij"))
        order = np.argsort(np.hypot(out, side), kind="stable")
        order = order[np.hypot(out, side)[order] <= ARM_REACH_M + 1e-9]
        out, side = half + out[order], side[order]
        return np.column_stack([box.x + out * fx + side * fy, box.y + out * fy - side * fx])

    @cached_property
    def _entries(self) -> dict[int, Array]:
        """Free places inside the doors of each room, shape (k, 2)."""
        entrances = self.arrangement.building.entrances
        if not entrances:
            return {}
        poses = np.array([entrance.pose for entrance in entrances])
        points = poses[:, :2] + INSIDE_M * np.column_stack([-np.sin(poses[:, 2]), np.cos(poses[:, 2])])
        free, rooms = self._space.holds(points), self.rooms[[entrance.space for entrance in entrances]]
        return {int(room): points[free & (rooms == room)] for room in set(rooms.tolist())}

    @cached_property
    def _workplaces(self) -> dict[int, list[int]]:
        """Rows of the places of work by room: corners of the walks whose lengths are bounded."""
        own: dict[int, list[int]] = {}
        for row in self.arrangement.workplaces:
            own.setdefault(int(self.rooms[self.arrangement.spaces[row]]), []).append(row)
        return own

    def bounds(self, starts: Sequence[int], goals: Sequence[int], room: int, anywhere: bool = False) -> Array:
        """Return upper bounds of the walks from objects to the nearest of some equipment in a room, meters.

        The walks consist of straight lines between the places where people stand; inf without one.

        Args:
            anywhere: whether walks end anywhere within an arm's reach of the equipment, or in front of it.
        """
        corners = [(x, y) for x, y, free in self.stands(self._workplaces.get(room, [])) if free]
        begins, ends = self.stands(starts), self._ends(goals, anywhere)
        if not ends:
            return np.full(len(starts), np.inf)
        own = [(x, y) for x, y, _ in begins]
        entries = self._entries.get(room, np.zeros((0, 2))).tolist()
        lengths = self._lines(np.array([*ends, *own, *corners, *entries]))
        nearest = dijkstra(lengths, directed=False, indices=range(len(ends)), min_only=True)
        free = np.array([free for _, _, free in begins])
        return np.where(free, nearest[len(ends) : len(ends) + len(own)], np.inf)

    def reached(self, row: int) -> bool:
        """Whether a person comes within an arm's reach of an object from a door of its room, or a place of work in it.

        Places of work count in rooms whose doors have no free place inside; without those, everything is reached.
        """
        room = int(self.rooms[self.arrangement.spaces[row]])
        work = [(x, y) for x, y, free in self.stands(self._workplaces.get(room, [])) if free]
        begins = [(x, y) for x, y in self._entries.get(room, np.zeros((0, 2))).tolist()] or work
        fine = self._within_reach(row, FINE_STEP_M)
        free = fine[self._space.holds(fine)]
        ends = [*self._ends([row], anywhere=False), *free[:: max(1, len(free) // FINE_PLACES)].tolist()]
        if not begins or not ends:
            return not begins
        lengths = self._lines(np.array([*begins, *ends, *work]))
        nearest = dijkstra(lengths, directed=False, indices=range(len(begins)), min_only=True)
        if np.isfinite(nearest[len(begins) : len(begins) + len(ends)]).any():
            return True
        return any(self.premises.paths.connected(begin, end) for begin in begins for end in ends)

    def _lines(self, points: Array) -> Array:
        """Return the lengths of the free straight lines between places (n, 2), 0 where none is free, shape (n, n)."""
        first, second = np.triu_indices(len(points), 1)
        lengths = np.zeros((len(points), len(points)))
        free = self._space.joins(points[first], points[second])
        spans = np.linalg.norm(points[first] - points[second], axis=1)
        lengths[first[free], second[free]] = np.maximum(spans[free], 1e-9)
        return lengths

    def length(self, start: int, goals: Sequence[int]) -> float:
        """Return the exact length of the shortest walk from an object to the nearest of some equipment, meters."""
        ((x, y, free),) = self.stands([start])
        ends = [(gx, gy, 0.0) for gx, gy in self._ends(goals, anywhere=True)]
        return self.premises.walk((x, y, 0.0), ends) if free else math.inf
