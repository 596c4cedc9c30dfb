"""The storage cabinets that a protocol needs: one per storage class, several if reagents in it are incompatible."""

from __future__ import annotations

from dataclasses import dataclass

from labgym.assets import Asset
from labgym.layouts.request import Request
from labgym.layouts.rules.separation import hazard_between
from labgym.layouts.rules.thresholds import Profile


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
        ids = [placement.id for placement in request.fixed if placement.asset == kind.asset]
        ids += [f"{kind.asset}_{number}" for number in range(len(ids) + 1, len(groups) + 1)]
        for cabinet_id, group in zip(ids, groups, strict=False):
            cabinets.append(Cabinet(cabinet_id, request.catalog.get(kind.asset), tuple(group)))
    return tuple(cabinets)


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
