"""Adds what a protocol requires and a layout lacks: furniture along the walls, objects where they belong."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice

from labgym.assets import Asset
from labgym.layouts.equipping import added_on_wall, heights, hung, marked
from labgym.layouts.habits import Habits
from labgym.layouts.interiors.rearranging import rearrangements
from labgym.layouts.model import Layout
from labgym.layouts.moves import apply, may_move
from labgym.layouts.placement import FLOOR, WALL, Placement
from labgym.layouts.relocation import free_places
from labgym.layouts.repairs.berths import berths
from labgym.layouts.repairs.furniture import middles
from labgym.layouts.repairs.rank import RepairState
from labgym.layouts.repairs.safeguards import broken_rules, faults_of
from labgym.layouts.rules.equipment import missing_equipment
from labgym.layouts.rules.safety.rooms import Lacking, lacking_equipment
from labgym.layouts.rules.safety.signs import EXIT_SIGNS
from labgym.layouts.rules.storage import STORAGE_CLASSES
from labgym.layouts.rules.whereabouts import missing_assets
from labgym.layouts.settling import free_spots, homes
from labgym.protocols import Protocol

PLACES = 6
"""Maximum number of free places tried for a piece of furniture in a space."""
PLACES_IN_ROOM = 60
"""Maximum number of places tried for the safety equipment of a room."""
SPOTS = 12
"""Maximum number of free spots tried for an object."""


def with_missing(state: RepairState) -> RepairState:
    """Return a state with the required assets that it lacks, as far as they find a place.

    Furniture comes first, then reagents, then other objects. Each piece is added where the rank stays best. A reagent
    without a cabinet of its class gets one. Safety equipment that the rule set requires counts, too.
    """
    # An object that is out of bounds counts as missing, but is not added: it is put back.
    absent: tuple[str, ...] = ()
    if state.protocol is not None:
        absent = missing_assets(state.assessment.arrangement, state.protocol, frozenset())
    absent += missing_equipment(state.assessment.arrangement, state.assessment.equipment, frozenset())
    for asset in sorted((state.layout.catalog.find(name) for name in absent), key=_order):
        if asset.kind == "reagent" and not _has_cabinet(state.layout, asset):
            state = _with_one(state, _cabinet_for(state.layout, asset)) or state
        state = _with_one(state, asset) or state
    return state


def with_equipment(state: RepairState) -> RepairState:
    """Return the state with the safety equipment that rooms lack under its rule set, as far as it finds a place."""
    if not state.assessment.rules.equipment:
        return state
    for lacking in lacking_equipment(state.assessment.site):
        present = faults_of(state)
        best: RepairState | None = None
        for candidate in islice(_in_room(state, lacking), PLACES_IN_ROOM):
            larger = state.with_layout(candidate)
            if larger.rank.cost < state.rank.cost and (best is None or larger.rank < best.rank):
                best = larger
                if not faults_of(larger) - present:
                    break
        state = best or state
    return state


def with_signs(state: RepairState) -> RepairState:
    """Return the state with signs at its exits, under a rule set that asks for them."""
    if not any(issue.rule == EXIT_SIGNS.name for issue in broken_rules(state)):
        return state
    signed = state.with_layout(marked(state.layout, state.protocol))
    return signed if signed.rank < state.rank else state


def with_cabinets(state: RepairState) -> RepairState:
    """Return the state with each reagent out of storage in a new cabinet, if the layout has none of its class."""
    for instance in state.assessment.of("storage"):
        reagent = instance.ids[0]
        asset = state.layout.asset(reagent)
        if not instance.hard or _has_cabinet(state.layout, asset) or not may_move(state.layout, reagent):
            continue
        larger = _with_one(state, _cabinet_for(state.layout, asset))
        if larger is None:
            continue
        for support, slot in homes(larger.layout, reagent, state.protocol):
            spots = free_spots(larger.layout, reagent, support, slot, state.profile, most=1)
            proposed = [larger.with_layout(apply(larger.layout, spot)) for spot in spots]
            if proposed and proposed[0].rank < state.rank:
                state = proposed[0]
                break
    return state


def _order(asset: Asset) -> tuple[int, float, str]:
    rank = 0 if asset.placing in ("floor", "wall") else 1 if asset.kind == "reagent" else 2
    return rank, -asset.size.width * asset.size.depth, asset.name


def _class_of(reagent: Asset) -> str:
    return reagent.chemistry.storage_class if reagent.chemistry is not None else "General"


def _has_cabinet(layout: Layout, reagent: Asset) -> bool:
    storage = _class_of(reagent)
    return any(layout.asset(p.id).storage_class == storage for p in layout.placements if p.support == FLOOR)


def _cabinet_for(layout: Layout, reagent: Asset) -> Asset:
    storage = _class_of(reagent)
    kinds: dict[str, str] = {name: kind.asset for name, kind in Habits.published().cabinets.items()}
    return layout.catalog.get(kinds[storage if storage in STORAGE_CLASSES else "General"])


def _with_one(state: RepairState, asset: Asset) -> RepairState | None:
    """Return the state with one more piece at the best of the first places that are free, None if none is."""
    best: RepairState | None = None
    for candidate in _candidates(state, asset):
        larger = state.with_layout(candidate)
        if best is None or larger.rank < best.rank:
            best = larger
        rank, least = larger.rank, state.rank
        if rank.cost <= least.cost and rank.keeps(least) and rank.shortfall <= least.shortfall:
            break
    return best


def _candidates(state: RepairState, asset: Asset) -> Iterator[Layout]:
    """Yield layouts with one more piece."""
    if asset.placing == WALL:
        return iter(added_on_wall(state.layout, asset, state.protocol))
    if asset.placing == FLOOR:
        return _on_floor(state.layout, asset, state.protocol)
    return _on_surfaces(state, asset)


def _in_room(state: RepairState, lacking: Lacking) -> Iterator[Layout]:
    """Yield layouts with equipment that a room lacks on the walls, or at all berths, of the room."""
    layout, asset, site = state.layout, state.layout.catalog.get(lacking.asset), state.assessment.site
    if asset.placing == WALL:
        for height in heights(site, asset, lacking):
            yield from hung(layout, site, asset, lacking, height, state.protocol)
        return
    for space, (x, y) in middles(layout, asset):
        if space in lacking.spaces:
            trial = _with(layout, asset, (x, y, 0.0), FLOOR, None)
            yield from (apply(trial, place) for place in berths(trial, trial.placements[-1].id))


def _on_floor(layout: Layout, asset: Asset, protocol: Protocol | None) -> Iterator[Layout]:
    """Yield layouts with a piece of furniture at free places of each space, or where the solver makes room for it."""
    trials = [_with(layout, asset, (x, y, 0.0), FLOOR, None) for _, (x, y) in middles(layout, asset)]
    for trial in trials:
        for place in free_places(trial, trial.placements[-1].id, PLACES):
            yield apply(trial, place)
    for trial in trials:
        yield from rearrangements(trial, protocol, {trial.placements[-1].id})


def _on_surfaces(state: RepairState, asset: Asset) -> Iterator[Layout]:
    """Yield layouts with an object on free spots where it belongs."""
    layout = state.layout
    carrier = next((p for p in layout.placements if p.support == FLOOR and layout.asset(p.id).surfaces), None)
    if carrier is None or asset.placing != "desktop":
        return
    trial = _with(layout, asset, carrier.position, carrier.id, 0)
    name, count = trial.placements[-1].id, 0
    for support, slot in homes(trial, name, state.protocol, stays=state.seeded):
        for spot in free_spots(trial, name, support, slot, state.profile, most=1):
            yield apply(trial, spot)
            count += 1
        if count >= SPOTS:
            return


def _with(layout: Layout, asset: Asset, position: tuple[float, float, float], support: str, slot: int | None) -> Layout:
    """Return the layout with one more placement, under the next free id."""
    numbers = [placement.id.rpartition("_")[2] for placement in layout.placements if placement.asset == asset.name]
    number = 1 + max((int(text) for text in numbers if text.isdecimal()), default=0)
    while f"{asset.name}_{number}" in layout.by_id:
        number += 1
    placement = Placement(id=f"{asset.name}_{number}", asset=asset.name, position=position, support=support, slot=slot)
    return layout.replace(placements=(*layout.placements, placement))
