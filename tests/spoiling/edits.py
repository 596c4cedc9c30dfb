"""Edits that spoil a layout. What stands on an object goes with it."""

from __future__ import annotations

import math
from collections.abc import Iterable

from labgym.layouts.model import Layout
from labgym.layouts.moves import Place, Rotate, Settle, apply, lifted, replaced
from labgym.layouts.placement import FLOOR
from labgym.layouts.rules.building import Entrance


def on_floor(layout: Layout, item: str) -> Layout:
    """Return the layout with an object on the floor below its place."""
    fallen = lifted(layout, item, 0.0)
    return replaced(fallen, {item: fallen.placement(item).model_copy(update={"support": FLOOR, "slot": None})})


def settled_in_row(layout: Layout, ids: Iterable[str], carriers: Iterable[str], slot: int = 0) -> Layout:
    """Return the layout with objects side by side on furniture, from the left end of each surface."""
    waiting = list(ids)
    for carrier in carriers:
        surface, along = layout.surface(carrier, slot), 0.0
        while waiting:
            size = layout.asset(waiting[0]).size
            reach = max(size.width, size.depth)
            if along + reach > surface.width or size.depth > surface.depth:
                break
            x = along + reach / 2.0 - surface.width / 2.0
            layout = apply(layout, Settle(waiting.pop(0), carrier, slot, x, 0.0))
            along += reach + 0.02
    return layout


def in_front_of(layout: Layout, piece: str, target: str, gap: float) -> Layout:
    """Return the layout with a piece at a distance in front of another, both facing the same way, meters."""
    box, depth = layout.box(target), layout.asset(piece).size.depth
    out = box.depth / 2.0 + gap + depth / 2.0
    return apply(layout, Place(piece, box.x + out * box.front[0], box.y + out * box.front[1], box.yaw))


def turned_about(layout: Layout, ids: Iterable[str]) -> Layout:
    """Return the layout with objects turned by half a turn."""
    for each in ids:
        layout = apply(layout, Rotate(each, layout.placement(each).yaw + math.pi))
    return layout


def inside_door(layout: Layout, piece: str, entrance: Entrance, depth: float) -> Layout:
    """Return the layout with a piece straight inside a door, its center at a depth from the wall in meters."""
    x, y, yaw = entrance.pose
    return apply(layout, Place(piece, x - depth * math.sin(yaw), y + depth * math.cos(yaw), yaw))


def at_front_edge(layout: Layout, item: str, overhang: float) -> Layout:
    """Return the layout with an item slid forward to the front edge of its surface.

    Args:
        overhang: share of the item beyond the edge, 0 to 1.
    """
    placement, size = layout.placement(item), layout.asset(item).size
    slot = placement.slot or 0
    surface = layout.surface(placement.support, slot)
    turn = placement.yaw - surface.yaw
    reach = (abs(math.sin(turn)) * size.width + abs(math.cos(turn)) * size.depth) / 2.0
    x, y = surface.to_local(*placement.position[:2])[0], surface.depth / 2.0 - (1.0 - 2.0 * overhang) * reach
    return apply(layout, Settle(item, placement.support, slot, x, y, turn))
