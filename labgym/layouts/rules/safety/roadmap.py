"""Walks of people in a room: where they stand, quick walks along straight lines, and exact lengths."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.csgraph import shortest_path

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
LENGTH_TOLERANCE_M = 1e-9
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

    def within(
        self, starts: Sequence[int], goals: Sequence[int], room: int, limit: float, anywhere: bool = False
    ) -> NDArray[np.bool_]:
        """Whether a walk of straight lines leads from each object to some equipment of a room within a limit, (n,).

        The walks pass places where people stand. There may be a shorter walk where none is found: `length` decides.

        Args:
            limit: greatest length, meters.
            anywhere: whether walks end anywhere within an arm's reach of the equipment, or in front of it.
        """
        near = np.zeros(len(starts), dtype=np.bool_)
        begins, ends = self.stands(starts), self._ends(goals, anywhere)
        free = np.flatnonzero([free for _, _, free in begins])
        if not ends or not len(free):
            return near
        own, last = np.array([begins[k][:2] for k in free]), np.array(ends)
        near[free] = self._lines(own, last).min(axis=1) <= limit + LENGTH_TOLERANCE_M
        rest = np.flatnonzero(~near[free])
        hubs, between = self._hubs(room)
        if len(rest) and len(hubs):
            beyond = (between + self._lines(hubs, last).min(axis=1)).min(axis=1)
            lengths = (self._lines(own[rest], hubs) + beyond).min(axis=1)
            near[free[rest]] = lengths <= limit + LENGTH_TOLERANCE_M
        return near

    def reached(self, row: int) -> bool:
        """Whether a person comes within an arm's reach of an object from a door of its room, or a place of work in it.

        Places of work count in rooms whose doors have no free place inside; without those, everything is reached.
        """
        room = int(self.rooms[self.arrangement.spaces[row]])
        (hubs, between), entries = self._hubs(room), len(self._entries.get(room, ()))
        # Doors come last; without a free place inside them, `-0:` takes all places of work.
        begins, fine = hubs[-entries:], self._within_reach(row, FINE_STEP_M)
        free = fine[self._space.holds(fine)]
        ends = [*self._ends([row], anywhere=False), *free[:: max(1, len(free) // FINE_PLACES)].tolist()]
        if not len(begins) or not ends:
            return not len(begins)
        beyond = self._lines(hubs, np.array(ends)).min(axis=1)
        if np.isfinite(between[-entries:] + beyond).any():
            return True
        return any(self.premises.paths.connected(begin, end) for begin in begins.tolist() for end in ends)

    def _hubs(self, room: int) -> tuple[Array, Array]:
        """Return places through which walks of a room lead, (k, 2), and the lengths of the walks between them, (k, k).

        They are the free places before its places of work and inside its doors.
        """
        if room not in self._nets:
            corners = [(x, y) for x, y, free in self.stands(self._workplaces.get(room, [])) if free]
            entries = self._entries.get(room, np.zeros((0, 2)))
            hubs = np.concatenate([np.reshape(corners, (-1, 2)), entries])
            self._nets[room] = hubs, shortest_path(self._network(hubs), directed=False)
        return self._nets[room]

    def _network(self, hubs: Array) -> Array:
        """Return the free straight lines between places as scipy reads a dense graph: lengths, 0 for none, (k, k)."""
        first, second = np.triu_indices(len(hubs), 1)
        free = self._space.joins(hubs[first], hubs[second])
        lengths = np.zeros((len(hubs), len(hubs)))
        spans = np.linalg.norm(hubs[first] - hubs[second], axis=1)
        lengths[first[free], second[free]] = np.maximum(spans[free], LENGTH_TOLERANCE_M)
        return lengths

    @cached_property
    def _nets(self) -> dict[int, tuple[Array, Array]]:
        """Places and walks that have been computed, by room."""
        return {}

    def _lines(self, starts: Array, ends: Array) -> Array:
        """Return the lengths of the straight lines between places (m, 2) and (n, 2), inf if not free, (m, n)."""
        first, second = (grid.ravel() for grid in np.indices((len(starts), len(ends))))
        spans = np.linalg.norm(starts[first] - ends[second], axis=1)
        free = self._space.joins(starts[first], ends[second])
        return np.where(free, spans, np.inf).reshape(len(starts), len(ends))

    def length(self, start: int, goals: Sequence[int]) -> float:
        """Return the exact length of the shortest walk from an object to the nearest of some equipment, meters."""
        ((x, y, free),) = self.stands([start])
        ends = [(gx, gy, 0.0) for gx, gy in self._ends(goals, anywhere=True)]
        return self.premises.walk((x, y, 0.0), ends) if free else math.inf
