"""Moves accessories that are in the way: stools, bins and kits on the floor, boards and equipment on walls."""

from __future__ import annotations

from collections.abc import Sequence

from labgym.geometry import BoxArray, OrientedBox, interpenetrating
from labgym.layouts.fitting import Keepouts, along_walls, on_floor, on_wall
from labgym.layouts.model import Layout
from labgym.layouts.moves import Place, apply, descendants, may_move, without
from labgym.layouts.placement import FLOOR, WALL, Placement
from labgym.layouts.rules.thresholds import LOOSE, MOVABLE, PENETRATION
from labgym.layouts.rules.zones import INTRUSION
from labgym.protocols import Protocol


def tidied(layout: Layout, protocol: Protocol | None) -> Layout:
    """Return the layout with each accessory that is in the way at the nearest free place; fixed objects stay.

    An accessory is in the way if it overlaps another object, or obstructs a door area, a front zone, the shower's
    surroundings or a robot pose of the protocol. Without a free place it stays.
    """
    keepouts = Keepouts.of(layout, protocol)
    for placement in layout.placements:
        if _is_accessory(layout, placement) and may_move(layout, placement.id):
            layout = _out_of_the_way(layout, placement, keepouts)
    return layout


def hanging_place(layout: Layout, placement_id: str) -> Place | None:
    """Return the free place on a wall that is nearest to a wall-mounted object, or None if the walls are full."""
    return _place(layout, placement_id, Keepouts.of(layout, None))


def _is_accessory(layout: Layout, placement: Placement) -> bool:
    floor = placement.support == FLOOR and layout.asset(placement.id).subtype in MOVABLE
    return floor or placement.support == WALL


def _out_of_the_way(layout: Layout, placement: Placement, keepouts: Keepouts) -> Layout:
    box = layout.box(placement.id)
    gone = {placement.id, *descendants(layout, placement.id)}
    others = [layout.box(item.id) for item in layout.placements if item.id not in gone]
    barred = [*keepouts.areas, *keepouts.stands]
    if layout.asset(placement.id).subtype not in LOOSE:
        barred += keepouts.zones
    if not _reaches(box, others, PENETRATION) and not _reaches(box, barred, INTRUSION):
        return layout
    place = _place(layout, placement.id, keepouts)
    return layout if place is None else apply(layout, place)


def _reaches(box: OrientedBox, others: Sequence[OrientedBox], depth: float) -> bool:
    """Whether a box overlaps one of the others by more than a depth in meters."""
    return bool(len(interpenetrating(BoxArray.of([box]), BoxArray.of(others), depth)[0]))


def _place(layout: Layout, placement_id: str, keepouts: Keepouts) -> Place | None:
    """The free place nearest to a placement, in the layout without it."""
    placement, asset = layout.placement(placement_id), layout.asset(placement_id)
    rest = without(layout, [placement_id])
    near, height = (placement.position[0], placement.position[1]), placement.position[2]
    if placement.support == WALL:
        target = on_wall(rest, asset, keepouts, near, height=height)
    else:
        target = on_floor(rest, asset, keepouts, along_walls(rest, asset, near), in_front=False)
    return None if target is None else Place(placement.id, target.position[0], target.position[1], target.yaw)
