"""Objects removed: safety equipment, or what the protocol requires."""

from __future__ import annotations

from collections.abc import Callable

from labgym.layouts.model import Layout
from labgym.layouts.moves import without
from labgym.layouts.placement import FLOOR, WALL
from labgym.paper.spoiling.objects import hoods_of, ids_where, required_of
from labgym.protocols import Protocol


def bare_necessities(layout: Layout, protocol: Protocol) -> Layout:
    """Keep only what the protocol requires, and what carries it."""
    kept = required_of(layout, protocol)
    kept |= {layout.root(each).id for each in kept}
    for each in list(kept):
        while layout.placement(each).support not in (FLOOR, WALL):
            each = layout.placement(each).support
            kept.add(each)
    return without(layout, [p.id for p in layout.placements if p.id not in kept])


def lacking(*roles: str) -> Callable[[Layout, Protocol], Layout]:
    """Return the way to spoil a layout that removes all objects of some roles."""

    def spoil(layout: Layout, _: Protocol) -> Layout:
        return without(layout, ids_where(layout, lambda _, a: a.role in roles))

    return spoil


def instrument_missing(layout: Layout, protocol: Protocol) -> Layout:
    """Remove all placements of one instrument that the protocol requires."""
    name = layout.catalog.find(protocol.instruments[0]).role
    return without(layout, ids_where(layout, lambda _, a: a.role == name))


def hood_missing(layout: Layout, _: Protocol) -> Layout:
    """Remove the hoods, with what is in them."""
    return without(layout, hoods_of(layout))
