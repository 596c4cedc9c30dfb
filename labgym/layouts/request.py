"""The arguments that a layout is generated from."""

from __future__ import annotations

from dataclasses import dataclass

from labgym.assets import Asset, Catalog
from labgym.layouts.habits import Habits
from labgym.layouts.model import Placement, Room
from labgym.layouts.placement import resized
from labgym.layouts.rules.thresholds import Profile
from labgym.protocols import Protocol


@dataclass(frozen=True)
class Request:
    """Everything that decides a generated layout.

    Attributes:
        seed: 0 to 2^53 - 1.
        catalog: source of every asset. habits: where furniture usually stands.
        fixed: floor and wall objects that must stay where they are.
    """

    protocol: Protocol
    room: Room
    profile: Profile
    seed: int
    catalog: Catalog
    habits: Habits
    fixed: tuple[Placement, ...] = ()

    def fixed_asset(self, placement: Placement) -> Asset:
        """Return the catalog entry of a fixed object, with the object's size if it has one.

        Raises:
            UnknownNameError: the catalog has no such asset.
        """
        asset = self.catalog.get(placement.asset)
        return asset if placement.size is None else resized(asset, placement.size)
