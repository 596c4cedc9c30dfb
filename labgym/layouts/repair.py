"""FastRepair: deterministic geometry that pushes things back inside and apart (LabBuilder, appendix C)."""

from __future__ import annotations

import math

import numpy as np

from labgym.geometry import BoxArray, OrientedBox, pairwise_penetration
from labgym.layouts.model import FLOOR, WALL, Layout
from labgym.layouts.moves import Move, apply, lifted, rests_on
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.bounds import bounds_faults
from labgym.layouts.rules.collisions import Collision, collisions

ROUNDS = 12
SAFETY = 0.005
"""Added to every push, metres, so that rounding does not undo it."""


def fast_repair(layout: Layout) -> Layout:
    """Return the layout after rounds of boundary, height and collision repair; stops when nothing is left to do.

    Things move by the least displacement, the smaller of a colliding pair moves, and what stands on a thing moves
    along. What cannot be mended so (too little space) is left for the caller to see.
    """
    for _ in range(ROUNDS):
        arrangement = Arrangement.of(layout)
        faults, found = bounds_faults(arrangement), collisions(arrangement)
        if not faults and not found:
            break
        before = layout
        for placement_id in dict.fromkeys(fault.id for fault in faults):
            layout = _brought_back(layout, placement_id)
        for collision in found:
            layout = _pushed_apart(layout, collision)
        if layout.placements == before.placements:
            break
    return layout


def _brought_back(layout: Layout, placement_id: str) -> Layout:
    """Set a thing on its support's height and translate it inward by the least penetration."""
    placement = layout.placement(placement_id)
    height = rests_on(layout, placement)
    if height is not None and abs(height - placement.position[2]) > 1e-6:
        layout = lifted(layout, placement_id, height)
    box = layout.box(placement_id)
    if placement.support in (FLOOR, WALL):
        x0, y0, x1, y1 = box.bounds()
        dx, dy = _inward(x0, x1, 0.0, layout.room.width), _inward(y0, y1, 0.0, layout.room.depth)
    else:
        surface = layout.surface(placement.support, placement.slot or 0)
        local = np.array([surface.to_local(float(x), float(y)) for x, y in box.corners()])
        half_w, half_d = surface.width / 2.0, surface.depth / 2.0
        push_x = _inward(local[:, 0].min(), local[:, 0].max(), -half_w, half_w)
        push_y = _inward(local[:, 1].min(), local[:, 1].max(), -half_d, half_d)
        origin = surface.to_world(0.0, 0.0)
        shifted = surface.to_world(push_x, push_y)
        dx, dy = shifted[0] - origin[0], shifted[1] - origin[1]
    return apply(layout, Move(placement_id, dx, dy)) if dx or dy else layout


def _inward(low: float, high: float, least: float, most: float) -> float:
    """Displacement that brings [low, high] into [least, most]; the middle where it is too long."""
    if high - low > most - least:
        return (least + most - low - high) / 2.0
    if low < least:
        return least - low
    return most - high if high > most else 0.0


def _pushed_apart(layout: Layout, collision: Collision) -> Layout:
    """Separate a colliding pair by its least planar displacement, moving the smaller of the two carriers."""
    first, second = (_mover(layout, placement_id, collision.ids) for placement_id in collision.ids)
    if first == second:
        return layout
    area = {item: layout.box(item).width * layout.box(item).depth for item in (first, second)}
    mover, other = (first, second) if (area[first], first) <= (area[second], second) else (second, first)
    push = separating_push(layout.box(mover), layout.box(other))
    return apply(layout, Move(mover, *push)) if push is not None else layout


def _mover(layout: Layout, placement_id: str, pair: tuple[str, ...]) -> str:
    """What has to move: the thing itself on a shared support, else the floor object that carries it."""
    first, second = (layout.placement(item) for item in pair)
    if first.support == second.support or first.id == second.support or second.id == first.support:
        return placement_id
    return layout.root(placement_id).id


def separating_push(mover: OrientedBox, other: OrientedBox) -> tuple[float, float] | None:
    """Return the shortest planar translation of `mover` that leaves `other`, metres; None where they are apart."""
    a, b = BoxArray.of([mover]), BoxArray.of([other])
    if pairwise_penetration(a, b)[0, 0] <= 0.0:
        return None
    offset = np.array([mover.x - other.x, mover.y - other.y])
    best: tuple[float, float, float] | None = None
    for normal in np.concatenate([a.axes()[0], b.axes()[0]]):
        reach = sum(float(np.abs(box.axes()[0] @ normal) @ box.half[0]) for box in (a, b))
        along = float(offset @ normal)
        depth = reach - abs(along) + SAFETY
        sign = math.copysign(1.0, along)
        if best is None or depth < best[0] - 1e-9:
            best = (depth, sign * depth * float(normal[0]), sign * depth * float(normal[1]))
    return (best[1], best[2]) if best is not None else None
