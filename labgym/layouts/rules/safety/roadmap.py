"""Walks of people that pass no door: quick walks of straight lines room by room, and exact lengths."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
from numpy.typing import NDArray

from labgym.geometry import BoxArray, OrientedBox
from labgym.layouts.placement import FLOOR, WALL, Placement
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.regulations.premises import Premises
from labgym.layouts.rules.safety.room_walks import Area, RoomWalks, Used, room_walks
from labgym.layouts.rules.thresholds import MOVABLE
from labgym.navigation.plan import OBSTACLE_HEIGHT

MARGIN_M = 2.0
"""People who use an object stand nearer to it than this, and touch nothing that is farther away, meters."""
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

    def within(
        self, starts: Sequence[int], goals: Sequence[int], room: int, limit: float, anywhere: bool = False
    ) -> NDArray[np.bool_]:
        """Whether a walk of straight lines leads from each object to some equipment of a room within a limit, (n,).

        The walks pass places where people stand. There may be a shorter walk where none is found: `length` decides.

        Args:
            starts, goals: rows of objects in the room.
            limit: greatest length, meters.
            anywhere: whether walks end anywhere within an arm's reach of the equipment, or in front of it.
        """
        return self._walks(room).within(self._used(starts), self._used(goals), limit, anywhere)

    def reached(self, row: int) -> bool:
        """Whether a person comes within an arm's reach of an object from a door of its room, or a place of work in it.

        Places of work count in rooms whose doors have no free place inside; without those, everything is reached.
        """
        walks, (item,) = self._walks(self._room(row)), self._used([row])
        is_reached = walks.reached(item)
        if is_reached is not None:
            return is_reached
        pairs = product(walks.begins.tolist(), walks.ends_at(item))
        return any(self.premises.paths.connected(begin, end) for begin, end in pairs)

    def length(self, start: int, goals: Sequence[int]) -> float:
        """Return the exact length of the shortest walk from an object to the nearest of some equipment, meters."""
        walks = self._walks(self._room(start))
        ((x, y, free),) = walks.stands(self._used([start]))
        ends = [(gx, gy, 0.0) for gx, gy in walks.ends(self._used(goals), anywhere=True)]
        return self.premises.walk((x, y, 0.0), ends) if free else math.inf

    def _room(self, row: int) -> int:
        return int(self.rooms[self.arrangement.spaces[row]])

    def _used(self, rows: Sequence[int]) -> tuple[Used, ...]:
        arrangement = self.arrangement
        return tuple(Used(arrangement.box(row), arrangement.box(arrangement.roots[row])) for row in rows)

    def _walks(self, room: int) -> RoomWalks:
        if room not in self._known:
            arrangement = self.arrangement
            area = self._areas[room]
            doors = [one.pose for one in arrangement.building.entrances if self.rooms[one.space] == room]
            workplaces = self._used([row for row in arrangement.workplaces if self._room(row) == room])
            floor, obstacles = arrangement.layout.floor, self._obstacles(area)
            self._known[room] = room_walks(floor, area, obstacles, tuple(doors), workplaces)
        return self._known[room]

    @cached_property
    def _known(self) -> dict[int, RoomWalks]:
        """Walks of the rooms that have been asked for."""
        return {}

    @cached_property
    def _areas(self) -> dict[int, Area]:
        """Bounds of each room and of the objects in it with what carries them, and `MARGIN_M` around."""
        arrangement = self.arrangement
        spaces = [space.boxes for space in arrangement.layout.floor.spaces]
        regions = BoxArray.of([box for own in spaces for box in own]).bounds()
        owner = self.rooms[np.repeat(np.arange(len(spaces)), [len(own) for own in spaces])]
        rows = np.arange(len(arrangement))
        rooms = self.rooms[np.array(arrangement.spaces, dtype=np.intp)]
        low, high = (
            np.concatenate([region, bounds[rows], bounds[arrangement.roots]])
            for region, bounds in zip(regions, arrangement.bounds, strict=True)
        )
        rooms = np.concatenate([owner, rooms, rooms])
        areas: dict[int, Area] = {}
        for room in sorted(set(owner.tolist())):
            (x0, y0), (x1, y1) = low[rooms == room, :2].min(axis=0), high[rooms == room, :2].max(axis=0)
            areas[room] = float(x0) - MARGIN_M, float(y0) - MARGIN_M, float(x1) + MARGIN_M, float(y1) + MARGIN_M
        return areas

    def _obstacles(self, area: Area) -> tuple[OrientedBox, ...]:
        """Return the boxes in an area that a person may touch."""
        low, high, placements = self._standing
        near = (low <= area[2:]).all(axis=1) & (high >= area[:2]).all(axis=1)
        layout, boxes = self.arrangement.layout, []
        for k in np.flatnonzero(near).tolist():
            boxes += [layout.box(placements[k].id), *layout.open_parts(placements[k].id)]
        return tuple(box for box in boxes if box.z0 < OBSTACLE_HEIGHT)

    @cached_property
    def _standing(self) -> tuple[Array, Array, list[Placement]]:
        """Bounds in plan, (n, 2) each, of what stands on the floor or hangs on walls, without movable objects."""
        arrangement = self.arrangement
        rows = [
            row
            for row in arrangement.standing
            if arrangement.placements[row].support == WALL or arrangement.assets[row].subtype not in MOVABLE
        ]
        others = [other for other in arrangement.others if other.support in (FLOOR, WALL)]
        low, high = (bounds[rows, :2] for bounds in arrangement.bounds)
        if others:
            more = BoxArray.of([arrangement.layout.box(other.id) for other in others]).bounds()
            low, high = (np.concatenate([own, new[:, :2]]) for own, new in zip((low, high), more, strict=True))
        return low, high, [*(arrangement.placements[row] for row in rows), *others]
