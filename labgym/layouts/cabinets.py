"""The storage cabinets that a protocol needs: one per storage class, several if reagents in it are incompatible."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import count

from labgym.assets import Asset
from labgym.layouts.request import Request
from labgym.layouts.rules.separation import hazard_between
from labgym.layouts.rules.thresholds import Profile

LEAST_SHELVES = 0.8
"""Least area of shelves of a cabinet that takes the place of the usual one, relative to it."""


@dataclass(frozen=True)
class Cabinet:
    """A cabinet and the reagents that it stores.

    Attributes:
        id: id of the future placement, or of a fixed one.
    """

    id: str
    asset: Asset
    reagents: tuple[Asset, ...]


def plan_cabinets(request: Request) -> tuple[Cabinet, ...]:
    """Return a small set of cabinets in which no two incompatible reagents share one.

    Reagents of one storage class share a cabinet; the incompatibility graph within the class is colored greedily,
    the reagent with most conflicts first, and each color becomes one cabinet.
    """
    by_class: dict[str, list[Asset]] = {}
    for use in request.protocol.reagents:
        asset = request.catalog.find(use.name)
        storage = asset.chemistry.storage_class if asset.chemistry is not None else "General"
        by_class.setdefault(storage, []).append(asset)
    cabinets: list[Cabinet] = []
    for storage, kind in request.habits.cabinets.items():
        groups = _compatible_groups(by_class.get(storage, []), request.profile, kind.capacity)
        for (cabinet_id, asset), group in zip(_offered(request, storage, kind.asset), groups, strict=False):
            cabinets.append(Cabinet(cabinet_id, asset, tuple(group)))
    return tuple(cabinets)


def _offered(request: Request, storage: str, usual: str) -> Iterator[tuple[str, Asset]]:
    """Yield ids and entries of cabinets for a storage class: fixed ones, then those that exist, then usual ones."""
    least = LEAST_SHELVES * _shelves(request.catalog.get(usual))
    classed = [asset for asset in request.catalog if asset.storage_class == storage and asset.placing == "floor"]
    alike = {usual, *(asset.name for asset in classed if _shelves(asset) >= least)}
    counts: Counter[str] = Counter()
    for placement in request.fixed:
        if placement.asset in alike:
            counts[placement.asset] += 1
            asset = request.catalog.get(usual) if placement.asset == usual else request.fixed_asset(placement)
            yield placement.id, asset
    existing = request.holdings.counts if request.holdings is not None else {}
    for name in sorted(alike, key=lambda name: (name != usual, name)):
        for number in range(counts[name] + 1, existing.get(name, 0) + 1):
            counts[name] = number
            yield f"{name}_{number}", request.catalog.get(name)
    for number in count(counts[usual] + 1):
        yield f"{usual}_{number}", request.catalog.get(usual)


def _shelves(asset: Asset) -> float:
    """Area of an asset's shelves, square meters."""
    return sum(surface.width * surface.depth for surface in asset.surfaces)


def conflict_between(first: Cabinet, second: Cabinet, profile: Profile) -> str | None:
    """Return the hazard of the first incompatible pair across two cabinets, or None."""
    for one in first.reagents:
        for other in second.reagents:
            hazard = hazard_between(one, other, profile.pairs)
            if hazard is not None:
                return f"{one.name} and {other.name}: {hazard.hazard}"
    return None


def _compatible_groups(assets: list[Asset], profile: Profile, capacity: int) -> list[list[Asset]]:
    def clash(one: Asset, other: Asset) -> bool:
        return hazard_between(one, other, profile.pairs) is not None

    degree = {asset.name: sum(clash(asset, other) for other in assets) for asset in assets}
    groups: list[list[Asset]] = []
    for asset in sorted(assets, key=lambda asset: (-degree[asset.name], asset.name)):
        group = next((g for g in groups if len(g) < capacity and not any(clash(asset, other) for other in g)), None)
        if group is None:
            groups.append([asset])
        else:
            group.append(asset)
    return groups
