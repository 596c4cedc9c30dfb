"""Rearranges the furniture of a layout with the constraint solver, for when single moves do not help."""

from __future__ import annotations

import math

from labgym.geometry import BoxArray, pairwise_penetration
from labgym.layouts.brief import Brief, Unit, Wall
from labgym.layouts.floor_plan import solve
from labgym.layouts.model import FLOOR, WALL, Layout, Placement
from labgym.layouts.moves import Place, apply, may_move
from labgym.layouts.relocation import WALL_YAW, free_places
from labgym.layouts.rules.facility import HOOD_DOOR_LEAST
from labgym.layouts.rules.thresholds import MOVABLE, ONE_SIDED, SHOWER_RADIUS
from labgym.layouts.rules.zones import INTRUSION

EFFORT = 0.6
"""Deterministic search time."""
AISLE = 0.95
"""Clear width kept around islands, metres: a way out."""


def rearranged(layout: Layout) -> Layout | None:
    """Return the layout with every one-sided piece at a wall and every island free, close to where they are, or None.

    Islands keep a way around them. Fixed objects and deep objects on walls are obstacles; stools and bins make way.
    Fronts, door areas and the shower's clear space are free; chemical distances are not considered.
    """
    units, fixed, wall_assets = [], {}, {}
    for placement in layout.placements:
        asset = layout.asset(placement.id)
        if placement.support == WALL and asset.size.depth > INTRUSION:
            fixed[placement.id], wall_assets[placement.id] = placement, asset
        if placement.support != FLOOR or asset.subtype in MOVABLE:
            continue
        units.append(_unit(layout, placement))
        if not may_move(layout, placement.id):
            fixed[placement.id] = placement
    brief = Brief(
        units=tuple(units),
        fixed=fixed,
        wall_assets=wall_assets,
        hoods=tuple(unit.id for unit in units if unit.asset.fume_hood),
        aisle=AISLE,
        hood_door=HOOD_DOOR_LEAST,
    )
    solution = solve(brief, layout.room, 0, effort=EFFORT)
    if solution.status != "solved":
        return None
    for placement_id, pose in solution.poses.items():
        if placement_id not in fixed:
            layout = apply(layout, Place(placement_id, round(pose.x, 6), round(pose.y, 6), pose.yaw))
    return _clutter_moved(layout)


def _clutter_moved(layout: Layout) -> Layout:
    """Put stools and bins that are now in the way to the nearest free places."""
    for placement in layout.placements:
        if placement.support != FLOOR or layout.asset(placement.id).subtype not in MOVABLE or placement.fixed:
            continue
        box = layout.box(placement.id)
        others = [layout.box(other.id) for other in layout.placements if other.support == FLOOR and other != placement]
        if others and bool((pairwise_penetration(BoxArray.of([box]), BoxArray.of(others)) > 0.0).any()):
            for place in free_places(layout, placement.id, 1):
                layout = apply(layout, place)
    return layout


def _unit(layout: Layout, placement: Placement) -> Unit:
    """A unit that prefers the nearest wall, and on each wall the position nearest to where it is."""
    asset, room = layout.asset(placement.id), layout.room
    x, y, _ = placement.position
    distances: dict[Wall, float] = {"front": y, "back": room.depth - y, "left": x, "right": room.width - x}
    walls = sorted(distances, key=lambda wall: (distances[wall] + _turn(placement.yaw, wall), wall))
    along = {wall: x / room.width if wall in ("front", "back") else y / room.depth for wall in walls}
    if asset.size.depth >= ONE_SIDED:
        size, anchor = asset.size, min(max(y / room.depth, 0.0), 1.0)
        return Unit(placement.id, asset, size.width, size.depth, 0.0, "island", (), {"island": anchor})
    clear = max(0.0, SHOWER_RADIUS - asset.size.short / 2.0) if asset.subtype == "shower" else 0.0
    return Unit(
        placement.id,
        asset,
        asset.size.width,
        asset.size.depth,
        asset.clearance,
        walls=tuple(walls),
        anchors={wall: min(max(share, 0.0), 1.0) for wall, share in along.items()},
        clear=clear,
    )


def _turn(yaw: float, wall: Wall) -> float:
    """Cost of turning an object to a wall's direction, meters."""
    return abs(math.remainder(yaw - WALL_YAW[wall], 2.0 * math.pi)) / math.pi
