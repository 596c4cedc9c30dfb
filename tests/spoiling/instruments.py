"""Instruments and glassware on the floor, at the edge, out of reach or away from where they are used."""

from __future__ import annotations

import math

from labgym.layouts.model import Layout
from labgym.layouts.moves import Settle, apply, lifted
from labgym.protocols import Protocol
from labgym.protocols.capability import is_ventilated
from spoiling.edits import at_front_edge, on_floor, settled_in_row
from spoiling.objects import benches_of, instruments_of, required_of


def instruments_on_floor(layout: Layout, _: Protocol) -> Layout:
    """Lay every instrument on the floor."""
    for each in instruments_of(layout):
        layout = on_floor(layout, each)
    return layout


def one_flask_on_floor(layout: Layout, _: Protocol) -> Layout:
    """Lay one piece of glassware on the floor."""
    glass = [each for each in instruments_of(layout) if layout.asset(each).hazards.glass_container]
    return on_floor(layout, glass[0]) if glass else layout


def glass_at_edge(layout: Layout, _: Protocol) -> Layout:
    """Push glassware to the front edge of its surface."""
    for each in instruments_of(layout):
        carrier = layout.asset(layout.placement(each).support)
        if layout.asset(each).hazards.glass_container and carrier.storage_class is None:
            layout = at_front_edge(layout, each, overhang=0.0)
    return layout


def items_over_edge(layout: Layout, _: Protocol) -> Layout:
    """Push instruments half over the front edge of their bench."""
    for each in instruments_of(layout):
        if layout.asset(layout.placement(each).support).cavity is None:
            layout = at_front_edge(layout, each, overhang=0.5)
    return layout


def items_float(layout: Layout, _: Protocol) -> Layout:
    """Lift all instruments by 5 cm."""
    for each in instruments_of(layout):
        layout = lifted(layout, each, layout.placement(each).position[2] + 0.05)
    return layout


def far_on_benches(layout: Layout, protocol: Protocol) -> Layout:
    """Push the protocol's instruments to the far corner of their surface, out of an arm's reach."""
    needed = required_of(layout, protocol)
    for each in instruments_of(layout):
        item = layout.placement(each)
        surface, size = layout.surface(item.support, item.slot or 0), layout.asset(each).size
        if each in needed and layout.asset(item.support).cavity is None:
            x, y = surface.width / 2.0 - size.width / 2.0, -surface.depth / 2.0 + size.depth / 2.0
            layout = apply(layout, Settle(each, item.support, item.slot or 0, x, y))
    return layout


def vessels_out_of_hood(layout: Layout, _: Protocol) -> Layout:
    """Take every instrument out of ventilated places."""
    inside = [each for each in instruments_of(layout) if is_ventilated(layout.asset(layout.placement(each).support))]
    return settled_in_row(layout, inside, reversed(benches_of(layout)))


def apparatus_apart(layout: Layout, protocol: Protocol) -> Layout:
    """Put one piece of each apparatus on the bench that is farthest from the others."""
    moved = set()
    for rule in protocol.spatial_constraints:
        pieces = [each for each in instruments_of(layout) if layout.asset(each).role == rule.subject]
        if rule.kind != "near" or not pieces or rule.subject in moved:
            continue
        moved.add(rule.subject)
        for piece in pieces:
            x, y, _ = layout.placement(piece).position
            far = max(benches_of(layout), key=lambda each: math.dist((x, y), layout.placement(each).position[:2]))
            layout = settled_in_row(layout, [piece], [far])
    return layout


def put_away(layout: Layout, protocol: Protocol) -> Layout:
    """Put the protocol's instruments away on benches other than those where they are used."""
    homes = {rule.subject: rule.object for rule in protocol.spatial_constraints if rule.kind == "on"}
    used = [each for each in instruments_of(layout) if layout.asset(each).role in homes]
    other = [bench for bench in benches_of(layout) if layout.asset(bench).role not in protocol.locations]
    away = [each for each in used if layout.placement(each).support not in other]
    return settled_in_row(layout, away, other or benches_of(layout))
