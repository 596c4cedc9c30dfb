"""The global planner: a taut path on the costmap, replanned when something blocks it."""

from __future__ import annotations

import numpy as np

from labgym.geometry import Array
from labgym.navigation import Pose
from labgym.policies.grid_planner import GridPlanner, PlannerOptions
from labgym.policies.stack.costmap import Costmap
from labgym.policies.tracking import lengths_along, points_at

PLANNING_RADII_M = (0.31, 0.275)
"""Clearances to plan with, meters: the second, hardly more than the chassis, where the first finds no path."""
COMFORT_M, AVERSION = 0.55, 1.0
END_SHIFT_M = 0.45
"""Distance by which an end that is not free may be moved, meters."""
BLOCKED_CLEARANCE_M = 0.265
"""A path with less clearance than this is blocked, meters."""
PLAN_SPACING_M = 0.05
"""Distance between the points of a plan, meters."""
CHECKED_AHEAD_M = 4.0
"""Length of the path ahead that is checked, meters."""


class PlannedPath:
    """A path that the robot follows.

    Args:
        path: (n, 2) meters in the map's frame.

    Attributes:
        points: (n, 2) at even steps of 5 cm.
        left: (n,) length of the path after each point, meters.
    """

    def __init__(self, path: Array) -> None:
        length = lengths_along(path)[-1]
        along = np.linspace(0.0, length, max(2, round(length / PLAN_SPACING_M) + 1))
        self.points: Array = points_at(path, along)
        self.left: Array = length - along
        self._place = 0

    def advance(self, pose: Pose) -> None:
        """Move the robot's place on the path to the nearest point within the next meter."""
        nearby = self.points[self._place : self._place + round(1.0 / PLAN_SPACING_M)] - np.array(pose[:2])
        self._place += int(np.argmin((nearby**2).sum(axis=1)))

    def ahead(self, length: float) -> tuple[Array, Array]:
        """Return the points of the path ahead up to a length, (m, 2), and the length left after each, (m,)."""
        chosen = slice(self._place, self._place + max(2, round(length / PLAN_SPACING_M)))
        return self.points[chosen], self.left[chosen]

    def offset(self, pose: Pose) -> float:
        """Return the distance of the robot from its place on the path, meters."""
        return float(np.linalg.norm(self.points[self._place] - np.array(pose[:2])))

    @property
    def remaining(self) -> float:
        """Length of the path ahead, meters."""
        return float(self.left[self._place])

    def blocked(self, costmap: Costmap, least: float = BLOCKED_CLEARANCE_M) -> bool:
        """Return whether the next meters of the path have less clearance than `least`, meters.

        What is so near to both ends that a disc cannot keep away does not count.
        """
        points, _ = self.ahead(CHECKED_AHEAD_M)
        inner = points[6:-6]
        return len(inner) > 0 and bool((costmap.clearance(inner) < least).any())


def planned(costmap: Costmap, start: Pose, goal: tuple[float, float]) -> PlannedPath | None:
    """Return a plan from a pose to a goal, meters in the map's frame; None if even the map leaves no path.

    If guesses close every way, the plan ignores them; if marks do, it ignores them, too: what stands there may leave.
    """
    for marks, guesses in ((True, True), (True, False), (False, False)):
        grid, clearance = costmap.everywhere(np.array([start[:2], goal]), marks, guesses)
        for radius in PLANNING_RADII_M:
            options = PlannerOptions(radius, COMFORT_M, AVERSION, END_SHIFT_M)
            path = GridPlanner(grid, options, clearance=clearance).plan(start[:2], goal)
            if path is not None:
                return PlannedPath(path)
    return None
