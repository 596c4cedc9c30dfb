"""Ids of the objects that are spoilt, by kind, in the layout's order."""

from __future__ import annotations

from collections.abc import Callable

from labgym.assets import Asset
from labgym.layouts.model import Layout
from labgym.layouts.placement import FLOOR, WALL, Placement
from labgym.layouts.rules.separation import HEAT_CLASSES
from labgym.layouts.rules.storage import STORAGE_CLASSES
from labgym.layouts.rules.thresholds import MOVABLE
from labgym.layouts.rules.whereabouts import resolved
from labgym.protocols import Protocol


def ids_where(layout: Layout, test: Callable[[Placement, Asset], bool]) -> list[str]:
    """Return the ids of the objects that pass a test."""
    return [placement.id for placement in layout.placements if test(placement, layout.asset(placement.id))]


def furniture_of(layout: Layout) -> list[str]:
    """Return the furniture on the floor with a clearance in front, without objects that people push aside."""
    return ids_where(layout, lambda p, a: p.support == FLOOR and a.clearance > 0.0 and a.subtype not in MOVABLE)


def benches_of(layout: Layout) -> list[str]:
    """Return the benches."""
    return ids_where(layout, lambda p, a: p.support == FLOOR and a.subtype == "workbench" and bool(a.surfaces))


def hoods_of(layout: Layout) -> list[str]:
    """Return the fume hoods."""
    return ids_where(layout, lambda _, a: a.fume_hood)


def cabinets_of(layout: Layout) -> list[str]:
    """Return the cabinets for reagents."""
    return ids_where(layout, lambda _, a: a.storage_class in STORAGE_CLASSES)


def instruments_of(layout: Layout) -> list[str]:
    """Return the instruments that stand directly on furniture."""
    return ids_where(
        layout,
        lambda p, a: (
            a.kind == "instrument" and p.support not in (FLOOR, WALL) and layout.asset(p.support).kind == "facility"
        ),
    )


def reagents_of(layout: Layout) -> list[str]:
    """Return the reagents that stand on or in something."""
    return ids_where(layout, lambda p, a: a.kind == "reagent" and p.support not in (FLOOR, WALL))


def heat_sources_of(layout: Layout) -> list[str]:
    """Return the sources of heat."""
    return ids_where(layout, lambda _, a: a.heat_class in HEAT_CLASSES)


def required_of(layout: Layout, protocol: Protocol) -> set[str]:
    """Return the placements that fill the multiset of the protocol's assets."""
    needed = list(resolved(protocol.required_assets(), layout.catalog))
    kept = set()
    for placement in layout.placements:
        role = layout.asset(placement.id).role
        if role in needed:
            needed.remove(role)
            kept.add(placement.id)
    return kept
