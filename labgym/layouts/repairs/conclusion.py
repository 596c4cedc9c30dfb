"""The end of a repair: wider ways, objects put back that need not have moved, fewer warnings."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Collection, Iterator
from itertools import chain, islice

from labgym.layouts.adjust import swaps
from labgym.layouts.model import Layout
from labgym.layouts.moves import Command, Move, apply, may_move, replaced
from labgym.layouts.placement import FLOOR
from labgym.layouts.relocation import free_places
from labgym.layouts.repairs.berths import berths
from labgym.layouts.repairs.changes import moved_furniture, moved_ids
from labgym.layouts.repairs.rank import RepairState, narrowness
from labgym.layouts.repairs.reinsertion import reinserted
from labgym.layouts.repairs.resettling import lying, taken_down
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.egress import MARGIN, NarrowWay, narrow_ways
from labgym.layouts.rules.rule import FacilityIssue
from labgym.layouts.rules.supplies import unsupplied
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


def widened(state: RepairState, first: Collection[str] = ()) -> RepairState:
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


def _wider(best: RepairState, layout: Layout) -> RepairState | None:
    """Return the state of a layout if it has fewer faults than the best one or wider ways, else None."""
    if not best.rank.cost and narrowness(Arrangement.of(layout, best.assessment.arrangement)) >= best.rank.narrow:
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


MOST = 60
"""Maximum number of objects that are tried."""


def economical(before: RepairState, after: RepairState) -> RepairState:
    """Return a state that is at least as good as the later one, with more objects where they were before.

    Each object that moved by itself is put back with everything on it, unless the rank gets worse, or it lay where it
    does not belong.
    """
    astray = {*lying(before.layout), *taken_down(before.layout)}
    for item in [item for item in moved_ids(before.layout, after.layout) if item not in astray][:MOST]:
        layout = _put_back(before.layout, after.layout, item)
        if layout is None:
            continue
        proposed = after.with_layout(layout)
        if proposed.rank <= after.rank:
            after = proposed
    return after


def _put_back(before: Layout, after: Layout, item: str) -> Layout | None:
    """Return the later layout with an object, and what stands on it in both layouts, where they were before."""
    earlier, later = before.placement(item), after.placement(item)
    if earlier.support != later.support and earlier.support in after.by_id:
        base = after.placement(earlier.support)
        if base != before.placement(earlier.support):
            return None
    changed = {item: earlier}
    waiting = [item]
    while waiting:
        support = waiting.pop()
        for child in after.children(support):
            origin = before.by_id.get(child.id)
            if origin is None or origin.support != support:
                return None
            changed[child.id] = origin
            waiting.append(child.id)
    return replaced(after, changed)


BERTHS = 40
"""Maximum number of poses tried for a piece that a warning concerns."""


def advised(before: RepairState, state: RepairState) -> RepairState:
    """Return the state after pieces went where they cause fewer facility warnings.

    Only what the repair has moved goes elsewhere, and of what stood wrong before, or is named by a new warning, those
    pieces that a warning names.
    """
    moved = moved_furniture(before.layout, state.layout)
    touched = moved | set(_standing_wrong(before))
    touched |= {item for issue in state.assessment.warnings if _is_new(issue, before) for item in issue.ids}
    named = {item for issue in _open_warnings(before, state, touched) for item in issue.ids}
    for item in sorted(moved | (touched & named), key=lambda item: (item not in named, item)):
        warnings = _open_warnings(before, state, touched)
        if not any(item in issue.ids or (item in moved and _is_new(issue, before)) for issue in warnings):
            continue
        if state.layout.placement(item).support != FLOOR or not may_move(state.layout, item):
            continue
        places = islice(berths(state.layout, item), BERTHS)
        lacks_supply = any(item in issue.ids and issue.rule == "supply" for issue in warnings)
        supply = len(unsupplied(state.assessment.arrangement)) if lacks_supply else math.inf
        for command in chain(places, swaps(state.layout, item) if item in named else ()):
            candidate = apply(state.layout, command)
            if lacks_supply and len(unsupplied(Arrangement.of(candidate, state.assessment.arrangement))) >= supply:
                continue
            proposed = state.with_layout_at_most(candidate, state.rank.cost)
            if proposed is not None and proposed.rank < state.rank and not rules_of(proposed) - rules_of(state):
                state = proposed
                break
    crowded = {item for issue in _open_warnings(before, state, touched) for item in issue.ids} & moved
    return reinserted(state, moved, crowded) if crowded else state


def warned(before: RepairState, state: RepairState) -> bool:
    """Whether a facility warning is new and names a piece that the repair has moved."""
    moved = moved_furniture(before.layout, state.layout)
    return any(_is_new(issue, before) and not moved.isdisjoint(issue.ids) for issue in state.assessment.warnings)


def rules_of(state: RepairState) -> Counter[str]:
    """Return the rules of the facility warnings with the number of warnings."""
    return Counter(issue.rule for issue in state.assessment.warnings)


def _standing_wrong(state: RepairState) -> Iterator[str]:
    """Yield the floor objects that take part in a fault themselves, not only by what stands on them."""
    layout, assessment = state.layout, state.assessment
    groups: list[tuple[str, ...]] = [(fault.id,) for fault in assessment.bounds]
    groups += [collision.ids for collision in assessment.collisions]
    groups += [issue.ids for issue in assessment.errors if issue.rule != "egress"]
    for ids in groups:
        if all(layout.placement(item).support == FLOOR for item in ids):
            yield from ids


def _open_warnings(before: RepairState, state: RepairState, touched: Collection[str]) -> list[FacilityIssue]:
    """Return the warnings that are new, or that name a piece which the repair may move."""
    return [
        issue for issue in state.assessment.warnings if _is_new(issue, before) or not set(issue.ids).isdisjoint(touched)
    ]


def _is_new(issue: FacilityIssue, before: RepairState) -> bool:
    return all(issue.message != other.message for other in before.assessment.warnings)
