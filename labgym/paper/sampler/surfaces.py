"""Stands things on benches and in cabinets as the sampler does, with its errors.

Without errors an instrument stands where the protocol puts it or first uses it, a reagent in the cabinet of its storage
class, nothing overlaps, and glassware keeps away from edges.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from labgym.assets import Asset
from labgym.layouts.brief import Content, Unit
from labgym.layouts.request import Request
from labgym.layouts.rules.thresholds import CORROSIVE_HEIGHT
from labgym.layouts.stocking import BENCH_MARGIN, SHELF_MARGIN, home
from labgym.layouts.tabletop import GAP, SurfaceItem, SurfaceSpot, pack
from labgym.paper.sampler.inventory import SampledInventory
from labgym.paper.sampler.rates import Slips

MISJUDGED = (0.3, 0.6)
"""Least and greatest share by which the size of an item is underestimated."""
OVERHANG = (0.2, 0.45)
"""Share of the depth of an item that hangs over the edge."""
REACH = (0.01, 0.04)
"""Distance of glassware from the front edge, meters."""
STEP = 0.02
"""Spacing of the places tried along an edge, meters."""


@dataclass(frozen=True)
class Resting:
    """An object in or on a unit, and the height of its bottom above the unit's, meters."""

    content: Content
    height: float


@dataclass(frozen=True)
class _Thing:
    """An object to place: a key that is unique in the proposal, its entry, and why it is in the room."""

    key: str
    asset: Asset
    reason: str


def stock_furniture(request: Request, inventory: SampledInventory, slips: Slips) -> dict[str, tuple[Resting, ...]]:
    """Return what each unit holds, by unit id. Every thing that is not forgotten has a place, if need be a bad one."""
    units = {unit.id: unit for unit in inventory.units}
    if not any(unit.asset.surfaces for unit in inventory.units):
        return {}
    shelved, left_out = _reagents(request, inventory, slips)
    waiting = _instruments(request, units, slips)
    for unit_id, things in left_out.items():
        waiting.setdefault(unit_id, []).extend(things)
    resting: dict[str, list[Resting]] = {unit_id: [] for unit_id in units}
    for unit_id, things in shelved.items():
        resting[unit_id] += _shelved(units[unit_id].asset, things, slips)
    spilled: list[_Thing] = []
    for unit_id, things in sorted(waiting.items()):
        spilled += _stood(request, units[unit_id].asset, things, resting[unit_id], slips)
    for unit in _worktops(inventory.units):
        spilled = _stood(request, unit.asset, spilled, resting[unit.id], slips)
    _pile(spilled, inventory.units, resting)
    return {unit_id: tuple(each) for unit_id, each in resting.items() if each}


def contents_of(resting: Mapping[str, Sequence[Resting]]) -> dict[str, tuple[Content, ...]]:
    """Return the contents of units without their heights."""
    return {unit_id: tuple(each.content for each in some) for unit_id, some in resting.items()}


def _instruments(request: Request, units: Mapping[str, Unit], slips: Slips) -> dict[str, list[_Thing]]:
    """Instruments by the unit on which they belong."""
    first: dict[str, Unit] = {}
    for unit in units.values():
        first.setdefault(unit.asset.role, unit)
    homes: dict[str, list[_Thing]] = {}
    for number, name in enumerate(request.protocol.instruments):
        asset = request.catalog.find(name)
        key = f"{asset.name}/{number}"
        if asset.placing == "floor" or slips.happens("thing_forgotten", key):
            continue
        unit_id, reason = home(request, asset, first)
        homes.setdefault(unit_id, []).append(_Thing(key, asset, reason))
    return homes


def _reagents(
    request: Request, inventory: SampledInventory, slips: Slips
) -> tuple[dict[str, list[_Thing]], dict[str, list[_Thing]]]:
    """Reagents by the cabinet in which they are stored, and by the unit on which they are left."""
    places = {unit.asset.role: unit.id for unit in reversed(inventory.units) if unit.asset.surfaces}
    shelved: dict[str, list[_Thing]] = {}
    left_out: dict[str, list[_Thing]] = {}
    for cabinet in inventory.cabinets:
        others = [other.id for other in inventory.cabinets if other.asset.storage_class != cabinet.asset.storage_class]
        for asset in cabinet.reagents:
            if slips.happens("thing_forgotten", asset.name):
                continue
            step = next((step for step in request.protocol.steps if asset.name in step.uses), None)
            place = places.get(step.location) if step is not None else None
            if place is not None and slips.happens("reagent_left_out", asset.name):
                left_out.setdefault(place, []).append(_Thing(asset.name, asset, "left where a step uses it"))
            elif others and slips.happens("cabinet_confused", asset.name):
                wrong = others[slips.choice("cabinet_confused", asset.name, len(others))]
                shelved.setdefault(wrong, []).append(_Thing(asset.name, asset, "stored in another class's cabinet"))
            else:
                reason = f"reagent of the protocol, storage class {cabinet.asset.storage_class}"
                shelved.setdefault(cabinet.id, []).append(_Thing(asset.name, asset, reason))
    return shelved, left_out


def _worktops(units: Sequence[Unit]) -> list[Unit]:
    """Benches and hoods, the surfaces on which anything may stand; benches first."""
    able = [unit for unit in units if unit.asset.subtype == "workbench" or unit.asset.fume_hood]
    return sorted(able, key=lambda unit: (unit.asset.fume_hood, unit.id))


def _shelved(cabinet: Asset, things: Sequence[_Thing], slips: Slips) -> Iterator[Resting]:
    """Stand containers on a cabinet's shelves: tall ones low, corrosives below eye level, the fullest shelf last."""
    taken: list[list[SurfaceSpot]] = [[] for _ in cabinet.surfaces]
    for thing in sorted(things, key=lambda thing: (-thing.asset.size.height, thing.key)):
        item = _imagined(thing, SHELF_MARGIN, slips)
        corrosive = thing.asset.hazards.corrosive
        slots = sorted(range(len(cabinet.surfaces)), key=lambda slot: (len(taken[slot]), cabinet.surfaces[slot].z))
        able = [s for s in slots if not corrosive or cabinet.surfaces[s].z + item.height <= CORROSIVE_HEIGHT] or slots
        for slot in able:
            surface = cabinet.surfaces[slot]
            generator = slips.generator("habits", thing.key)
            spots = pack([item], surface.width, surface.depth, surface.headroom, generator, taken[slot])
            if spots:
                break
        spot = spots[0] if spots else SurfaceSpot(0.0, 0.0, 0.0, item.width, item.depth)
        taken[slot].append(spot)
        yield Resting(Content(thing.asset, slot, spot, thing.reason), _height(surface.z, thing, slips))


def _stood(
    request: Request, furniture: Asset, things: Sequence[_Thing], resting: list[Resting], slips: Slips
) -> list[_Thing]:
    """Stand things on a work surface, largest first; return those for which there is no place."""
    if not furniture.surfaces:
        return list(things)
    surface, left = furniture.surfaces[0], []
    taken = [each.content.spot for each in resting if each.content.slot == 0]
    for thing in sorted(things, key=lambda thing: (-thing.asset.size.width * thing.asset.size.depth, thing.key)):
        asset = thing.asset
        glass = asset.hazards.glass_container
        item = _imagined(thing, request.profile.glass if glass else BENCH_MARGIN, slips)
        generator = slips.generator("habits", thing.key)
        overhang = None
        if slips.happens("over_edge", thing.key):
            overhang = slips.between("over_edge", thing.key, OVERHANG) * asset.size.depth
        elif glass and slips.happens("glass_at_edge", thing.key):
            overhang = -slips.between("glass_at_edge", thing.key, REACH)
        if surface.headroom is not None and item.height > surface.headroom:
            left.append(thing)
            continue
        if overhang is not None:
            y = surface.depth / 2.0 + overhang - asset.size.depth / 2.0
            spot = _edge_spot(item, y, surface.width, taken, generator)
        else:
            spot = pack([item], surface.width, surface.depth, None, generator, taken).get(0)
        if spot is None:
            left.append(thing)
            continue
        taken.append(spot)
        resting.append(Resting(Content(asset, 0, spot, thing.reason), _height(surface.z, thing, slips)))
    return left


def _imagined(thing: _Thing, margin: float, slips: Slips) -> SurfaceItem:
    """The item with the size that it is believed to have."""
    size, scale = thing.asset.size, 1.0
    if slips.happens("item_misjudged", thing.key):
        scale = 1.0 - slips.between("item_misjudged", thing.key, MISJUDGED)
    return SurfaceItem(thing.asset.name, scale * size.width, scale * size.depth, size.height, margin)


def _height(height: float, thing: _Thing, slips: Slips) -> float:
    """The height above the unit's bottom at which an item is put, meters."""
    return height + (thing.asset.size.height / 2.0 if slips.happens("height_misjudged", thing.key) else 0.0)


def _edge_spot(
    item: SurfaceItem, y: float, width: float, taken: Sequence[SurfaceSpot], generator: np.random.Generator
) -> SurfaceSpot | None:
    """A free spot along the front edge, at a distance of the item's middle from the surface's; None if it is full."""
    reach = (width - item.width) / 2.0 - BENCH_MARGIN
    places = np.arange(-reach, reach + 1e-9, STEP) if reach > 0.0 else np.zeros(1)
    for x in generator.permutation(places):
        free = all(
            abs(x - spot.x) >= (item.width + spot.width) / 2.0 + GAP
            or abs(y - spot.y) >= (item.depth + spot.depth) / 2.0 + GAP
            for spot in taken
        )
        if free:
            return SurfaceSpot(round(float(x), 4), round(y, 4), 0.0, item.width, item.depth)
    return None


def _pile(things: Sequence[_Thing], units: Sequence[Unit], resting: dict[str, list[Resting]]) -> None:
    """Put what found no place in the middle of the last worktop, whatever stands there."""
    tops = [*_worktops(units), *(unit for unit in units if unit.asset.surfaces)]
    for number, thing in enumerate(things if tops else ()):
        unit = tops[number % len(tops)]
        spot = SurfaceSpot(0.0, 0.0, 0.0, thing.asset.size.width, thing.asset.size.depth)
        resting[unit.id].append(Resting(Content(thing.asset, 0, spot, thing.reason), unit.asset.surfaces[0].z))
