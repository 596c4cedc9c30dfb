"""Changes between two assessed states of a layout: a rule that looks at none of them keeps its results."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

from labgym.layouts.placement import FLOOR, WALL

if TYPE_CHECKING:
    from labgym.layouts.rules.arrangement import Arrangement
    from labgym.layouts.rules.site import Site

LooksAt = Callable[["Site", int], object]
"""Returns all that a rule looks at of the object in a row, None if it does not look at the object. A rule with one
depends on nothing else but the floor, the protocols, the thresholds, and the order of the objects."""


def standing(site: Site, row: int) -> object:
    """Look at what stands on the floor or hangs on a wall."""
    placement = site.arrangement.placements[row]
    return placement if placement.support in (FLOOR, WALL) else None


def reagents(site: Site, row: int) -> object:
    """Look at reagents."""
    return site.arrangement.placements[row] if site.arrangement.assets[row].kind == "reagent" else None


def nothing(*_: object) -> object:
    """Look at no object: the rule is about the building."""
    return None


def chemicals(site: Site, row: int) -> object:
    """Look at reagents, cabinets, heat sources and what protocols name, and at the kinds of others."""
    placement, asset = site.arrangement.placements[row], site.arrangement.assets[row]
    holds = asset.kind == "reagent" or asset.heat_class is not None or asset.storage_class is not None
    named = not site.named.isdisjoint((placement.asset, asset.name, asset.role))
    return placement if holds or named else kinds(site, row)


def kinds(site: Site, row: int) -> object:
    """Look at what objects are and what they stand on, not at where."""
    placement = site.arrangement.placements[row]
    return placement.id, placement.asset, placement.role, placement.size, placement.support, placement.slot


@dataclass(frozen=True)
class StateChanges:
    """The objects that differ between two states of a layout: the row of each in both, None where it is absent."""

    before: Site
    after: Site
    rows: tuple[tuple[int | None, int | None], ...]

    @classmethod
    def between(cls, before: Site, after: Site) -> StateChanges | None:
        """Compare two states; None if more than objects differs, or their order."""
        old, new = before.arrangement.layout, after.arrangement.layout
        same = (
            new.floor is old.floor
            and new.catalog is old.catalog
            and new.protocols == old.protocols
            and new.zones == old.zones
            and new.assignment == old.assignment
            and before.protocol == after.protocol
            and before.profile == after.profile
            and before.arrangement.others == after.arrangement.others
        )
        rows = changed_rows(before.arrangement, after.arrangement) if same else None
        return None if rows is None else cls(before, after, rows)

    def concern(self, looks_at: LooksAt | None) -> bool:
        """Whether a rule looks at something that has changed; a rule that does not say what looks at everything."""
        if looks_at is None:
            return bool(self.rows)
        for old, new in self.rows:
            view = None if old is None else looks_at(self.before, old)
            if view != (None if new is None else looks_at(self.after, new)):
                return True
        return False


def changed_rows(before: Arrangement, after: Arrangement) -> tuple[tuple[int | None, int | None], ...] | None:
    """Return the rows of the objects that differ; None if the others are in another order."""
    if len(before) == len(after):
        pairs = list(zip(before.placements, after.placements, strict=True))
        if all(old is new or old.id == new.id for old, new in pairs):
            return tuple((row, row) for row, (old, new) in enumerate(pairs) if old is not new and old != new)
    kept = [(old, after.index[one.id]) for old, one in enumerate(before.placements) if one.id in after.index]
    if any(first[1] > second[1] for first, second in pairwise(kept)):
        return None
    gone = [(row, None) for row, one in enumerate(before.placements) if one.id not in after.index]
    new = [(None, row) for row, one in enumerate(after.placements) if one.id not in before.index]
    moved = [(old, row) for old, row in kept if before.placements[old] != after.placements[row]]
    return (*moved, *gone, *new)
