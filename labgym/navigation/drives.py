"""Drives of a floor: pairs of a start and a goal, accepted by how long they are and how far around they lead."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from labgym.navigation.goals import GoalPair, Pose, same_place
from labgym.navigation.plan import PLANNING_RADIUS, FloorPlan
from labgym.navigation.routes import RouteMeasures, RouteMeter

SHORTEST = 2.0
"""Least length of the shortest path, meters: four success radii."""
DETOUR = 1.1
"""Pairs with at least this detour are always accepted (Habitat's threshold for PointNav episodes)."""
STRAIGHT = 0.25
"""Probability that a straighter pair is accepted. Habitat's is 0.01 to 0.14."""


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
