"""Decides which storage cabinets a protocol's reagents need: one a storage class, more where contents clash."""

from __future__ import annotations

from dataclasses import dataclass

from labgym.assets import Asset, Catalog
from labgym.layouts.rules.separation import hazard_between
from labgym.layouts.rules.thresholds import Profile
from labgym.protocols import Protocol

CABINETS = {
    "Flammable": "FlammableCabinet",
    "Acid": "AcidCabinet",
    "Base": "BaseCabinet",
    "Oxidizer": "OxidizerCabinet",
    "Toxic": "ToxicCabinet",
    "WaterReactive": "WaterReactiveCabinet",
    "Refrigerator": "FlammableSafeRefrigerator",
    "Gas": "GasCylinderCabinet",
    "General": "GeneralCabinet",
}
"""Catalogue name of the cabinet for each storage class."""
CAPACITY = {"Gas": 2, "Refrigerator": 12}
"""Containers that a cabinet of a class takes; 16 where not named."""


@dataclass(frozen=True)
class Cabinet:
    """A cabinet and the reagents that it will store, catalogue names."""

    asset: str
    reagents: tuple[str, ...]


def plan_cabinets(protocol: Protocol, profile: Profile) -> tuple[Cabinet, ...]:
    """Return the fewest cabinets that a greedy colouring finds, no two incompatible reagents in one.

    Reagents of one storage class share a cabinet; the incompatibility graph within the class is coloured, the
    most entangled reagent first, and each colour becomes a cabinet of its own.
    """
    catalog = Catalog.load()
    by_class: dict[str, list[Asset]] = {}
    for use in protocol.reagents:
        asset = catalog.find(use.name)
        storage = asset.chemistry.storage_class if asset.chemistry is not None else "General"
        by_class.setdefault(storage, []).append(asset)
    return tuple(
        Cabinet(CABINETS[storage], tuple(asset.name for asset in group))
        for storage in CABINETS
        for group in _coloured(by_class.get(storage, []), profile, CAPACITY.get(storage, 16))
    )


def clashing(first: Cabinet, second: Cabinet, profile: Profile) -> str | None:
    """Return the hazard of the first incompatible pair across two cabinets, None where there is none."""
    for one in first.reagents:
        for other in second.reagents:
            hazard = hazard_between(one, other, profile.pairs)
            if hazard is not None:
                return f"{one} and {other}: {hazard.hazard}"
    return None


def _coloured(assets: list[Asset], profile: Profile, capacity: int) -> list[list[Asset]]:
    def clashes(one: Asset, other: Asset) -> bool:
        return hazard_between(one.name, other.name, profile.pairs) is not None

    degree = {asset.name: sum(clashes(asset, other) for other in assets) for asset in assets}
    groups: list[list[Asset]] = []
    for asset in sorted(assets, key=lambda asset: (-degree[asset.name], asset.name)):
        home = next((g for g in groups if len(g) < capacity and not any(clashes(asset, other) for other in g)), None)
        if home is None:
            groups.append([asset])
        else:
            home.append(asset)
    return groups
