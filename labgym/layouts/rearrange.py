"""Rearranges the furniture of a layout with the constraint solver, for when single moves do not help."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator

from labgym.layouts.brief import Brief, Unit, Wall
from labgym.layouts.floor.exits import HOOD_DOOR_LEAST
from labgym.layouts.floor_plan import solve
from labgym.layouts.habits import Habits
from labgym.layouts.interiors.rearranging import rearranged
from labgym.layouts.model import Layout
from labgym.layouts.moves import Place, apply, may_move
from labgym.layouts.placement import FLOOR, WALL, Placement
from labgym.layouts.rules.building.one_room import WALL_YAW
from labgym.layouts.rules.thresholds import MOVABLE, ONE_SIDED, SHOWER_RADIUS
from labgym.layouts.rules.zones import INTRUSION
from labgym.layouts.tidying import tidied
from labgym.protocols import Protocol

EFFORTS = (0.1, 0.1, 0.2, 0.6)
"""Deterministic search time with only the wall furniture in question free, with islands in question too, with all wall
furniture, and with all furniture."""
AISLE = 0.95
"""Clear width kept around islands, meters: a way out."""


def rearrangements(layout: Layout, protocol: Protocol | None, involved: Collection[str]) -> Iterator[Layout]:
    """Yield layouts with one-sided furniture at walls and islands free, close to where they are.

    First only the involved furniture moves, wall furniture before islands, then all furniture that stands against
    walls, then all. Islands keep a way around them, and peninsulas their short end at a side wall. Fixed objects are
    obstacles; stools, bins and boards make way. Fronts, door areas and the shower's clear space are free; chemical
    distances are not considered. On a floor of another shape than one rectangle each space is rearranged in its frame.
    """
    furniture = [
        placement.id
        for placement in layout.placements
        if placement.support == FLOOR
        and layout.asset(placement.id).subtype not in MOVABLE
        and may_move(layout, placement.id)
    ]
    at_walls = [item for item in furniture if layout.asset(item).size.depth < ONE_SIDED or item in involved]
    in_question = [item for item in furniture if item in involved]
    if not in_question:
        return
    walled = [item for item in in_question if layout.asset(item).size.depth < ONE_SIDED]
    last: set[str] = set()
    for movers, effort in zip((walled, in_question, at_walls, furniture), EFFORTS, strict=True):
        if set(movers) != last:
            last = set(movers)
            one_room = layout.floor.is_rectangle
            candidate = _rearranged(layout, last, effort) if one_room else rearranged(layout, movers, effort)
            if candidate is not None:
                yield tidied(candidate, protocol)


def _rearranged(layout: Layout, movers: Collection[str], effort: float) -> Layout | None:
    """The layout with some furniture at poses that the solver finds, or None if it finds none."""
    units, fixed, wall_assets = [], {}, {}
    for placement in layout.placements:
        asset = layout.asset(placement.id)
        if placement.support == WALL and asset.size.depth > INTRUSION and not may_move(layout, placement.id):
            fixed[placement.id], wall_assets[placement.id] = placement, asset
        if placement.support != FLOOR or asset.subtype in MOVABLE:
            continue
        units.append(_unit(layout, placement))
        if placement.id not in movers:
            fixed[placement.id] = placement
    brief = Brief(
        units=tuple(units),
        fixed=fixed,
        wall_assets=wall_assets,
        hoods=tuple(unit.id for unit in units if unit.asset.fume_hood),
        aisle=AISLE,
        hood_door=HOOD_DOOR_LEAST,
    )
    solution = solve(brief, layout.room, 0, effort=effort)
    if solution.status != "solved":
        return None
    for placement_id, pose in solution.poses.items():
        if placement_id not in fixed:
            layout = apply(layout, Place(placement_id, round(pose.x, 6), round(pose.y, 6), pose.yaw))
    return layout


def _unit(layout: Layout, placement: Placement) -> Unit:
    """A unit that prefers the nearest wall, and on each wall the position nearest to where it is."""
    asset, room = layout.asset(placement.id), layout.room
    x, y, _ = placement.position
    distances: dict[Wall, float] = {"front": y, "back": room.depth - y, "left": x, "right": room.width - x}
    walls = sorted(distances, key=lambda wall: (distances[wall] + _turn(placement.yaw, wall), wall))
    along = {wall: x / room.width if wall in ("front", "back") else y / room.depth for wall in walls}
    if asset.size.depth >= ONE_SIDED:
        size, share = asset.size, min(max(y / room.depth, 0.0), 1.0)
        if Habits.published().of(asset.role).stance == "peninsula":
            sides = tuple(wall for wall in walls if wall in ("left", "right"))
            return Unit(
                placement.id, asset, size.width, size.depth, 0.0, "peninsula", sides, dict.fromkeys(sides, share)
            )
        anchors = {"island": share, "island_x": min(max(x / room.width, 0.0), 1.0)}
        return Unit(placement.id, asset, size.width, size.depth, 0.0, "island", (), anchors)
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
