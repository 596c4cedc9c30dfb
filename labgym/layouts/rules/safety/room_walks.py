"""Quick walks of people in one room: where they stand, and straight lines between those places."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.csgraph import shortest_path

from labgym.geometry import OrientedBox
from labgym.geometry.frames import PlanarPose
from labgym.layouts.floor import Floor
from labgym.layouts.rules.open_doors import closed_floor
from labgym.layouts.rules.regulations.premises import OUTWARD, PERSON
from labgym.navigation.barriers import Barriers
from labgym.navigation.clearance import Obstacles
from labgym.navigation.free_space import FreeSpace
from labgym.navigation.goals import goal_pose
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
Area = tuple[float, float, float, float]
Stand = tuple[float, float, bool]
"""Where people stand, and whether that place is free."""


@dataclass(frozen=True)
class Used:
    """An object as people use it: its box, and that of what finally carries it, before which they stand."""

    box: OrientedBox
    root: OrientedBox


@dataclass(frozen=True, eq=False)
class RoomWalks:
    """The places in a room where people stand, and the walks of straight lines between them.

    Attributes:
        space: free positions of a person; exact in the room and around what stands in it.
        doors: poses on the faces of the walls at the doors and passages into the room.
        workplaces: places of work in the room, corners of the walks whose lengths are bounded.
    """

    space: FreeSpace
    doors: tuple[PlanarPose, ...]
    workplaces: tuple[Used, ...]
    _stands: dict[OrientedBox, Stand] = field(default_factory=dict)
    _near: dict[tuple[object, ...], NDArray[np.bool_]] = field(default_factory=dict)
    _reached: dict[Used, bool | None] = field(default_factory=dict)

    def stands(self, objects: Sequence[Used]) -> list[Stand]:
        """Return where people stand before objects, and whether that place is free: the first free place in front."""
        new = [root for root in dict.fromkeys(one.root for one in objects) if root not in self._stands]
        if new:
            places = [_front(root) for root in new]
            free = self.space.holds(np.concatenate(places)).reshape(len(new), len(OUTWARD))
            for root, own, fits in zip(new, places, free, strict=True):
                x, y = own[int(fits.argmax())].tolist()
                self._stands[root] = x, y, bool(fits.any())
        return [self._stands[one.root] for one in objects]

    def ends(self, goals: Sequence[Used], anywhere: bool) -> list[tuple[float, float]]:
        """Return free places from which people use equipment: in front of each piece, or anywhere in an arm's reach."""
        ends = [(x, y) for x, y, free in self.stands(goals) if free]
        for goal in goals if anywhere else ():
            within = _within_reach(goal.box)
            ends += [(x, y) for x, y in within[self.space.holds(within)].tolist()]
        return ends

    def within(self, starts: Sequence[Used], goals: Sequence[Used], limit: float, anywhere: bool) -> NDArray[np.bool_]:
        """Return `Roadmap.within`."""
        key = tuple(starts), tuple(goals), limit, anywhere
        if key not in self._near:
            self._near[key] = self._within(starts, goals, limit, anywhere)
        return self._near[key]

    def _within(self, starts: Sequence[Used], goals: Sequence[Used], limit: float, anywhere: bool) -> NDArray[np.bool_]:
        near = np.zeros(len(starts), dtype=np.bool_)
        begins, ends = self.stands(starts), self.ends(goals, anywhere)
        free = np.flatnonzero([free for _, _, free in begins])
        if not ends or not len(free):
            return near
        own, last = np.array([begins[k][:2] for k in free]), np.array(ends)
        near[free] = self._lines(own, last).min(axis=1) <= limit + LENGTH_TOLERANCE_M
        rest = np.flatnonzero(~near[free])
        hubs, between = self._hubs
        if len(rest) and len(hubs):
            beyond = (between + self._lines(hubs, last).min(axis=1)).min(axis=1)
            lengths = (self._lines(own[rest], hubs) + beyond).min(axis=1)
            near[free[rest]] = lengths <= limit + LENGTH_TOLERANCE_M
        return near

    @property
    def begins(self) -> Array:
        """The places from which equipment is reached, (k, 2): inside the doors, or else all places of work."""
        return self._hubs[0][-len(self._entries) :]  # `-0:` takes all.

    def ends_at(self, item: Used) -> list[tuple[float, float]]:
        """Return free places in an arm's reach of equipment."""
        fine = _within_reach(item.box, FINE_STEP_M)
        free = fine[self.space.holds(fine)]
        return [*self.ends([item], anywhere=False), *free[:: max(1, len(free) // FINE_PLACES)].tolist()]

    def reached(self, item: Used) -> bool | None:
        """Whether a walk leads from one of `begins` to one of `ends_at`; None if straight lines do not tell.

        Without a place to begin at, everything is reached.
        """
        if item not in self._reached:
            self._reached[item] = self._reaches(item)
        return self._reached[item]

    def _reaches(self, item: Used) -> bool | None:
        ends = self.ends_at(item) if len(self.begins) else []
        if not ends:
            return not len(self.begins)
        beyond = self._lines(self._hubs[0], np.array(ends)).min(axis=1)
        return True if np.isfinite(self._hubs[1][-len(self._entries) :] + beyond).any() else None

    @cached_property
    def _entries(self) -> Array:
        """Free places inside the doors, shape (k, 2)."""
        if not self.doors:
            return np.zeros((0, 2))
        poses = np.array(self.doors)
        points = poses[:, :2] + INSIDE_M * np.column_stack([-np.sin(poses[:, 2]), np.cos(poses[:, 2])])
        return np.asarray(points[self.space.holds(points)])

    @cached_property
    def _hubs(self) -> tuple[Array, Array]:
        """Places through which walks lead, (k, 2), and the lengths of the walks between them, (k, k).

        They are the free places before the places of work and inside the doors, which come last.
        """
        corners = [(x, y) for x, y, free in self.stands(self.workplaces) if free]
        hubs = np.concatenate([np.reshape(corners, (-1, 2)), self._entries])
        return hubs, shortest_path(self._network(hubs), directed=False)

    def _network(self, hubs: Array) -> Array:
        """Return the free straight lines between places as scipy reads a dense graph: lengths, 0 for none, (k, k)."""
        first, second = np.triu_indices(len(hubs), 1)
        free = self.space.joins(hubs[first], hubs[second])
        lengths = np.zeros((len(hubs), len(hubs)))
        spans = np.linalg.norm(hubs[first] - hubs[second], axis=1)
        lengths[first[free], second[free]] = np.maximum(spans[free], LENGTH_TOLERANCE_M)
        return lengths

    def _lines(self, starts: Array, ends: Array) -> Array:
        """Return the lengths of the straight lines between places (m, 2) and (n, 2), inf if not free, (m, n)."""
        first, second = (grid.ravel() for grid in np.indices((len(starts), len(ends))))
        spans = np.linalg.norm(starts[first] - ends[second], axis=1)
        free = self.space.joins(starts[first], ends[second])
        return np.where(free, spans, np.inf).reshape(len(starts), len(ends))


@lru_cache(maxsize=128)
def room_walks(
    floor: Floor,
    area: Area,
    obstacles: tuple[OrientedBox, ...],
    doors: tuple[PlanarPose, ...],
    workplaces: tuple[Used, ...],
) -> RoomWalks:
    """Return the walks in a room; they are those of an earlier layout if nothing has changed in it and around it.

    Args:
        area: x0, y0, x1, y1 of the room and of all places from which its objects are used; meters.
        obstacles: all that a person may touch in the area.
    """
    shut, low, high = closed_floor(floor), np.array(area[:2]), np.array(area[2:])
    solid = [box for box in shut.solids if box.z0 < OBSTACLE_HEIGHT and _touches(box, area)]
    bounds = np.array(shut.bounds)
    barriers = Barriers(Obstacles([*obstacles, *solid]), bounds[:2], bounds[2:], shut)
    return RoomWalks(FreeSpace(barriers, PERSON, (low, high)), doors, workplaces)


def _touches(box: OrientedBox, area: Area) -> bool:
    x0, y0, x1, y1 = box.bounds()
    return x0 <= area[2] and y0 <= area[3] and x1 >= area[0] and y1 >= area[1]


def _front(root: OrientedBox) -> Array:
    """Return the places in front of an object on the floor or on a wall, shape (k, 2)."""
    x, y, _ = goal_pose(root)
    return np.array([(x + out * root.front[0], y + out * root.front[1]) for out in OUTWARD])


def _within_reach(box: OrientedBox, step: float = STEP_M) -> Array:
    """Return places from which an arm reaches an object, the nearest first, shape (k, 2)."""
    (fx, fy), half = box.front, box.depth / 2.0
    sides = np.arange(-ARM_REACH_M, ARM_REACH_M + 1e-9, step)
    outs = np.arange(PERSON, ARM_REACH_M + 1e-9, step)
    out, side = (grid.ravel() for grid in np.meshgrid(outs, sides, indexing="ij"))
    order = np.argsort(np.hypot(out, side), kind="stable")
    order = order[np.hypot(out, side)[order] <= ARM_REACH_M + 1e-9]
    out, side = half + out[order], side[order]
    return np.column_stack([box.x + out * fx + side * fy, box.y + out * fy - side * fx])
