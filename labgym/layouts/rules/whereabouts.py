"""Where a protocol's assets are in a layout."""

from __future__ import annotations

from dataclasses import dataclass

from labgym.layouts.placement import FLOOR, WALL
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.presence import resolved
from labgym.protocols import Protocol


@dataclass(frozen=True)
class Whereabouts:
    """The rows of a protocol's assets, by any name that the catalog knows them under."""

    arrangement: Arrangement
    protocol: Protocol

    def role(self, name: str) -> str:
        """Return the role of an asset that the protocol names."""
        catalog = self.arrangement.layout.catalog
        return catalog.get(resolved((name,), catalog)[0]).role

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
