"""Ways out that are too narrow: furniture near the places that they do not reach moves a little, or elsewhere."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator
from itertools import chain, islice

from labgym.layouts.model import Layout
from labgym.layouts.moves import Command, Move, apply, may_move
from labgym.layouts.placement import FLOOR
from labgym.layouts.relocation import free_places
from labgym.layouts.repairs.rank import State, narrowness
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.egress import MARGIN, NarrowWay, narrow_ways
from labgym.layouts.rules.thresholds import EGRESS_WIDTH, MOVABLE
from labgym.navigation import goal_pose

NEAR = 3.0
"""Furniture within this distance of a place that no way reaches may move, meters."""
MARGINS = (0.03, 0.15)
"""Added to the width that a way lacks, meters."""
PLACES = 2
"""Maximum number of free places tried for a piece."""
TRIALS = 48
"""Maximum number of commands verified for one update."""
UPDATES = 4


def widened(state: State, first: Collection[str] = ()) -> State:
    """Return the state after furniture was moved out of ways that are too narrow, as long as that helps.

    Args:
        first: ids of pieces that go to other places before any other piece is tried.
    """
    for _ in range(UPDATES):
        narrow = narrow_ways(state.assessment.arrangement, margin=MARGIN, leaves=True) if state.navigation else []
        if not narrow:
            break
        best = state
        others = islice(_commands(state.layout, narrow), TRIALS)
        for command in chain(_other_places(state.layout, first), others):
            proposed = _wider(best, apply(state.layout, command))
            if proposed is not None:
                best = proposed
                if not best.rank.narrow:
                    break
        if best is state:
            break
        state = best
    return state


def _wider(best: State, layout: Layout) -> State | None:
    """Return the state of a layout if it has fewer faults than the best one or wider ways, else None."""
    if not best.rank.cost and narrowness(Arrangement.of(layout)) >= best.rank.narrow:
        return None
    proposed = best.with_layout_at_most(layout, best.rank.cost)
    return proposed if proposed is not None and proposed.rank.clears(best.rank) else None


def _other_places(layout: Layout, items: Collection[str]) -> Iterator[Command]:
    for item in sorted(items):
        if layout.placement(item).support == FLOOR and may_move(layout, item):
            yield from free_places(layout, item)


def _commands(layout: Layout, narrow: list[NarrowWay]) -> Iterator[Command]:
    """Yield moves of the furniture near the places that ways do not reach, the nearest pieces first."""
    least = min(narrow, key=lambda way: len(way.destinations))
    goals = [goal_pose(layout.box(item))[:2] for item in least.destinations]
    near = []
    for placement in layout.placements:
        if placement.support == FLOOR and layout.asset(placement.id).subtype not in MOVABLE:
            way = min(math.dist(placement.position[:2], goal) for goal in goals)
            if way <= NEAR and may_move(layout, placement.id):
                near.append((way, placement.id))
    lacking = max(EGRESS_WIDTH - least.width, 0.0)
    for margin in MARGINS:
        for _, item in sorted(near):
            yaw, distance = layout.placement(item).yaw, lacking + margin
            for quarter in range(4):
                angle = yaw + quarter * math.pi / 2.0
                yield Move(item, round(distance * math.cos(angle), 6), round(distance * math.sin(angle), 6))
        if margin == MARGINS[0]:
            for _, item in sorted(near):
                yield from free_places(layout, item, PLACES)
