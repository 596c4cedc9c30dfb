"""Items return to surfaces: what hangs in the air, overlaps, lies on the floor, or is a reagent out of its cabinet."""

from __future__ import annotations

from collections.abc import Iterator

from labgym.assets.plausibility import size_problem
from labgym.layouts.model import Layout
from labgym.layouts.moves import apply, may_move
from labgym.layouts.placement import FLOOR, WALL
from labgym.layouts.repairs.rank import State
from labgym.layouts.settling import free_spots, homes

SPOTS = 8
"""Maximum number of free spots tried for an item."""
TOGETHER = 8
"""From this number on, items that lie on the floor are first put back together, with one assessment for all of them."""


def lying(layout: Layout) -> tuple[str, ...]:
    """Return the ids of the items that lie on the floor or hang on a wall, but belong on a surface.

    A piece that is as large as only floor-standing ones may be, such as a tall evaporator, belongs on the floor.
    """
    return tuple(
        placement.id
        for placement in layout.placements
        if placement.support in (FLOOR, WALL)
        and layout.asset(placement.id).placing == "desktop"
        and (placement.size is None or size_problem(layout.asset(placement.id), on_floor=False) is None)
    )


def resettled(state: State) -> State:
    """Return the state after each item that is out of place was put on the best free spot where it belongs.

    An item is out of place if it lies on the floor, is out of bounds, is a reagent out of storage, or overlaps another
    item; of two that overlap the smaller one moves, or the other if that does not help. Fixed items stay.
    """
    if len(lying(state.layout)) >= TOGETHER and not state.seeded:
        together = state.with_layout(_put_back(state))
        state = together if together.rank < state.rank else state
    for item in _out_of_place(state):
        if item in lying(state.layout) or item in _faulty(state):
            state = _on_better_spot(state, item)
    return state


def _put_back(state: State) -> Layout:
    """Return the layout with each item that lies on the floor on the first free spot where it belongs."""
    layout = state.layout
    for item in (item for item in _out_of_place(state) if item in lying(state.layout)):
        layout = next(_candidates(state, layout, item), layout)
    return layout


def _out_of_place(state: State) -> list[str]:
    """Return the items in question: those that stand nowhere, the largest first, then those that overlap, reversed."""
    layout = state.layout
    nowhere = {fault.id for fault in state.assessment.bounds} | set(lying(layout))
    items = [item for item in dict.fromkeys((*lying(layout), *_faulty(state))) if may_move(layout, item)]
    area = {item: layout.box(item).width * layout.box(item).depth for item in items}
    return sorted(items, key=lambda item: (0, -area[item], item) if item in nowhere else (1, area[item], item))


def _faulty(state: State) -> list[str]:
    """Return the items on surfaces that violate a rule by themselves, and not because their furniture does."""
    assessment, layout = state.assessment, state.layout
    ids = [fault.id for fault in assessment.bounds if fault.cause != "room"]
    for collision in assessment.collisions:
        first, second = (layout.root(item).id for item in collision.ids)
        ids += collision.ids if first == second else ()
    ids += [item for instance in assessment.instances if instance.hard for item in instance.ids]
    return [item for item in dict.fromkeys(ids) if layout.placement(item).support not in (FLOOR, WALL)]


def _on_better_spot(state: State, item: str) -> State:
    best = state
    must = item in lying(state.layout)
    for count, candidate in enumerate(_candidates(state, state.layout, item)):
        proposed = state.with_layout(candidate)
        if proposed.rank < best.rank or (must and best is state and proposed.rank.cost <= best.rank.cost):
            best = proposed
            if item not in _faulty(proposed) and proposed.rank.shortfall <= state.rank.shortfall:
                break
        if count + 1 >= SPOTS:
            break
    return best


def _candidates(state: State, layout: Layout, item: str) -> Iterator[Layout]:
    for support, slot in homes(layout, item, state.protocol):
        for spot in free_spots(layout, item, support, slot, state.profile, most=2):
            yield apply(layout, spot)
