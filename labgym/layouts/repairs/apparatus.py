"""Pieces that belong together go to one place: an apparatus that is apart, vessels that are outside of their hood."""

from __future__ import annotations

from collections.abc import Iterator

from labgym.layouts.model import Layout
from labgym.layouts.moves import apply, may_move
from labgym.layouts.placement import FLOOR, WALL
from labgym.layouts.repairs.rank import State
from labgym.layouts.rules.rule import Instance
from labgym.layouts.settling import free_spots


def gathered(state: State) -> State:
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


def _apart(state: State) -> list[Instance]:
    return [one for one in state.assessment.instances if one.hard and one.rule in ("near", "ventilation")]


def _targets(layout: Layout, instance: Instance) -> list[str]:
    """Return the furniture to which the pieces may go: the hood of vessels, else the furniture of each piece."""
    pieces = instance.ids[:1] if instance.rule == "ventilation" else instance.ids
    return list(dict.fromkeys(layout.root(piece).id for piece in pieces))


def _group(state: State, instance: Instance) -> list[str]:
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


def _moved_to(state: State, group: list[str], target: str) -> Layout:
    """Return the layout with pieces on the nearest free spots of some furniture, as far as it has any."""
    layout = state.layout
    for piece in group:
        if layout.root(piece).id != target:
            spot = next(_spots(state, layout, piece, target), None)
            layout = layout if spot is None else spot
    return layout


def _spots(state: State, layout: Layout, piece: str, target: str) -> Iterator[Layout]:
    for slot in range(len(layout.asset(target).surfaces)):
        for spot in free_spots(layout, piece, target, slot, state.profile, most=1):
            yield apply(layout, spot)
