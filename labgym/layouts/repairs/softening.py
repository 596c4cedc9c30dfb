"""Soft terms: a layout without faults gets a higher fitness and fewer warnings, with few objects moved or removed."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from itertools import islice

from labgym.layouts.model import Layout
from labgym.layouts.moves import apply, may_move, without
from labgym.layouts.placement import WALL
from labgym.layouts.repairs.rank import RepairState
from labgym.layouts.repairs.safeguards import elsewhere
from labgym.layouts.rules.objective import Assessment
from labgym.layouts.rules.rule import mean
from labgym.layouts.rules.safety.pieces import OPTIONAL, OPTIONAL_PIECES
from labgym.layouts.rules.safety.rules import RULES
from labgym.layouts.rules.whereabouts import resolved
from labgym.layouts.settling import free_spots, homes

MOVES = 6
"""Maximum number of objects that move for soft terms alone."""
ITEMS = 24
"""Maximum number of objects for which places are tried."""
TRIALS = 40
"""Maximum number of layouts tried for an object."""
LEAST_GAIN = 1e-3
"""Least gain of the fitness F for which an object moves."""
WALKS = frozenset({"shower_walk", *(rule.name for rule in RULES if rule.ways)})
"""Rules whose warnings are known only after walks are planned."""

Soft = tuple[int, float]
"""Number of warnings, and 1 - F."""


def softened(state: RepairState) -> Iterator[tuple[RepairState, str]]:
    """Yield the states after objects moved for soft terms, one by one, each with what it improves.

    The objects of unsatisfied rules move, the rule that is satisfied least first, then the objects that warnings name.
    Only a layout in which no object takes part in a fault is changed; its building may have faults. No fault is added,
    and its ways stay as wide. With each move F rises by 0.001 or more, or a warning disappears; neither gets worse. At
    most 6 objects move.
    """
    tried: set[str] = set()
    moves = 0
    while _in_order(state.assessment) and moves < MOVES and len(tried) < ITEMS:
        item = next((item for item in _open(state) if item not in tried), None)
        if item is None:
            return
        tried.add(item)
        better = _moved(state, item)
        if better is not None:
            yield better, improvement(state, better)
            moves, state = moves + 1, better


def without_surplus(state: RepairState) -> Iterator[tuple[RepairState, str]]:
    """Yield the states after optional pieces beyond their greatest number were removed, each with the reason.

    Empty pieces go first, of these the last one of the layout; the load of others is put elsewhere. Pieces that are
    fixed or that a protocol of the layout requires stay. A rule set without such a rule limits none.
    """
    if not any(rule is OPTIONAL for rule in state.assessment.rules.facility):
        return
    for role, most in OPTIONAL_PIECES.items():
        pieces = [p.id for p in reversed(state.layout.placements) if state.layout.asset(p.id).role == role]
        number, most = len(pieces), max(most, _required(state, role))
        for piece in sorted(pieces, key=lambda piece: len(state.layout.children(piece))):
            if number <= most:
                break
            smaller = _removed(state, piece)
            if smaller is not None:
                yield smaller, f"{number} {role} in one laboratory, at most {most} are useful"
                number, state = number - 1, smaller


def _in_order(assessment: Assessment) -> bool:
    """Whether nothing is missing and no object takes part in a fault."""
    concerned = [fault.ids for fault in assessment.violations.items] + [fault.ids for fault in assessment.errors]
    return not assessment.lacking and not any(concerned)


def improvement(before: RepairState, after: RepairState) -> str:
    """Return in words which soft terms of a layout are better than before."""
    gains = []
    for rule in dict.fromkeys(instance.rule for instance in after.assessment.instances):
        old, new = (
            mean([one for one in state.assessment.instances if one.rule == rule]) or 0.0 for state in (before, after)
        )
        if new > old + 1e-9:
            gains.append(f"mean satisfaction of {rule} {old:.3f} -> {new:.3f}")
    counts = [Counter(issue.rule for issue in state.assessment.advice) for state in (before, after)]
    gains += [f"{rule} warnings {counts[0][rule]} -> {counts[1][rule]}" for rule in sorted(counts[0] - counts[1])]
    return ", ".join(gains)


def _soft(assessment: Assessment, walks: bool = True) -> Soft:
    """Return the soft terms of a layout; without walks only those that need no ways."""
    warnings = sum(walks or issue.rule not in WALKS for issue in assessment.advice)
    return warnings, round(1.0 - assessment.fitness, 9)


def _open(state: RepairState) -> list[str]:
    """Return the objects of unsatisfied rules, the least satisfied first, then those that warnings name."""
    unsatisfied = sorted(
        (instance.satisfaction, item)
        for instance in state.assessment.instances
        if instance.satisfaction < 1.0
        for item in instance.ids
    )
    named = [item for issue in state.assessment.advice for item in issue.ids]
    return [item for item in dict.fromkeys([*(item for _, item in unsatisfied), *named]) if item in state.layout.by_id]


def _moved(state: RepairState, item: str) -> RepairState | None:
    """Return the state with an object at the best of the places tried; None if none is better."""
    best: RepairState | None = None
    least = _soft(state.assessment)
    walks = any(issue.rule in WALKS and item in issue.ids for issue in state.assessment.advice)
    standing = _soft(state.assessment, walks=False)
    places = (layout for layout in elsewhere(state, item) if _alike(state.layout, layout, item))
    for layout in islice(places, TRIALS):
        quick = state.assessed(layout, state.protocol)
        if quick.cost > state.rank.cost or not (walks or _gains(_soft(quick, walks=False), standing)):
            continue
        proposed = state.with_layout_at_most(layout, state.rank.cost)
        if proposed is None or proposed.rank.missing or not proposed.rank.keeps(state.rank):
            continue
        soft = _soft(proposed.assessment)
        if _gains(soft, least) and (best is None or soft < _soft(best.assessment)):
            best = proposed
            if item not in _open(best):
                break
    return best


def _alike(before: Layout, after: Layout, item: str) -> bool:
    """Whether an object stands on the same kind of furniture in two layouts."""
    supports = [(layout, layout.placement(item).support) for layout in (before, after)]
    kinds = [layout.asset(support).subtype if support in layout.by_id else support for layout, support in supports]
    return kinds[0] == kinds[1]


def _gains(soft: Soft, least: Soft) -> bool:
    """Whether a warning less, or a higher fitness, is reached and the other is no worse."""
    return soft[0] <= least[0] and soft[1] <= least[1] and (soft[0] < least[0] or soft[1] <= least[1] - LEAST_GAIN)


def _required(state: RepairState, role: str) -> int:
    """Return how many pieces of a role the protocols require."""
    protocols = [*state.layout.protocols, *([] if state.protocol is None else [state.protocol])]
    names = (resolved(protocol.required_assets(), state.layout.catalog) for protocol in protocols)
    return max((sum(state.layout.catalog.get(name).role == role for name in own) for own in names), default=0)


def _removed(state: RepairState, piece: str) -> RepairState | None:
    """Return the state without a piece, what stands on it put elsewhere; None if something gets worse."""
    layout: Layout | None = state.layout
    for child in state.layout.children(piece) if may_move(state.layout, piece) else ():
        layout = None if layout is None else _put_elsewhere(state, layout, child.id, piece)
    if layout is None or not may_move(state.layout, piece):
        return None
    proposed = state.with_layout_at_most(without(layout, [piece]), state.rank.cost)
    if proposed is None or proposed.rank.missing > state.rank.missing or not proposed.rank.keeps(state.rank):
        return None
    return proposed if proposed.rank.shortfall <= state.rank.shortfall else None


def _put_elsewhere(state: RepairState, layout: Layout, item: str, piece: str) -> Layout | None:
    """Return a layout with an item on the nearest free spot where it belongs, off a piece; None without one."""
    for support, slot in homes(layout, item, state.protocol):
        if layout.root(support).id == piece or layout.placement(support).support == WALL:
            continue
        for spot in free_spots(layout, item, support, slot, state.profile, most=1):
            return apply(layout, spot)
    return None
