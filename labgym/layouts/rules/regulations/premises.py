"""A layout as regulations measure it: its rooms and doors, and the walks of people."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

from labgym.geometry.frames import PlanarPose
from labgym.layouts.model import Layout
from labgym.layouts.placement import FLOOR, WALL
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.open_doors import with_closed_doors, with_open_doors
from labgym.layouts.rules.thresholds import MOVABLE
from labgym.navigation import LengthsTo, goal_pose
from labgym.navigation.visibility import ShortestPaths

INSIDE = 0.35
"""Distance from an exit at which a walk to it ends, meters."""
PERSON = 0.25
"""Radius of the disc that stands for a person, meters: half the shoulder breadth of a large man (ISO 7250-3: 95th
percentile up to 0.51 m)."""
OUTWARD = (0.0, 0.1, 0.2, 0.3, 0.4)
"""Further distances from furniture in a niche at which a person stands, meters; the first free one counts."""


@dataclass(frozen=True)
class Premises:
    """A layout, and shortest walks in it, for a disc of 0.25 m, without movable objects.

    Attributes:
        through_doors: whether people open interior doors; otherwise walks end at every door.
    """

    arrangement: Arrangement
    through_doors: bool = True

    @cached_property
    def paths(self) -> ShortestPaths:
        """Shortest paths for people."""
        return ShortestPaths(self.walked, PERSON)

    @cached_property
    def walked(self) -> Layout:
        """The layout in which people walk."""
        layout = self.arrangement.layout
        layout = with_open_doors(layout) if self.through_doors else with_closed_doors(layout)
        loose = {p.id for p in layout.placements if p.support == FLOOR and layout.asset(p.id).subtype in MOVABLE}
        kept = (p for p in layout.placements if layout.root(p.id).id not in loose)
        return layout.replace(placements=tuple(kept)) if loose else layout

    def rows(self, *subtypes: str) -> list[int]:
        """Return the rows of the objects of some subtypes."""
        return [row for row, asset in enumerate(self.arrangement.assets) if asset.subtype in subtypes]

    def name(self, row: int) -> str:
        """Return the id of an object."""
        return self.arrangement.placements[row].id

    def pose(self, row: int) -> PlanarPose:
        """Return where a person stands before an object, or before what carries it."""
        if row not in self._poses:
            self._poses[row] = self._pose(row)
        return self._poses[row]

    @cached_property
    def _poses(self) -> dict[int, PlanarPose]:
        """Poses that have been computed, by row."""
        return {}

    def _pose(self, row: int) -> PlanarPose:
        layout = self.arrangement.layout
        placement = self.arrangement.placements[row]
        root = placement if placement.support in (FLOOR, WALL) else layout.root(placement.id)
        box = layout.box(root.id)
        x, y, yaw = goal_pose(box)
        poses = [(x + out * box.front[0], y + out * box.front[1], yaw) for out in OUTWARD]
        return next((pose for pose in poses if self.paths.free(*pose[:2])), poses[0])

    def walk(self, start: PlanarPose, goals: list[PlanarPose]) -> float:
        """Return the length of the shortest walk to the nearest of some places, meters; inf without one."""
        best = math.inf
        for goal in sorted(goals, key=lambda goal: math.dist(start[:2], goal[:2])):
            if math.dist(start[:2], goal[:2]) >= best:
                break
            best = min(best, self._length(start, goal))
        return best

    def _length(self, start: PlanarPose, goal: PlanarPose) -> float:
        if (start, goal) not in self._lengths:
            length = math.inf
            if self.paths.connected(start, goal):
                if goal not in self._fields:
                    self._fields[goal] = LengthsTo(self.paths, goal)
                length = self._fields[goal].at(*start[:2])
            self._lengths[start, goal] = length
        return self._lengths[start, goal]

    @cached_property
    def _lengths(self) -> dict[tuple[PlanarPose, PlanarPose], float]:
        """Lengths of walks that have been computed."""
        return {}

    @cached_property
    def _fields(self) -> dict[PlanarPose, LengthsTo]:
        """Searches from places to which walks lead."""
        return {}

    @cached_property
    def exits(self) -> list[PlanarPose]:
        """Places just inside the doors that lead out of the floor."""
        poses = [entrance.pose for entrance in self.arrangement.building.entrances if entrance.exit]
        return [(x - INSIDE * math.sin(yaw), y + INSIDE * math.cos(yaw), yaw) for x, y, yaw in poses]
