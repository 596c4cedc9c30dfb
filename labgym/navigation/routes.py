"""How long, how far around and how narrow the drives of a layout are."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from labgym.navigation.gaps import Gaps
from labgym.navigation.goals import GoalPair
from labgym.navigation.plan import PLANNING_RADIUS, FloorPlan
from labgym.navigation.visibility import ShortestPaths


@dataclass(frozen=True)
class RouteMeasures:
    """Measures of one drive.

    Attributes:
        length: length of the shortest path L*, meters.
        straight: distance from start to goal, meters.
        neck: width of the narrowest gap that the shortest path passes, meters; at most `WIDEST` (3 m).
        widest_neck: width of the narrowest gap on the widest way from start to goal, meters; at most `WIDEST`.
    """

    length: float
    straight: float
    neck: float
    widest_neck: float

    @property
    def detour(self) -> float:
        """Length of the shortest path as a multiple of the distance from start to goal; 1 for no distance."""
        return self.length / self.straight if self.straight > 0.0 else 1.0


def route_measures(
    plan: FloorPlan, pairs: Iterable[GoalPair], radius: float = PLANNING_RADIUS
) -> tuple[RouteMeasures | None, ...]:
    """Return the measures of each goal pair, None for one without a path.

    Args:
        plan: the layout.
        pairs: goal pairs, as from `goal_pairs`.
        radius: radius of the disc that drives, meters.
    """
    paths, gaps = ShortestPaths(plan, radius), Gaps(plan)
    return tuple(_measured(paths, gaps, pair) for pair in pairs)


def _measured(paths: ShortestPaths, gaps: Gaps, pair: GoalPair) -> RouteMeasures | None:
    path = paths.path(pair.start, pair.goal)
    if path is None:
        return None
    straight = math.dist(pair.start[:2], pair.goal[:2])
    return RouteMeasures(path.length, straight, gaps.narrowest(path.points), gaps.widest(path.points))
