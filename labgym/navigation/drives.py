"""Drives of a floor: how long, how far around and how narrow they are, and which pairs are drawn."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from labgym.navigation.gaps import Gaps
from labgym.navigation.goals import GoalPair, Pose, same_place
from labgym.navigation.plan import PLANNING_RADIUS, FloorPlan
from labgym.navigation.visibility import ShortestPaths

SHORTEST = 2.0
"""Least length of the shortest path, meters: four success radii."""
DETOUR = 1.1
"""Pairs with at least this detour are always accepted (Habitat's threshold for PointNav episodes)."""
STRAIGHT = 0.25
"""Probability that a straighter pair is accepted. Habitat's is 0.01 to 0.14."""


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


@dataclass(frozen=True)
class TriedPair:
    """A pair that was drawn, and whether it was accepted.

    Attributes:
        pair: start and goal; accepted ones are numbered in their order, the others have the index -1.
        measures: its measures; None if no path exists.
        accepted: whether it is a drive of the floor.
    """

    pair: GoalPair
    measures: RouteMeasures | None
    accepted: bool


def acceptance(measures: RouteMeasures | None) -> float:
    """Return the probability with which a pair is accepted."""
    if measures is None or measures.length < SHORTEST:
        return 0.0
    return 1.0 if measures.detour >= DETOUR else STRAIGHT


def draw_drives(
    plan: FloorPlan,
    entries: Mapping[str, Pose],
    goals: Mapping[str, Pose],
    count: int,
    generator: np.random.Generator,
    radius: float = PLANNING_RADIUS,
) -> tuple[TriedPair, ...]:
    """Draw pairs without replacement until `count` are accepted or none is left; return all that were tried.

    The pairs lead from every entry and every goal to every other goal, each with the same probability.

    Args:
        plan: the layout.
        entries: start poses at the exits, by name.
        goals: goal poses, by location.
        count: number of pairs to accept.
        generator: draws the order of the pairs and accepts them.
        radius: radius of the disc that drives, meters.
    """
    pairs = [
        (start, goal, here, there)
        for here, start in {**entries, **goals}.items()
        for there, goal in goals.items()
        if not same_place(start, goal)
    ]
    meter = RouteMeter(plan, radius)
    tried: list[TriedPair] = []
    accepted = 0
    for k in generator.permutation(len(pairs)):
        if accepted == count:
            break
        pair = GoalPair(-1, *pairs[int(k)])
        measures = meter.measures(pair)
        chosen = bool(generator.random() < acceptance(measures))
        if chosen:
            pair = GoalPair(accepted, *pairs[int(k)])
            accepted += 1
        tried.append(TriedPair(pair, measures, chosen))
    return tuple(tried)
