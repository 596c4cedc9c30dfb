"""Reagents out of their cabinets or together, and heat near flammables."""

from __future__ import annotations

from labgym.layouts.model import Layout
from labgym.layouts.moves import Settle, apply
from labgym.layouts.rules.separation import hazard_between
from labgym.protocols import Protocol
from spoiling.edits import in_front_of, on_floor, settled_in_row
from spoiling.objects import benches_of, cabinets_of, heat_sources_of, hoods_of, reagents_of


def wrong_cabinets(layout: Layout, _: Protocol) -> Layout:
    """Make every reagent cabinet one of another class, by exchanging their contents in turn."""
    cabinets = cabinets_of(layout)
    stock = {cabinet: [p.id for p in layout.children(cabinet)] for cabinet in cabinets}
    used = [cabinet for cabinet in cabinets if stock[cabinet]]
    for cabinet, other in zip(used, used[1:] + used[:1], strict=True):
        if layout.asset(cabinet).storage_class == layout.asset(other).storage_class:
            other = next((each for each in cabinets if not stock[each]), other)
        layout = settled_in_row(layout, stock[cabinet], [other])
    return layout


def one_reagent_in_wrong_cabinet(layout: Layout, _: Protocol) -> Layout:
    """Put one reagent in a cabinet of another class."""
    for reagent in reagents_of(layout):
        own = layout.asset(layout.placement(reagent).support).storage_class
        for other in cabinets_of(layout):
            if layout.asset(other).storage_class != own:
                return settled_in_row(layout, [reagent], [other])
    return layout


def reagents_on_bench(layout: Layout, _: Protocol) -> Layout:
    """Leave all reagents on benches."""
    return settled_in_row(layout, reagents_of(layout), benches_of(layout))


def reagents_in_hood(layout: Layout, _: Protocol) -> Layout:
    """Leave all reagents in the hoods."""
    return settled_in_row(layout, reagents_of(layout), hoods_of(layout))


def reagent_on_floor(layout: Layout, _: Protocol) -> Layout:
    """Leave one reagent on the floor."""
    reagents = reagents_of(layout)
    return on_floor(layout, reagents[0]) if reagents else layout


def incompatibles_together(layout: Layout, _: Protocol) -> Layout:
    """Put two incompatible reagents side by side."""
    reagents = reagents_of(layout)
    for k, first in enumerate(reagents):
        for second in reagents[k + 1 :]:
            if hazard_between(layout.asset(first), layout.asset(second), "segregation") is not None:
                return settled_in_row(layout, [second, first], [layout.placement(first).support])
    return layout


def heat_by_flammables(layout: Layout, _: Protocol) -> Layout:
    """Put what carries a heat source next to the flammables."""
    heat = heat_sources_of(layout)
    stores = {layout.root(each).id for each in reagents_of(layout) if layout.asset(each).hazards.flammable}
    carriers = [layout.root(each).id for each in heat if layout.root(each).id not in stores]
    if not carriers or not stores:
        return layout
    return in_front_of(layout, carriers[0], min(stores), 0.05)


def burner_in_hood(layout: Layout, protocol: Protocol) -> Layout:
    """Put a heat source that the protocol uses elsewhere where flammable reagents are handled."""
    flammable = {use.name for use in protocol.reagents if layout.catalog.find(use.name).hazards.flammable}
    places = [step.location for step in protocol.steps if not flammable.isdisjoint(step.uses)]
    for location in places:
        own = {name for step in protocol.steps if step.location == location for name in step.uses}
        heat = [each for each in heat_sources_of(layout) if layout.asset(each).role not in own]
        target = layout.find(location)
        heat = [each for each in heat if layout.placement(each).support in layout.by_id]
        if heat and target is not None and layout.asset(target.id).surfaces:
            return apply(layout, Settle(heat[0], target.id, 0, 0.0, 0.0))
    return layout
