"""Which existing pieces take the role of an asset that is asked for: equal or larger ones of its kind."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from typing import Any

from labgym.assets import Asset, Catalog

SLACK = 0.01
"""A piece may be this much smaller along a side, meters: rounding of catalogs."""
SMALLER_IS_BETTER = frozenset({"resolution_g", "ultimate_mbar", "oxygen_ppm", "moisture_ppm"})
"""Specifications of which less is more."""
NOT_COMPARED = frozenset({"power_W", "sash_open_m", "joint", "notes", "screen_in", "pieces", "places"})
"""Specifications that say nothing about what a piece is good for."""
WARE = frozenset({"glassware", "ceramic", "plasticware", "consumable", "support", "tool"})
"""Categories of ware, whose sizes protocols choose."""


def takes_role(asset: Asset, wanted: Asset) -> bool:
    """Return whether an asset takes the role of another: of its kind, as large, and as capable."""
    if asset.role == wanted.role:
        return True
    alike = all(
        getattr(asset, name) == getattr(wanted, name)
        for name in ("kind", "category", "subtype", "placing", "storage_class", "heat_class", "fume_hood")
    )
    if not alike or asset.kind == "reagent" or asset.category in WARE:
        return False
    if asset.size.width < wanted.size.width - SLACK or asset.size.depth < wanted.size.depth - SLACK:
        return False
    return len(asset.surfaces) >= len(wanted.surfaces) and _as_capable(asset, wanted)


def with_role(asset: Asset, role: str) -> Asset:
    """Return a catalog entry as a variant of the asset whose role it takes."""
    return asset if asset.role == role else asset.model_copy(update={"variant_of": role})


def stand_ins(catalog: Catalog, required: Iterable[str], existing: Mapping[str, int]) -> dict[str, str]:
    """Return which existing assets take the role of required ones that do not exist, by the name of the required one.

    Args:
        required: names of assets, one for each piece.
        existing: number of pieces by asset name.
    """
    needed = Counter(catalog.find(name).name for name in required)
    spare = Counter({name: count - needed[name] for name, count in sorted(existing.items())})
    chosen: dict[str, str] = {}
    for name, count in sorted(needed.items()):
        if existing.get(name, 0) >= count:
            continue
        wanted = catalog.get(name)
        able = [catalog.get(other) for other in spare if other != name and spare[other] >= count]
        able = [asset for asset in able if takes_role(asset, wanted)]
        if able:
            best = min(able, key=lambda asset: (asset.size.width * asset.size.depth, asset.name))
            chosen[name] = best.name
            spare[best.name] -= count
    return chosen


def _as_capable(asset: Asset, wanted: Asset) -> bool:
    own, others = asset.specs.model_dump(), wanted.specs.model_dump()
    if not set(others.get("features", ())) <= set(own.get("features", ())):
        return False
    return all(
        _covers(name, own.get(name), value)
        for name, value in others.items()
        if name not in NOT_COMPARED and name != "features" and value not in (None, ())
    )


def _covers(name: str, own: Any, wanted: Any) -> bool:
    """Whether a specification is as good as another one of the same name."""
    if own is None:
        return False
    if isinstance(wanted, int | float):
        return bool(own <= wanted if name in SMALLER_IS_BETTER else own >= wanted)
    if isinstance(wanted, tuple) and len(wanted) == 2:
        return bool(own[0] <= wanted[0] and own[1] >= wanted[1])
    return bool(own == wanted)
