"""Broken safety rules: what breaks one goes, or is hung, where it breaks none."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator
from itertools import chain, islice

from labgym.geometry import BoxArray, OrientedBox, pairwise_penetration
from labgym.layouts.adjust import swaps
from labgym.layouts.fitting import Keepouts, on_wall
from labgym.layouts.ground.wide_ways import Passages
from labgym.layouts.model import Layout
from labgym.layouts.moves import apply, may_move, replaced
from labgym.layouts.placement import FLOOR, WALL
from labgym.layouts.repairs.berths import berths
from labgym.layouts.repairs.rank import RepairState
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.rule import FacilityIssue
from labgym.layouts.rules.safety.heights import HEAVY_GAS_TOP_M, REAGENT_HEIGHT_M
from labgym.layouts.rules.safety.rules import RULES
from labgym.layouts.rules.safety.standing import forbidden
from labgym.layouts.rules.safety.walls import opening_boxes
from labgym.layouts.rules.site import Site
from labgym.layouts.rules.thresholds import WALL_TOLERANCE
from labgym.layouts.settling import free_spots, homes
from labgym.protocols import Protocol

TRIALS = 48
"""Maximum number of layouts tried against one broken rule."""
BERTHS = 20
"""Maximum number of poses tried for a piece of furniture."""
WALL_PLACES = 100
"""Free places on walls for which it is asked whether openings and ways allow them."""
ROUNDS = 3
ORDER = {rule.name: number for number, rule in enumerate(RULES) if rule.severity == "error"}
"""Hard safety rules in the order of reports."""
EQUIPMENT_WALKS = frozenset({name for name in ORDER if name.endswith("_walk")})
"""Rules on walks: the equipment comes nearer to the first object of an issue, which stays if any way leads there."""


def broken_rules(state: RepairState) -> list[FacilityIssue]:
    """Return the hard safety rules of the rule set that a layout breaks."""
    issues = (issue for issue in state.assessment.hard_issues if issue.rule in ORDER)
    return sorted(issues, key=lambda issue: (ORDER[issue.rule], issue.ids))


def faults_of(state: RepairState) -> Counter[tuple[str, tuple[str, ...]]]:
    """Return the broken hard safety rules with the objects concerned, and how often each occurs."""
    return Counter((issue.rule, issue.ids) for issue in broken_rules(state))


def safeguarded(state: RepairState) -> RepairState:
    """Return the state after pieces that break safety rules went where the layout has fewer faults.

    The nearest place comes first. Furniture moves with what it carries, wall items hang at their height, items go to
    lower shelves or to where they belong, and emergency equipment comes nearer.
    """
    for _ in range(ROUNDS):
        before = state
        for issue in broken_rules(state):
            if faults_of(state)[issue.rule, issue.ids]:
                state = _against(state, issue)
        if state is before:
            break
    return state


def _against(state: RepairState, issue: FacilityIssue) -> RepairState:
    """Return the best of the layouts tried against one broken rule; the first that cures it without a new fault."""
    best, present = state, faults_of(state)
    for layout in islice(_layouts(state, issue), TRIALS):
        proposed = state.with_layout_at_most(layout, state.rank.cost)
        if proposed is None or not proposed.rank < best.rank:
            continue
        best = proposed
        left = faults_of(proposed)
        if not left[issue.rule, issue.ids] and not left - present:
            break
    return best


def _layouts(state: RepairState, issue: FacilityIssue) -> Iterator[Layout]:
    """Yield layouts in which what takes part in an issue is elsewhere: first the object itself, then the others."""
    layout = state.layout
    ids = [item for item in issue.ids if item in layout.by_id]
    near = layout.placement(ids[0]).position[:2] if ids else (0.0, 0.0)
    if issue.rule in EQUIPMENT_WALKS:
        for item in ids[:1] if issue.value is None else ():  # Nobody can stand before it, or leave that place.
            yield from elsewhere(state, item)
        for item in ids[1:]:
            yield from elsewhere(state, item, near)
        return
    for item in ids:
        yield from elsewhere(state, item)
    for item in dict.fromkeys(layout.root(item).id for item in ids):
        if layout.placement(item).support == FLOOR and may_move(layout, item):
            yield from (apply(layout, command) for command in swaps(layout, item))


def elsewhere(state: RepairState, item: str, near: tuple[float, float] | None = None) -> Iterator[Layout]:
    """Yield layouts with an object at other places, the nearest first: to where it is, or to a point."""
    layout, support = state.layout, state.layout.placement(item).support
    if not may_move(layout, item):
        return
    if support == WALL:
        yield from rehung(layout, item, state.protocol, near)
        return
    if support != FLOOR:
        yield from _resettled(state, item)
        item = layout.root(item).id
        if layout.placement(item).support != FLOOR or not may_move(layout, item):
            return
    places = list(islice(berths(layout, item), BERTHS if near is None else 3 * BERTHS))
    if near is not None:
        places = sorted(places, key=lambda place: math.dist((place.x, place.y), near))[:BERTHS]
    yield from (apply(layout, place) for place in places)


def rehung(
    layout: Layout, item: str, protocol: Protocol | None, near: tuple[float, float] | None = None
) -> Iterator[Layout]:
    """Yield layouts with a wall item at its mount height on free wall that has no opening.

    Args:
        near: the point to which it hangs as near as it can; where it is by default.
    """
    here = layout.placement(item)
    asset = layout.asset(item)
    rest = layout.replace(placements=tuple(placement for placement in layout.placements if placement.id != item))
    site = Site(Arrangement.of(layout), protocol)
    openings = [box for _, box in opening_boxes(site)]
    ways = Passages(rest) if asset.subtype == "fire" and rest.floor.spaces else None

    def plain(box: OrientedBox) -> bool:
        if openings and (pairwise_penetration(BoxArray.of([box]), BoxArray.of(openings)) > WALL_TOLERANCE).any():
            return False
        at = None if ways is None else rest.floor.space_at(box.x, box.y)
        return ways is None or at is None or ways.add(at.id, box, emergency=True)

    keepouts, spaces = Keepouts.of(rest, protocol), [space.id for space in layout.floor.spaces]
    heights = (None, HEAVY_GAS_TOP_M - asset.size.height) if asset.subtype == "sensor" else (None,)
    for height in heights:
        for space in (None, *(spaces if len(spaces) > 1 else ())):
            point = near or here.position[:2]
            place = on_wall(rest, asset, keepouts, point, height=height, space=space, accept=plain, tries=WALL_PLACES)
            if place is not None:
                yield replaced(layout, {item: place.model_copy(update={"id": item})})


def _resettled(state: RepairState, item: str) -> Iterator[Layout]:
    """Yield layouts with an item on another slot on which it may stand, or on the floor if it belongs there."""
    layout, asset = state.layout, state.layout.asset(item)
    waste = ((p.id, slot) for p in layout.placements if layout.asset(p.id).storage_class == "Waste" for slot in (0, 1))
    slots = waste if asset.category == "waste" else homes(layout, item, state.protocol)
    here = (layout.placement(item).support, layout.placement(item).slot)
    for support, slot in chain(slots, [here] if here[1] is not None else []):
        holder = layout.asset(support)
        if slot is None or slot >= len(holder.surfaces) or forbidden(asset, holder) is not None:
            continue
        if asset.kind == "reagent" and layout.surface(support, slot).z0 > REAGENT_HEIGHT_M:
            continue
        for spot in free_spots(layout, item, support, slot, state.profile, most=1):
            yield apply(layout, spot)
    if asset.placing == "floor":
        x, y, _ = layout.placement(item).position
        down = {"support": FLOOR, "slot": None, "position": (x, y, 0.0)}
        standing = replaced(layout, {item: layout.placement(item).model_copy(update=down)})
        for place in islice(berths(standing, item), BERTHS):
            yield apply(standing, place)
