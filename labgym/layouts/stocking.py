"""Puts things on and in furniture, before the furniture has a place in the room: shelves and work surfaces."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from labgym.assets import Asset, Catalog
from labgym.layouts.rules.thresholds import Profile
from labgym.layouts.tabletop import Item, Spot, pack

CORROSIVE_HEIGHT = 1.5
"""Corrosives stand below eye level: their tops stay under this height, metres (storage practice)."""
BENCH_MARGIN = 0.02
"""Margin to the edge for what is not glass, metres."""
SHELF_MARGIN = 0.01
HOME = {
    "weighing": "PreparationBench",
    "analytical": "ValidationPlatform",
    "evaporation": "RotaryEvaporatorStation",
    "drying": "DryingStation",
    "purification": "PurificationBench",
}
"""Where an instrument of a category stands when no step says where it is used."""


@dataclass(frozen=True)
class Stocked:
    """A thing in its furniture: catalogue name, slot of the furniture, and spot relative to that slot's centre."""

    asset: str
    slot: int
    spot: Spot


def shelve(cabinet: Asset, reagents: Iterable[str], generator: np.random.Generator) -> tuple[list[Stocked], list[str]]:
    """Stand reagents on a cabinet's shelves: liquids and tall ones low, corrosives below eye level.

    Returns:
        What was shelved, and the names that found no room.
    """
    catalog = Catalog.load()
    assets = sorted((catalog.get(name) for name in reagents), key=lambda asset: (-asset.size.height, asset.name))
    share = max(2, -(-len(assets) // max(len(cabinet.surfaces), 1)))
    spots: dict[int, list[Spot]] = {}
    stocked: list[Stocked] = []
    left: list[str] = []
    for asset in assets:
        for full in (share, 1000):
            found = _shelf_spot(cabinet, asset, spots, full, generator)
            if found is not None:
                break
        if found is None:
            left.append(asset.name)
            continue
        spots.setdefault(found.slot, []).append(found.spot)
        stocked.append(found)
    return stocked, left


def _shelf_spot(
    cabinet: Asset, asset: Asset, spots: dict[int, list[Spot]], full: int, generator: np.random.Generator
) -> Stocked | None:
    corrosive = asset.hazards.acid or asset.hazards.base
    item = _item(asset, SHELF_MARGIN)
    for slot, surface in enumerate(cabinet.surfaces):
        taken = spots.get(slot, [])
        if len(taken) >= full or (corrosive and surface.z + asset.size.height > CORROSIVE_HEIGHT):
            continue
        found = pack([item], surface.width, surface.depth, surface.headroom, generator, taken)
        if found:
            return Stocked(asset.name, slot, found[0])
    return None


def furnish_surface(
    furniture: Asset,
    names: Sequence[str],
    profile: Profile,
    generator: np.random.Generator,
    standing: Sequence[Stocked] = (),
) -> tuple[list[Stocked], list[str]]:
    """Stand instruments on a work surface beside what stands there.

    Glassware keeps `profile.glass` from the edges where the surface allows it.

    Returns:
        What was placed, and the names that found no room.
    """
    catalog = Catalog.load()
    if not furniture.surfaces:
        return [], list(names)
    surface = furniture.surfaces[0]
    items = []
    for name in names:
        asset = catalog.get(name)
        items.append(_item(asset, profile.glass if asset.hazards.glass_container else BENCH_MARGIN))
    taken = [item.spot for item in standing]
    found = pack(items, surface.width, surface.depth, surface.headroom, generator, taken)
    stocked = [Stocked(names[index], 0, spot) for index, spot in sorted(found.items())]
    return stocked, [name for index, name in enumerate(names) if index not in found]


def _item(asset: Asset, margin: float) -> Item:
    return Item(asset.name, asset.size.width, asset.size.depth, asset.size.height, margin)
