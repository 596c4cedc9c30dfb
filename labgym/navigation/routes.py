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


class RouteMeter:
    """Measures drives of one floor plan.

    Args:
        plan: the layout.
        radius: radius of the disc that drives, meters.
    """

    def __init__(self, plan: FloorPlan, radius: float = PLANNING_RADIUS) -> None:
        self._paths, self._gaps = ShortestPaths(plan, radius), Gaps(plan)

    def measures(self, pair: GoalPair) -> RouteMeasures | None:
        """Return the measures of a goal pair, None if no path exists."""
        path = self._paths.path(pair.start, pair.goal)
        if path is None:
            return None
        straight = math.dist(pair.start[:2], pair.goal[:2])
        neck, widest = self._gaps.narrowest(path.points), self._gaps.widest(path.points)
        return RouteMeasures(path.length, straight, neck, widest)


def route_measures(
    plan: FloorPlan, pairs: Iterable[GoalPair], radius: float = PLANNING_RADIUS
) -> tuple[RouteMeasures | None, ...]:
    """Return the measures of each goal pair, None for one without a path.

    Args:
        plan: the layout.
        pairs: goal pairs, as from `goal_pairs`.
        radius: radius of the disc that drives, meters.
    """
    meter = RouteMeter(plan, radius)
    return tuple(meter.measures(pair) for pair in pairs)
