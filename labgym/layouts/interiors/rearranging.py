"""Rearranges furniture that stands on a floor, space by space: each piece goes to a free place near to where it is."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Sequence

import numpy as np

from labgym.geometry import BoxArray, OrientedBox
from labgym.layouts.brief import Demands, Unit
from labgym.layouts.ground import Ground, Segment, grounds
from labgym.layouts.interiors.program import Option, Stand, plan_walls
from labgym.layouts.interiors.siting import Places, all_places
from labgym.layouts.interiors.standing import Standing
from labgym.layouts.model import Layout
from labgym.layouts.moves import Place, apply, may_move
from labgym.layouts.pieces import clear_around
from labgym.layouts.placement import FLOOR, WALL
from labgym.layouts.relocation import free_places
from labgym.layouts.rules.building import building_of
from labgym.layouts.rules.supplies import supplies_of
from labgym.layouts.rules.thresholds import MOVABLE, ONE_SIDED
from labgym.layouts.rules.zones import INTRUSION
from labgym.layouts.tidying import tidied
from labgym.protocols import Protocol

TURN = 0.5
"""Cost of turning a piece around, as a distance, meters."""


def rearranged(layout: Layout, movers: Collection[str], effort: float) -> Layout | None:
    """Return a layout with some furniture at free places of its spaces, None if it does not fit.

    Wall furniture goes to the walls, then islands to the nearest place in the open with an aisle around it. All other
    furniture stays and is an obstacle. Fronts, door areas, keep-outs, required services and the shower's clear space
    are respected; chemical distances and ways are not considered.

    Args:
        movers: ids of floor objects. effort: deterministic search time for each space.
    """
    ids = [item for item in movers if layout.asset(item).size.depth < ONE_SIDED]
    if not movers:
        return None
    building = building_of(layout)
    homes = building.spaces(BoxArray.of([layout.box(item) for item in ids])).tolist() if ids else []
    for index, ground in enumerate(grounds(layout.floor)):
        here = [item for item, home in zip(ids, homes, strict=True) if home == index]
        if here:
            moves = _moves(layout, ground, here, movers, effort)
            if moves is None:
                return None
            for move in moves:
                layout = apply(layout, move)
    for item in movers:
        if item not in ids:
            places = free_places(layout, item, 1)
            if not places:
                return None
            layout = apply(layout, places[0])
    return layout


def _moves(
    layout: Layout, ground: Ground, here: Sequence[str], movers: Collection[str], effort: float
) -> list[Place] | None:
    """Places of some furniture of a space, None if the solver finds none."""
    standing = _standing(layout, ground, set(movers))
    units = [_unit(layout, item) for item in here]
    feet: dict[str, OrientedBox] = {}
    places = all_places(standing, units, {}, ())
    for unit in units:
        nearest = _nearest_oblique(unit, ground.to_ground(layout.box(unit.id)), places)
        if nearest is not None:
            foot = standing.oblique_foot(*nearest, unit)
            if standing.fit([foot], unit.front)[0]:
                standing.add(foot, unit.front, unit.clear)
                feet[unit.id] = foot
    upright = [unit for unit in units if unit.id not in feet]
    if feet:
        places = all_places(standing, upright, {}, ())
    stands = [_stand(unit, ground.to_ground(layout.box(unit.id)), places) for unit in upright]
    plan = plan_walls(stands, Demands(), 0, effort)
    if plan.status != "solved":
        return None
    moves = []
    for item, foot in {**feet, **plan.feet}.items():
        x, y, yaw = ground.to_floor((foot.x, foot.y, foot.yaw))
        moves.append(Place(item, round(x, 6), round(y, 6), math.remainder(yaw, 2.0 * math.pi)))
    return moves


def _standing(layout: Layout, ground: Ground, movers: Collection[str]) -> Standing:
    """The state of a space without the furniture that moves and without what people push aside."""
    standing = Standing(ground)
    for placement in layout.placements:
        asset = layout.asset(placement.id)
        on_floor = placement.support == FLOOR and asset.subtype not in MOVABLE and placement.id not in movers
        on_wall = placement.support == WALL and asset.size.depth > INTRUSION and placement.fixed
        if on_floor or on_wall:
            box = ground.to_ground(layout.box(placement.id))
            standing.add(box, asset.clearance if on_floor and asset.size.depth < ONE_SIDED else 0.0)
    return standing


def _unit(layout: Layout, item: str) -> Unit:
    asset = layout.asset(item)
    contents = [layout.asset(child.id) for child in layout.children(item)]
    return Unit(
        item,
        asset,
        asset.size.width,
        asset.size.depth,
        asset.clearance,
        clear=clear_around(asset),
        supplies=supplies_of(asset, contents),
    )


def _nearest_oblique(unit: Unit, box: OrientedBox, places: Places) -> tuple[Segment, float] | None:
    """The place of a unit at an oblique wall, if that is nearer than any at a straight one."""
    best: tuple[float, Segment, float] | None = None
    for segment, intervals in places[unit.id]:
        for low, high in intervals:
            along = min(max(_along(segment, box) - unit.width / 2.0, low), high)
            way = _way(segment, along, unit, box)
            if best is None or way < best[0]:
                best = (way, segment, along)
    return None if best is None or best[1].straight else best[1:]


def _stand(unit: Unit, box: OrientedBox, places: Places) -> Stand:
    """A unit with its straight segments; it prefers the place nearest to where it is."""
    options = []
    for segment, intervals in places[unit.id]:
        if segment.straight:
            here = _along(segment, box) - unit.width / 2.0
            anchor = min((min(max(here, low), high) for low, high in intervals), key=lambda place: abs(place - here))
            options.append(Option(segment, tuple(intervals), anchor, _way(segment, anchor, unit, box)))
    return Stand(unit, tuple(options))


def _along(segment: Segment, box: OrientedBox) -> float:
    dx, dy = box.x - segment.x, box.y - segment.y
    return dx * math.cos(segment.yaw) + dy * math.sin(segment.yaw)


def _way(segment: Segment, along: float, unit: Unit, box: OrientedBox) -> float:
    """Distance of a place along a segment from where a unit is, with a cost for turning, meters."""
    x, y = segment.point(along + unit.width / 2.0, unit.depth / 2.0)
    turn = abs(math.remainder(box.yaw - segment.yaw, 2.0 * math.pi)) / math.pi
    return float(np.hypot(x - box.x, y - box.y)) + TURN * turn


EFFORTS = (0.1, 0.1, 0.2, 0.6)
"""Deterministic search time with only the wall furniture in question free, with islands in question too, with all wall
furniture, and with all furniture."""


def rearrangements(layout: Layout, protocol: Protocol | None, involved: Collection[str]) -> Iterator[Layout]:
    """Yield layouts with one-sided furniture at walls and islands free, close to where they are.

    First only the involved furniture moves, wall furniture before islands, then all furniture that stands against
    walls, then all; each space in its frame (`rearranged`). Stools, bins and boards make way.
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
            candidate = rearranged(layout, movers, effort)
            if candidate is not None:
                yield tidied(candidate, protocol)
