"""Soft terms: a repaired layout without faults gets a higher fitness, with few objects moved."""

from __future__ import annotations

from itertools import islice

from labgym.layouts.repairs.rank import State
from labgym.layouts.repairs.safeguards import elsewhere

MOVES = 6
"""Maximum number of objects that move for soft terms alone."""
TRIALS = 40
"""Maximum number of layouts tried for an object."""
LEAST_GAIN = 1e-3
"""Least gain of the fitness F for which an object moves."""


def softened(state: State) -> State:
    """Return the state after objects of unsatisfied rules moved, each as far as that raises the fitness F.

    Only a layout without faults is changed. It stays without faults, its ways as wide and its warnings as few. The rule
    that is satisfied least comes first. At most 6 objects move, each only for a gain of 0.001 or more.
    """
    moved: set[str] = set()
    tried: set[str] = set()
    while state.rank.sound and len(moved) < MOVES:
        open_terms = sorted(
            (instance.satisfaction, item)
            for instance in state.assessment.instances
            if instance.satisfaction < 1.0
            for item in instance.ids
            if item in state.layout.by_id and item not in tried
        )
        if not open_terms:
            break
        item = open_terms[0][1]
        tried.add(item)
        better = _moved(state, item)
        if better is not state:
            moved.add(item)
            state = better
    return state


def _moved(state: State, item: str) -> State:
    """Return the state with an object at the best of the places tried; the same state if none is better."""
    best = state
    for layout in islice(elsewhere(state, item), TRIALS):
        proposed = state.with_layout_at_most(layout, state.rank.cost)
        if proposed is None or proposed.rank.missing or proposed.rank.shortfall > best.rank.shortfall - LEAST_GAIN:
            continue
        if proposed.rank.cost <= state.rank.cost and proposed.rank.keeps(state.rank):
            best = proposed
    return best
