"""Facility warnings: pieces that a repair has moved go where they cause fewer."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Collection, Iterator
from itertools import chain, islice

from labgym.layouts.adjust import swaps
from labgym.layouts.moves import apply, may_move
from labgym.layouts.placement import FLOOR
from labgym.layouts.repairs.berths import berths
from labgym.layouts.repairs.changes import moved_furniture
from labgym.layouts.repairs.rank import State
from labgym.layouts.repairs.reinsertion import reinserted
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.rule import FacilityIssue
from labgym.layouts.rules.supplies import unsupplied

BERTHS = 40
"""Maximum number of poses tried for a piece that a warning concerns."""


def advised(before: State, state: State) -> State:
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
            if lacks_supply and len(unsupplied(Arrangement.of(candidate))) >= supply:
                continue
            proposed = state.with_layout_at_most(candidate, state.rank.cost)
            if proposed is not None and proposed.rank < state.rank and not rules_of(proposed) - rules_of(state):
                state = proposed
                break
    crowded = {item for issue in _open_warnings(before, state, touched) for item in issue.ids} & moved
    return reinserted(state, moved, crowded) if crowded else state


def warned(before: State, state: State) -> bool:
    """Whether a facility warning is new and names a piece that the repair has moved."""
    moved = moved_furniture(before.layout, state.layout)
    return any(_is_new(issue, before) and not moved.isdisjoint(issue.ids) for issue in state.assessment.warnings)


def rules_of(state: State) -> Counter[str]:
    """Return the rules of the facility warnings with the number of warnings."""
    return Counter(issue.rule for issue in state.assessment.warnings)


def _standing_wrong(state: State) -> Iterator[str]:
    """Yield the floor objects that take part in a fault themselves, not only by what stands on them."""
    layout, assessment = state.layout, state.assessment
    groups: list[tuple[str, ...]] = [(fault.id,) for fault in assessment.bounds]
    groups += [collision.ids for collision in assessment.collisions]
    groups += [issue.ids for issue in assessment.errors if issue.rule != "egress"]
    for ids in groups:
        if all(layout.placement(item).support == FLOOR for item in ids):
            yield from ids


def _open_warnings(before: State, state: State, touched: Collection[str]) -> list[FacilityIssue]:
    """Return the warnings that are new, or that name a piece which the repair may move."""
    return [
        issue for issue in state.assessment.warnings if _is_new(issue, before) or not set(issue.ids).isdisjoint(touched)
    ]


def _is_new(issue: FacilityIssue, before: State) -> bool:
    return all(issue.message != other.message for other in before.assessment.warnings)
