"""FastRepair: deterministic geometry that pushes objects back inside and apart (LabBuilder, appendix C)."""

from __future__ import annotations

import numpy as np

from labgym.geometry.overlap import separating_push
from labgym.layouts.fitting import free_spot
from labgym.layouts.model import Layout
from labgym.layouts.moves import Move, Settle, apply, lifted, may_move, rests_on
from labgym.layouts.placement import FLOOR, WALL
from labgym.layouts.rules import thresholds
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.bounds import bounds_faults
from labgym.layouts.rules.building import building_of, shift_inside
from labgym.layouts.rules.collisions import Collision, collisions
from labgym.layouts.rules.thresholds import Profile

ROUNDS = 12
SAFETY = 0.005
"""Added to every push, meters, so that rounding does not undo it."""
SEED = 0
"""Seed of the search for free spots; the same layout is always repaired in the same way."""


def fast_repair(layout: Layout, profile: str | Profile = "default") -> Layout:
    """Return the layout after rounds of boundary, height and collision repair; stops when nothing is left to do.

    Objects that do not stand on their support at all are put back onto it. The others move by the least displacement;
    of a colliding pair the smaller one moves, with everything on it. Fixed objects never move. Objects without
    space stay in place.
    """
    limits = thresholds.profile(profile)
    layout = _put_back(layout, limits)
    arrangement: Arrangement | None = None
    for _ in range(ROUNDS):
        arrangement = Arrangement.of(layout, arrangement)
        faults, overlaps = bounds_faults(arrangement), collisions(arrangement)
        if not faults and not overlaps:
            break
        before = layout
        for placement_id in dict.fromkeys(fault.id for fault in faults):
            if may_move(layout, placement_id):
                layout = brought_inside(layout, placement_id)
        for collision in overlaps:
            layout = pushed_apart(layout, collision)
        if layout.placements == before.placements:
            break
    return layout


def _put_back(layout: Layout, profile: Profile) -> Layout:
    """Stand objects whose center is not over their support's surface on a free spot of it, the largest first.

    They were left behind when their furniture was moved. An object for which the surface has no free spot stays.
    """
    stranded = [
        placement.id
        for placement in layout.placements
        if placement.support not in (FLOOR, WALL) and not _over_support(layout, placement.id)
    ]
    stranded = [placement_id for placement_id in stranded if layout.placement(placement_id).support not in stranded]
    area = {item: layout.box(item).width * layout.box(item).depth for item in stranded}
    generator = np.random.default_rng(SEED)
    waiting = sorted(stranded, key=lambda item: (-area[item], item))
    for index, item in enumerate(waiting):
        placement = layout.placement(item)
        if not may_move(layout, item):
            continue
        slot, asset = placement.slot or 0, layout.asset(item)
        spot = free_spot(layout, asset, placement.support, slot, profile, generator, waiting[index:])
        if spot is not None:
            layout = apply(layout, Settle(item, placement.support, slot, spot.x, spot.y, spot.yaw))
    return layout


def _over_support(layout: Layout, placement_id: str) -> bool:
    placement = layout.placement(placement_id)
    surface = layout.surface(placement.support, placement.slot or 0)
    x, y = surface.to_local(placement.position[0], placement.position[1])
    return abs(x) <= surface.width / 2.0 and abs(y) <= surface.depth / 2.0


def brought_inside(layout: Layout, placement_id: str) -> Layout:
    """Set an object on its support's height and translate it inward by the least displacement."""
    placement = layout.placement(placement_id)
    height = rests_on(layout, placement)
    if height is not None and abs(height - placement.position[2]) > 1e-6:
        layout = lifted(layout, placement_id, height)
    box = layout.box(placement_id)
    if placement.support in (FLOOR, WALL):
        dx, dy = building_of(layout).inward(box)
    else:
        surface = layout.surface(placement.support, placement.slot or 0)
        local = np.array([surface.to_local(float(x), float(y)) for x, y in box.corners()])
        half_w, half_d = surface.width / 2.0, surface.depth / 2.0
        push_x = shift_inside(local[:, 0].min(), local[:, 0].max(), -half_w, half_w)
        push_y = shift_inside(local[:, 1].min(), local[:, 1].max(), -half_d, half_d)
        origin = surface.to_world(0.0, 0.0)
        shifted = surface.to_world(push_x, push_y)
        dx, dy = shifted[0] - origin[0], shifted[1] - origin[1]
    return apply(layout, Move(placement_id, dx, dy)) if dx or dy else layout


def pushed_apart(layout: Layout, collision: Collision) -> Layout:
    """Separate a colliding pair by its least planar displacement, moving the smaller carrier that may move."""
    first, second = (_mover(layout, placement_id, collision.ids) for placement_id in collision.ids)
    if first == second:
        return layout
    area = {item: layout.box(item).width * layout.box(item).depth for item in (first, second)}
    mover, other = (first, second) if (area[first], first) <= (area[second], second) else (second, first)
    if not may_move(layout, mover):
        mover, other = other, mover
    if not may_move(layout, mover):
        return layout
    push = separating_push(layout.box(mover), layout.box(other), SAFETY)
    return apply(layout, Move(mover, *push)) if push is not None else layout


def _mover(layout: Layout, placement_id: str, pair: tuple[str, ...]) -> str:
    """The object that has to move: the object itself on a shared support, else the floor object that carries it."""
    first, second = (layout.placement(item) for item in pair)
    if first.support == second.support or first.id == second.support or second.id == first.support:
        return placement_id
    return layout.root(placement_id).id
