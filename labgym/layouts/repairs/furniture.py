"""Furniture that is in the way, overlaps or stands free: back under its load, or placed anew by the solver."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Collection, Iterable, Iterator
from dataclasses import replace
from itertools import islice, product

import numpy as np

from labgym.assets import Asset
from labgym.geometry import BoxArray, OrientedBox, rotate, to_world
from labgym.geometry.overlap import paired_inset
from labgym.layouts.ground import grounds
from labgym.layouts.habits import Habits
from labgym.layouts.interiors.rearranging import rearrangements
from labgym.layouts.model import Layout
from labgym.layouts.moves import Place, apply, may_move, replaced
from labgym.layouts.placement import FLOOR
from labgym.layouts.relocation import WALL_GAP, free_places
from labgym.layouts.repair import brought_inside, pushed_apart
from labgym.layouts.repairs.rank import RepairState
from labgym.layouts.rules.building import Building, building_of
from labgym.layouts.rules.collisions import collisions
from labgym.layouts.rules.thresholds import ONE_SIDED, PENETRATION, SURFACE_TOLERANCE
from labgym.layouts.tidying import tidied

Interval = tuple[float, float]
RELOCATIONS = 12
"""Maximum number of pieces that are relocated one after the other."""
PLACES = 6
"""Maximum number of free places tried for a piece."""
SHARES = (0.0, 0.1, 0.25, 0.5, 0.75, 0.9, 1.0)
"""Places tried between the two ends of those at which a load stands on its furniture, along each side."""
BEST = 3
"""Of these places, as many as have the lowest cost without ways are verified."""
NEAR_WALL = 0.5
"""Distance from a wall up to which furniture goes back to it under its load, meters."""
MOST_FLUSH = 40
"""Maximum number of objects that are moved back within the tolerances."""
OVERHANG = SURFACE_TOLERANCE / 2.0
"""Items that hang farther over the edge of a surface are moved back, meters."""
EVERYWHERE: Interval = (-math.inf, math.inf)


def under_loads(state: RepairState) -> RepairState:
    """Return the state after furniture that was moved without what stood on it was moved back under it.

    The load stays in place. Of the places of the furniture at which all of it stands on it the best one is taken.
    """
    off = {fault.id for fault in state.assessment.bounds if fault.cause == "surface"}
    for carrier in state.layout.placements:
        load = [child.id for child in state.layout.children(carrier.id)]
        stranded = [item for item in load if item in off]
        left = len(stranded) >= 2 or 0 < len(load) <= 2 * len(stranded)
        if carrier.support != FLOOR or carrier.fixed or not left:
            continue
        candidates = list(_under_load(state.layout, carrier.id))
        costs = [state.assessed(each, state.protocol).cost for each in candidates]
        best = state
        for index in sorted(range(len(candidates)), key=costs.__getitem__)[:BEST]:
            proposed = state.with_layout(candidates[index])
            if proposed.rank < best.rank:
                best = proposed
        state = best
    return state


def _under_load(layout: Layout, carrier: str) -> Iterator[Layout]:
    """Yield layouts with a piece of furniture moved alone so that all of its load stands over its surfaces."""
    along, across = EVERYWHERE, EVERYWHERE
    for child in layout.children(carrier):
        surface, box = layout.surface(carrier, child.slot or 0), layout.box(child.id)
        corners = [surface.to_local(float(x), float(y)) for x, y in box.corners()]
        along = _shared(along, [x for x, _ in corners], surface.width)
        across = _shared(across, [y for _, y in corners], surface.depth)
    if along[0] > along[1] or across[0] > across[1]:
        return
    placement, building, box = layout.placement(carrier), building_of(layout), layout.box(carrier)
    positions: dict[tuple[float, float, float], None] = {}
    for dx, dy in sorted(product(_shifts(along), _shifts(across)), key=lambda shift: math.hypot(*shift)):
        back = _to_wall(building, _shifted(box, dx, dy)) if layout.asset(carrier).size.depth < ONE_SIDED else 0.0
        for shift in dict.fromkeys((dy - back, dy) if dy - back >= across[0] else (dy,)):
            shifted = _shifted(box, dx, shift)
            inward = building.inward(shifted)
            position = (round(shifted.x + inward[0], 6), round(shifted.y + inward[1], 6), placement.position[2])
            positions.setdefault(position)
    for position in positions:
        yield replaced(layout, {carrier: placement.model_copy(update={"position": position})})


def _shifted(box: OrientedBox, dx: float, dy: float) -> OrientedBox:
    """Return a box moved in its own frame."""
    x, y = rotate(dx, dy, box.yaw)
    return replace(box, x=box.x + x, y=box.y + y)


def _to_wall(building: Building, box: OrientedBox) -> float:
    """Return how far a box that stands near a wall can move back to it, meters; 0 without a wall near it."""
    gap = float(np.abs(building.gaps(box.corners()[:2])).max(axis=1).min())
    return gap - WALL_GAP if WALL_GAP < gap <= NEAR_WALL else 0.0


def _shared(interval: Interval, coordinates: list[float], length: float) -> Interval:
    """Return the shifts of a surface in an interval for which coordinates lie within its length."""
    return max(interval[0], max(coordinates) - length / 2.0), min(interval[1], min(coordinates) + length / 2.0)


def _shifts(interval: Interval) -> list[float]:
    """Return the least shift in an interval, and others between its ends."""
    low, high = interval
    return [min(max(0.0, low), high), *(low + share * (high - low) for share in SHARES)]


def relocated(state: RepairState) -> RepairState:
    """Return the state after single pieces went to free places near them, one after the other, as long as that helps.

    The piece that takes part in most faults comes first. Accessories that are in the way are put aside.
    """
    for _ in range(RELOCATIONS):
        update = _relocation(state)
        if update is None:
            break
        state = update
    proposed = state.with_layout(tidied(state.layout, state.protocol)) if state.rank.cost else state
    return proposed if proposed.rank < state.rank else state


def _relocation(state: RepairState) -> RepairState | None:
    """Return the state after one piece went to a free place of its space or, if none helps, of another; else None."""
    counts = blame(state)
    guilty = [item for item in sorted(counts, key=lambda item: (-counts[item], item)) if may_move(state.layout, item)]
    for places in (free_places, elsewhere):
        for item in guilty:
            moved = _at_better_place(state, places(state.layout, item, PLACES))
            if moved is not None:
                return moved
    return None


def _at_better_place(state: RepairState, places: Iterable[Place]) -> RepairState | None:
    """Return the state with a piece at the first of some places that has a lower cost, without more warnings if any."""
    base = state.assessed(state.layout, state.protocol).cost
    best = state
    for place in places:
        proposed = state.with_layout_at_most(apply(state.layout, place), base - 1)
        if proposed is not None and proposed.rank < best.rank:
            best = proposed
            if best.rank.keeps(state.rank):
                break
    return best if best.rank.cost < state.rank.cost else None


def elsewhere(layout: Layout, item: str, most: int) -> Iterator[Place]:
    """Yield free places for a floor object in other spaces, those of a use that suits it first."""
    building = building_of(layout)
    here = int(building.spaces(BoxArray.of([layout.box(item)]))[0])
    for index, (x, y) in middles(layout, layout.asset(item)):
        if index != here and layout.placement(item).support == FLOOR:
            yield from free_places(apply(layout, Place(item, x, y, layout.placement(item).yaw)), item, most)


def middles(layout: Layout, asset: Asset) -> list[tuple[int, tuple[float, float]]]:
    """Return the index and the middle of each space, those of a use that suits an asset first; meters."""
    habits = Habits.published()
    spaces = sorted(enumerate(grounds(layout.floor)), key=lambda each: habits.rank_of(asset.role, each[1].use))
    points = [(k, to_world([(g.width / 2.0, g.depth / 2.0)], g.frame)[0].round(6).tolist()) for k, g in spaces]
    return [(k, (x, y)) for k, (x, y) in points]


def blame(state: RepairState) -> Counter[str]:
    """Return the floor objects that cause faults of furniture, with the number of faults.

    What stands wrong by itself counts twice. The owner of a blocked front causes nothing, nor does a place that no way
    out reaches.
    """
    layout, assessment = state.layout, state.assessment
    blame: Counter[str] = Counter()
    for fault in assessment.bounds:
        blame[layout.root(fault.id).id] += 2 if layout.placement(fault.id).support == FLOOR else 0
    for collision in assessment.collisions:
        roots = {layout.root(item).id for item in collision.ids}
        blame.update(roots if len(roots) > 1 else ())
    for issue in assessment.errors:
        if issue.rule == "egress":
            continue
        blocked = issue.rule == "front_clearance" and len(issue.ids) > 1
        blame.update(layout.root(item).id for item in (issue.ids[1:] if blocked else issue.ids * 2))
    return +blame


def placed_anew(state: RepairState, levels: int) -> RepairState:
    """Return the state after the solver has found places for the furniture that is involved in faults.

    Args:
        levels: how many of the steps of `rearrangements`, each of which moves more furniture, are tried.
    """
    best, involved = state, {item for item in _involved(state) if may_move(state.layout, item)}
    if not involved:
        return state
    for candidate in islice(rearrangements(state.layout, state.protocol, involved), levels):
        proposed = state.with_layout(candidate)
        if proposed.rank < best.rank:
            best = proposed
        if best.rank.sound:
            break
    return best


def flush(state: RepairState, moved: Collection[str]) -> RepairState:
    """Return the state without overlaps that only the tolerances allow: a judge with others would see a fault.

    What reaches into a wall or over an edge is moved back, and what the repair has moved out of other objects.

    Args:
        moved: ids of the objects that the repair has moved.
    """
    for item in _reaching(state):
        if may_move(state.layout, item):
            state = _not_worse(state, brought_inside(state.layout, item))
    for collision in collisions(state.assessment.arrangement, PENETRATION / 2.0):
        if any(state.layout.root(item).id in moved or item in moved for item in collision.ids):
            state = _not_worse(state, pushed_apart(state.layout, collision))
    return state


def _reaching(state: RepairState) -> list[str]:
    """Return the objects that reach into a wall or over the edge of a surface within the tolerance."""
    building, arrangement = building_of(state.layout), state.assessment.arrangement
    pieces = [p.id for p in state.layout.placements if p.support == FLOOR]
    deep = building.outside(BoxArray.of([state.layout.box(item) for item in pieces])) if pieces else ()
    reaching = [item for item, depth in zip(pieces, deep, strict=True) if depth > PENETRATION / 2.0]
    if arrangement.supported:
        surfaces = BoxArray.of([arrangement.surface(row) for row in arrangement.supported])
        insets = paired_inset(arrangement.take(arrangement.supported), surfaces)
        over = [row for row, inset in zip(arrangement.supported, insets, strict=True) if -inset > OVERHANG]
        reaching += [arrangement.placements[row].id for row in over]
    return reaching[:MOST_FLUSH]


def _not_worse(state: RepairState, layout: Layout) -> RepairState:
    if layout.placements == state.layout.placements:
        return state
    proposed = state.with_layout(layout)
    return proposed if proposed.rank <= state.rank else state


def settled(state: RepairState) -> bool:
    """Whether no furniture takes part in a fault."""
    return next(_involved(state), None) is None


def _involved(state: RepairState) -> Iterator[str]:
    """Yield the floor objects that take part in a fault of furniture or ways."""
    layout, assessment = state.layout, state.assessment
    for fault in assessment.bounds:
        if layout.placement(fault.id).support == FLOOR:
            yield fault.id
    for collision in assessment.collisions:
        roots = [layout.root(item).id for item in collision.ids]
        if roots[0] != roots[1]:
            yield from roots
    for issue in assessment.errors:
        yield from (layout.root(item).id for item in issue.ids)
    for transition in assessment.drives:
        if not transition.feasible:
            for location in (transition.start_location, transition.goal_location):
                placement = layout.find(location)
                if placement is not None:
                    yield layout.root(placement.id).id
