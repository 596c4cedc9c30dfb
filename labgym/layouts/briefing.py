"""Writes the brief of a room for a protocol: furniture, what it holds, and the distances that hazards ask for."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from labgym.assets import Catalog
from labgym.errors import InfeasibleError
from labgym.layouts.brief import Brief, Nearness, Separation, Unit, Wall
from labgym.layouts.cabinets import Cabinet, clashing, plan_cabinets
from labgym.layouts.furnishing import (
    AISLE,
    HEAVY_AISLE,
    Furnishing,
    Side,
    extra_units,
    filling_units,
    habitual_unit,
    island_units,
    location_units,
)
from labgym.layouts.model import Room
from labgym.layouts.rules.separation import heat_band
from labgym.layouts.rules.thresholds import Profile
from labgym.layouts.stocking import HOME, Stocked, furnish_surface, shelve
from labgym.protocols import Protocol

MARGIN = 0.02
"""Added to every distance between hazards, metres, so that rounding never undercuts a threshold."""
NEARNESS = (
    Nearness("FumeHood_1", "RotaryEvaporatorStation_1", 2),
    Nearness("FumeHood_1", "FumeHood1200_1", 2),
    Nearness("FumeHood_1", "WasteStation_1", 1),
    Nearness("FumeHood_1", "EyewashStation_1", 1),
    Nearness("SinkBench_1", "GlasswareCabinet_1", 1),
    Nearness("SinkBench_1", "DryingStation_1", 1),
)


@dataclass(frozen=True)
class StockedBrief:
    """A brief and what each of its units holds."""

    brief: Brief
    stock: Mapping[str, tuple[Stocked, ...]]


def write_brief(
    protocol: Protocol, room: Room, profile: Profile, furnishing: Furnishing, generator: np.random.Generator
) -> StockedBrief:
    """Return the brief of a room and the stock of its furniture.

    Raises:
        InfeasibleError: something that the protocol requires fits on no surface or shelf.
    """
    sides: dict[Side, Wall] = {"front": "front", "back": "back", "store": "left", "work": "right"}
    if generator.random() < 0.5:
        sides |= {"store": "right", "work": "left"}
    cabinets = _numbered(plan_cabinets(protocol, profile))
    units = [
        *location_units(protocol, sides, room, generator),
        *extra_units(furnishing, sides, room, generator),
        *(habitual_unit(cabinet.asset, unit_id, sides, room, generator) for unit_id, cabinet in cabinets.items()),
        *_floor_instruments(protocol, sides, room, generator),
        *island_units(room, furnishing, generator),
    ]
    if furnishing == "full":
        units += filling_units(units, sides, room, generator)
    stock = _stock(protocol, units, cabinets, profile, generator)
    ids = {unit.id for unit in units}
    roomy = furnishing == "full"
    brief = Brief(
        units=tuple(units if roomy else (_tightened(unit) for unit in units)),
        separations=tuple(_separations(cabinets, stock, profile)),
        nearness=tuple(liking for liking in NEARNESS if {liking.first, liking.second} <= ids),
        hoods=tuple(unit.id for unit in units if Catalog.load().get(unit.asset).fume_hood),
        aisle=HEAVY_AISLE if roomy else AISLE,
        furnishing=furnishing,
    )
    return StockedBrief(brief, stock)


def _tightened(unit: Unit) -> Unit:
    """In a tight room a hood keeps 1.2 m free before it instead of 1.5 m."""
    return Unit(**{**vars(unit), "front": min(unit.front, 1.2)})


def _numbered(cabinets: Iterable[Cabinet]) -> dict[str, Cabinet]:
    numbered: dict[str, Cabinet] = {}
    for cabinet in cabinets:
        count = sum(other.asset == cabinet.asset for other in numbered.values())
        numbered[f"{cabinet.asset}_{count + 1}"] = cabinet
    return numbered


def _floor_instruments(
    protocol: Protocol, sides: dict[Side, Wall], room: Room, generator: np.random.Generator
) -> list[Unit]:
    catalog = Catalog.load()
    units: list[Unit] = []
    for name in protocol.instruments:
        asset = catalog.find(name)
        if asset.placing == "floor":
            number = 2 + sum(unit.asset == asset.name for unit in units)
            units.append(habitual_unit(asset.name, f"{asset.name}_{number}", sides, room, generator))
    return units


def _stock(
    protocol: Protocol,
    units: list[Unit],
    cabinets: Mapping[str, Cabinet],
    profile: Profile,
    generator: np.random.Generator,
) -> dict[str, tuple[Stocked, ...]]:
    catalog = Catalog.load()
    stock: dict[str, tuple[Stocked, ...]] = {}
    for unit_id, cabinet in cabinets.items():
        shelved, left = shelve(catalog.get(cabinet.asset), cabinet.reagents, generator)
        if left:
            raise InfeasibleError(protocol.id, [f"{cabinet.asset} has no shelf for {', '.join(left)}"], None)
        stock[unit_id] = tuple(shelved)
    waiting: dict[str, list[str]] = {}
    for name in protocol.instruments:
        asset = catalog.find(name)
        if asset.placing != "floor":
            waiting.setdefault(_home(protocol, asset.name, units), []).append(asset.name)
    furniture = {unit.id: catalog.get(unit.asset) for unit in units}
    homeless: list[str] = []
    for unit_id, names in sorted(waiting.items()):
        placed, left = furnish_surface(furniture[unit_id], sorted(names, key=_heat_first), profile, generator)
        stock[unit_id] = tuple(placed)
        homeless += left
    benches = [unit_id for unit_id, asset in furniture.items() if asset.subtype == "workbench" or asset.fume_hood]
    for unit_id in sorted(benches, key=lambda unit_id: (unit_id in stock, not _is_island(unit_id), unit_id)):
        standing = stock.get(unit_id, ())
        placed, homeless = furnish_surface(furniture[unit_id], homeless, profile, generator, standing)
        stock[unit_id] = (*standing, *placed)
    if homeless:
        raise InfeasibleError(protocol.id, [f"no work surface has room for {', '.join(homeless)}"], None)
    return stock


def _home(protocol: Protocol, instrument: str, units: list[Unit]) -> str:
    """Unit where an instrument stands: as the protocol says, else where it is first used, else by category."""
    catalog, ids = Catalog.load(), {unit.id for unit in units}
    said = [rule.object for rule in protocol.spatial_constraints if rule.kind == "on" and rule.subject == instrument]
    used = [step.location for step in protocol.steps if instrument in step.uses]
    usual = HOME.get(catalog.get(instrument).category, "FumeHood")
    for location in (*said, *used, usual):
        if f"{location}_1" in ids and catalog.get(location).surfaces:
            return f"{location}_1"
    return "FumeHood_1"


def _heat_first(name: str) -> tuple[bool, str]:
    return Catalog.load().get(name).heat_class is None, name


def _is_island(unit_id: str) -> bool:
    return unit_id.startswith(("IslandBench", "Peninsula"))


def _separations(
    cabinets: Mapping[str, Cabinet], stock: Mapping[str, tuple[Stocked, ...]], profile: Profile
) -> Iterable[Separation]:
    catalog = Catalog.load()
    for unit_id, stocked in stock.items():
        bands = [band for item in stocked if (band := heat_band(catalog.get(item.asset), profile)) is not None]
        for cabinet_id, cabinet in cabinets.items():
            burning = [name for name in cabinet.reagents if catalog.get(name).hazards.flammable]
            if bands and burning:
                distance = max(band.d_min for band in bands) + MARGIN
                yield Separation(cabinet_id, unit_id, distance, f"{burning[0]} is flammable")
    for first, second in combinations(cabinets, 2):
        hazard = clashing(cabinets[first], cabinets[second], profile)
        if hazard is not None:
            yield Separation(first, second, profile.incompatible.d_min + MARGIN, hazard)
