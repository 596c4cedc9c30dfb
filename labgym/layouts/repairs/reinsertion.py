"""Furniture that took each other's places: all of it is taken out and put back piece by piece, the hardest first."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from itertools import chain

from labgym.layouts.model import FLOOR, Layout
from labgym.layouts.moves import Place, apply, descendants, may_move
from labgym.layouts.relocation import free_places
from labgym.layouts.repairs.furniture import blame, elsewhere
from labgym.layouts.repairs.rank import State
from labgym.layouts.rules.egress import narrow_exits
from labgym.layouts.rules.facility import supply_issues
from labgym.layouts.rules.objective import evaluate_layout

Faults = tuple[int, int, int]
MOST = 8
"""Maximum number of pieces that are taken out."""
ORDERS = 4
"""Maximum number of orders in which they are put back."""
PLACES, SPACE_PLACES = 40, 12
"""Maximum number of free places tried for a piece: in its space, and in each of the others."""

STEP = 0.01
"""Spacing of the places tried along walls, meters: the gaps from which pieces were taken are hardly wider than they."""


def reinserted(state: State, moved: Collection[str], first: Collection[str] = ()) -> State:
    """Return the state after furniture was taken out and put back at free places, one piece after the other.

    The largest piece comes first. A piece that finds no place comes before all others in the next attempt, for a
    smaller one has taken the only place that suits it.

    Args:
        moved: ids of pieces that the repair has moved; they are taken out together with those that cause faults.
        first: ids of pieces of these that choose before all others.
    """
    guilty = blame(state)
    pieces = [
        piece
        for piece in sorted({*guilty, *moved}, key=lambda piece: (-guilty[piece], piece))
        if piece in state.layout.by_id and state.layout.placement(piece).support == FLOOR
        if may_move(state.layout, piece)
    ][:MOST]
    area = {piece: state.layout.asset(piece).size.width * state.layout.asset(piece).size.depth for piece in pieces}
    order = sorted(pieces, key=lambda piece: (piece not in first, -area[piece], piece))
    for _ in range(ORDERS if order else 0):
        layout, homeless = _put_back(state, order)
        if layout is not None:
            proposed = state.with_layout(layout)
            return proposed if proposed.rank < state.rank else state
        if homeless == order[0]:
            break
        order = [homeless, *(piece for piece in order if piece != homeless)]
    return state


def _put_back(state: State, order: Sequence[str]) -> tuple[Layout | None, str]:
    """Return the layout with all pieces at free places; or None, and the piece that found no place."""
    waiting = list(order)
    least = _faults(state, _without(state.layout, waiting))
    standing = state.layout
    while waiting:
        piece = waiting.pop(0)
        present = _without(standing, waiting)
        place = _place(state, present, piece, least)
        if place is None:
            return None, piece
        standing, least = apply(standing, place), _faults(state, apply(present, place))
    return standing, ""


def _place(state: State, layout: Layout, piece: str, least: Faults) -> Place | None:
    """Return the nearest place of a piece without a fault more, and if there is one also within reach of services."""
    second = None
    for place in chain(free_places(layout, piece, PLACES, STEP), elsewhere(layout, piece, SPACE_PLACES)):
        cost, narrow, unsupplied = _faults(state, apply(layout, place))
        if cost <= least[0] and narrow <= least[1]:
            if unsupplied <= least[2]:
                return place
            second = second if second is not None else place
    return second


def _faults(state: State, layout: Layout) -> Faults:
    """Return the cost of a layout without ways, the number of narrow exits, and of pieces beyond a service's reach."""
    assessment = evaluate_layout(layout, state.protocol, state.profile)
    narrow = len(narrow_exits(assessment.arrangement)) if state.navigation else 0
    return assessment.cost, narrow, len(supply_issues(assessment.arrangement))


def _without(layout: Layout, pieces: Sequence[str]) -> Layout:
    """Return the layout without some pieces and what stands on them."""
    gone = {item for piece in pieces for item in (piece, *descendants(layout, piece))}
    return layout.replace(placements=tuple(item for item in layout.placements if item.id not in gone))
