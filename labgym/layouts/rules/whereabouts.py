"""Which of a protocol's assets a layout lacks, and where the others are."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from functools import lru_cache

from labgym.assets import Catalog
from labgym.layouts.placement import FLOOR, WALL
from labgym.layouts.rules.arrangement import Arrangement
from labgym.protocols import Protocol


def missing_assets(arrangement: Arrangement, protocol: Protocol, out_of_bounds: frozenset[str]) -> tuple[str, ...]:
    """Return the required assets that are not placed, one name for each missing piece.

    Reagents, instruments and step locations are required, as a multiset with synonyms resolved. A variant counts
    as the asset whose role it has; an object that is out of bounds counts as missing.
    """
    placed = Counter(
        asset.role
        for placement, asset in zip(arrangement.placements, arrangement.assets, strict=True)
        if placement.id not in out_of_bounds
    )
    missing = Counter(resolved(protocol.required_assets(), arrangement.layout.catalog))
    missing.subtract(placed)
    return tuple(name for name, count in missing.items() for _ in range(count))


@lru_cache(maxsize=1024)
def resolved(names: tuple[str, ...], catalog: Catalog) -> tuple[str, ...]:
    """Return the canonical names of assets named in any way that the catalog knows.

    Raises:
        UnknownNameError: the catalog has no such asset.
    """
    return tuple(catalog.find(name).name for name in names)


@lru_cache(maxsize=1024)
def role_of(name: str, catalog: Catalog) -> str:
    """Return the role of an asset named in any way that the catalog knows.

    Raises:
        UnknownNameError: the catalog has no such asset.
    """
    return catalog.find(name).role


@dataclass(frozen=True)
class Whereabouts:
    """The rows of a protocol's assets, by any name that the catalog knows them under."""

    arrangement: Arrangement
    protocol: Protocol

    def role(self, name: str) -> str:
        """Return the role of an asset that the protocol names."""
        return role_of(name, self.arrangement.layout.catalog)

    def of_name(self, name: str) -> tuple[int, ...]:
        """Return the rows of an asset that the protocol names; empty if it is not placed."""
        return self.arrangement.by_role.get(self.role(name), ())

    def place(self, location: str) -> int | None:
        """Return the row of a step's location, where the robot's goal pose is; None if it is not placed."""
        found = self.arrangement.layout.find(location)
        return None if found is None else self.arrangement.index.get(found.id)

    def root(self, row: int) -> int:
        """Return the row of the floor or wall object that finally carries an object."""
        return self.arrangement.row(self.arrangement.layout.root(self.arrangement.placements[row].id).id)

    def carriers(self, row: int) -> list[int]:
        """Return the rows of everything that an object stands on or in, the nearest first."""
        carriers = []
        support = self.arrangement.placements[row].support
        while support not in (FLOOR, WALL):
            carriers.append(self.arrangement.row(support))
            support = self.arrangement.placements[carriers[-1]].support
        return carriers
