"""The furniture and the walls of a floor plan, from which a disc keeps its distance."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labgym.navigation.clearance import Obstacles
from labgym.navigation.plan import OBSTACLE_HEIGHT, FloorPlan, FloorShape

Array = NDArray[np.float64]

DIRECTIONS = 8
"""Number of directions in which a disc is looked up on the floor."""


@dataclass(frozen=True, eq=False)
class Barriers:
    """The barriers of a floor plan.

    Attributes:
        obstacles: the rectangles: furniture, and on any floor but a single rectangular room walls and columns.
        low, high: (2,) corners of a rectangle around the floor, meters.
        floor: walls and spaces. Of a single rectangular room only the size counts: `low` and `high` are then its
            corners, and the sides between them its walls.
    """

    obstacles: Obstacles
    low: Array
    high: Array
    floor: FloorShape

    @classmethod
    def of(cls, plan: FloorPlan, below: float = OBSTACLE_HEIGHT) -> Barriers:
        """Return the barriers of a floor plan; objects whose bottom is above a height in meters are ignored."""
        floor, boxes = plan.floor, list(plan.obstacles(below))
        if floor.is_rectangle:
            low, high = np.zeros(2), np.array([floor.room.width, floor.room.depth])
        else:
            bounds = np.array(floor.bounds, dtype=np.float64)
            low, high = bounds[:2], bounds[2:]
            boxes += [box for box in floor.solids if box.z0 < below]
        return cls(Obstacles(boxes), low, high, floor)

    def clearance(self, points: Array) -> Array:
        """Return the distance from points (m, 2) of the floor to the nearest barrier, (m,) meters.

        It is 0 in an obstacle, and negative beyond the walls of a one-room floor.
        """
        nearest = self.obstacles.nearest(points)
        if not self.floor.is_rectangle:
            return nearest
        return np.asarray(np.minimum(nearest, np.minimum(points, self.high - points).min(axis=1)))

    def line_clearance(self, points: Array) -> float:
        """Return the least distance from a polyline (n, 2) on the floor to a barrier, meters; as `clearance`."""
        nearest = float(self.obstacles.segment_distances(points[:-1], points[1:]).min(initial=math.inf))
        if not self.floor.is_rectangle:
            return nearest
        return min(nearest, float(points.min()), float((self.high - points).min()))

    def inside(self, points: Array) -> NDArray[np.bool_]:
        """Whether points (m, 2) lie in a room, or in an opening between rooms, (m,)."""
        if self.floor.is_rectangle:
            return np.asarray(((points > self.low) & (points < self.high)).all(axis=1))
        return self.floor.inside(points)

    def discs_inside(self, points: Array, radius: float) -> NDArray[np.bool_]:
        """Whether discs that touch no obstacle lie on the floor and not outside of its walls, (m,).

        Walls enclose the floor, so a disc that none of them cuts is on the floor with all of its points or with none;
        spaces may leave wedges along oblique walls, so several points of the disc are looked up.
        """
        if self.floor.is_rectangle:
            return np.ones(len(points), dtype=bool)
        inside = np.asarray(self.floor.inside(points))
        rest = np.flatnonzero(~inside)
        if len(rest):
            angle = np.arange(DIRECTIONS) * (2.0 * math.pi / DIRECTIONS)
            offsets = 0.9 * radius * np.column_stack([np.cos(angle), np.sin(angle)])
            samples = (points[rest, None, :] + offsets).reshape(-1, 2)
            inside[rest] = self.floor.inside(samples).reshape(len(rest), -1).any(axis=1)
        return inside
