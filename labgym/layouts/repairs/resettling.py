"""Items and wall units return to where they belong: surfaces, cabinets, their apparatus, walls."""

from __future__ import annotations

from collections.abc import Iterator

from labgym.assets.plausibility import size_problem
from labgym.layouts.fitting import Keepouts, on_wall
from labgym.layouts.model import Layout
from labgym.layouts.moves import Place, apply, lifted, may_move, replaced
from labgym.layouts.placement import FLOOR, WALL
from labgym.layouts.repairs.rank import RepairState
from labgym.layouts.rules.rule import Instance
from labgym.layouts.settling import free_spots, homes
from labgym.protocols import Protocol

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


def resettled(state: RepairState) -> RepairState:
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


def _put_back(state: RepairState) -> Layout:
    """Return the layout with each item that lies on the floor on the first free spot where it belongs."""
    layout = state.layout
    for item in (item for item in _out_of_place(state) if item in lying(state.layout)):
        layout = next(_candidates(state, layout, item), layout)
    return layout


def _out_of_place(state: RepairState) -> list[str]:
    """Return the items in question: those that stand nowhere, the largest first, then those that overlap, reversed."""
    layout = state.layout
    nowhere = {fault.id for fault in state.assessment.bounds} | set(lying(layout))
    items = [item for item in dict.fromkeys((*lying(layout), *_faulty(state))) if may_move(layout, item)]
    area = {item: layout.box(item).width * layout.box(item).depth for item in items}
    return sorted(items, key=lambda item: (0, -area[item], item) if item in nowhere else (1, area[item], item))


def _faulty(state: RepairState) -> list[str]:
    """Return the items on surfaces that violate a rule by themselves, and not because their furniture does."""
    assessment, layout = state.assessment, state.layout
    ids = [fault.id for fault in assessment.bounds if fault.cause != "room"]
    for collision in assessment.collisions:
        first, second = (layout.root(item).id for item in collision.ids)
        ids += collision.ids if first == second else ()
    ids += [item for instance in assessment.instances if instance.hard for item in instance.ids]
    return [item for item in dict.fromkeys(ids) if layout.placement(item).support not in (FLOOR, WALL)]


def _on_better_spot(state: RepairState, item: str) -> RepairState:
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


def _candidates(state: RepairState, layout: Layout, item: str) -> Iterator[Layout]:
    for support, slot in homes(layout, item, state.protocol):
        for spot in free_spots(layout, item, support, slot, state.profile, most=2):
            yield apply(layout, spot)


def taken_down(layout: Layout) -> tuple[str, ...]:
    """Return the ids of the wall units that do not hang on a wall; scaled ones belong where they stand."""
    return tuple(
        placement.id
        for placement in layout.placements
        if placement.support != WALL and placement.size is None and layout.asset(placement.id).placing == "wall"
    )


def hung(state: RepairState) -> RepairState:
    """Return the state after each wall unit that has left its wall went to the nearest free place, the widest first."""
    units = taken_down(state.layout)
    for item in sorted(units, key=lambda unit: (-state.layout.asset(unit).size.width, unit)):
        layout = _hung(state.layout, item, state.protocol) if may_move(state.layout, item) else None
        if layout is not None:
            proposed = state.with_layout(layout)
            state = proposed if proposed.rank.cost <= state.rank.cost else state
    return state


def _hung(layout: Layout, item: str, protocol: Protocol | None) -> Layout | None:
    here = layout.placement(item)
    rest = layout.replace(placements=tuple(placement for placement in layout.placements if placement.id != item))
    place = on_wall(rest, layout.asset(item), Keepouts.of(layout, protocol), here.position[:2])
    if place is None:
        return None
    x, y, z = place.position
    moved = lifted(apply(layout, Place(item, x, y, place.yaw)), item, z)
    return replaced(moved, {item: moved.placement(item).model_copy(update={"support": WALL, "slot": None})})


def gathered(state: RepairState) -> RepairState:
    """Return the state after the pieces of each apparatus went to one piece of furniture, if that helps.

    Only some rule sets have such rules: one by one the pieces would stay apart. Vessels go to their hood, with the
    pieces of their apparatus; other pieces to the furniture of one of them.
    """
    for instance in _apart(state):
        if instance not in _apart(state):
            continue  # Another apparatus has brought it along.
        best = state
        for target in _targets(state.layout, instance):
            layout = _moved_to(state, _group(state, instance), target)
            proposed = state.with_layout_at_most(layout, best.rank.cost)
            if proposed is not None and proposed.rank < best.rank:
                best = proposed
        state = best
    return state


def _apart(state: RepairState) -> list[Instance]:
    return [one for one in state.assessment.instances if one.hard and one.rule in ("near", "ventilation")]


def _targets(layout: Layout, instance: Instance) -> list[str]:
    """Return the furniture to which the pieces may go: the hood of vessels, else the furniture of each piece."""
    pieces = instance.ids[:1] if instance.rule == "ventilation" else instance.ids
    return list(dict.fromkeys(layout.root(piece).id for piece in pieces))


def _group(state: RepairState, instance: Instance) -> list[str]:
    """Return the pieces concerned, and those that the protocol requires near them; each with what carries it."""
    layout = state.layout
    pairs = [set(one.ids) for one in state.assessment.instances if one.rule == "near" and len(one.ids) == 2]
    group = {piece for piece in instance.ids if layout.placement(piece).support not in (FLOOR, WALL)}
    for _ in pairs:
        group |= {piece for pair in pairs if pair & group for piece in pair}
    bases = {_base(layout, piece) for piece in group if layout.placement(piece).support not in (FLOOR, WALL)}
    area = {piece: layout.box(piece).width * layout.box(piece).depth for piece in bases}
    return sorted((piece for piece in bases if may_move(layout, piece)), key=lambda piece: (-area[piece], piece))


def _base(layout: Layout, piece: str) -> str:
    """Return the object that carries a piece and stands on furniture itself, such as its stand; or the piece."""
    while layout.placement(layout.placement(piece).support).support not in (FLOOR, WALL):
        piece = layout.placement(piece).support
    return piece


def _moved_to(state: RepairState, group: list[str], target: str) -> Layout:
    """Return the layout with pieces on the nearest free spots of some furniture, as far as it has any."""
    layout = state.layout
    for piece in group:
        if layout.root(piece).id != target:
            spot = next(_spots(state, layout, piece, target), None)
            layout = layout if spot is None else spot
    return layout


def _spots(state: RepairState, layout: Layout, piece: str, target: str) -> Iterator[Layout]:
    for slot in range(len(layout.asset(target).surfaces)):
        for spot in free_spots(layout, piece, target, slot, state.profile, most=1):
            yield apply(layout, spot)
