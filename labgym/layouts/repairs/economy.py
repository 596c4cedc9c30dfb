"""Least change: what a repair moved without need is put back."""

from __future__ import annotations

from labgym.layouts.model import Layout
from labgym.layouts.moves import replaced
from labgym.layouts.repairs.changes import moved_ids
from labgym.layouts.repairs.hanging import taken_down
from labgym.layouts.repairs.rank import State
from labgym.layouts.repairs.resettling import lying

MOST = 60
"""Maximum number of objects that are tried."""


def economical(before: State, after: State) -> State:
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
