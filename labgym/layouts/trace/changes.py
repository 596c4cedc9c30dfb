"""The difference between two states of a layout, from which the second follows exactly."""

from __future__ import annotations

from typing import Annotated, Self

from pydantic import Field

from labgym.documents import Record
from labgym.errors import LabgymError
from labgym.layouts.floor import Identifier
from labgym.layouts.model import Layout
from labgym.layouts.placement import Placement
from labgym.layouts.records import Assignments, Zones

MOST_PLACEMENTS = 2000


class StateChange(Record):
    """Placements that differ between two states of a layout.

    Attributes:
        placed: the placements that are new or differ, as they are after the change.
        removed: ids of the placements that the change removes.
        order: ids of all placements after the change; None if the others keep their order and new ones follow them.
        zones, assignment: functional zones and their assignment after the change; None if they stay.
    """

    placed: Annotated[tuple[Placement, ...], Field(max_length=MOST_PLACEMENTS)] = ()
    removed: Annotated[tuple[Identifier, ...], Field(max_length=MOST_PLACEMENTS)] = ()
    order: Annotated[tuple[Identifier, ...], Field(max_length=MOST_PLACEMENTS)] | None = None
    zones: Zones | None = None
    assignment: Assignments | None = None

    @classmethod
    def between(cls, before: Layout, after: Layout) -> Self:
        """Return the change that leads from one state of a layout to another."""
        placed = tuple(item for item in after.placements if before.by_id.get(item.id) != item)
        removed = tuple(item.id for item in before.placements if item.id not in after.by_id)
        order = tuple(item.id for item in after.placements)
        return cls(
            placed=placed,
            removed=removed,
            order=None if cls(placed=placed, removed=removed)._order(before) == order else order,
            zones=None if after.zones == before.zones else after.zones,
            assignment=None if after.assignment == before.assignment else after.assignment,
        )

    @property
    def empty(self) -> bool:
        """Whether the change is empty."""
        return self == type(self)()

    def apply(self, layout: Layout) -> Layout:
        """Return the layout after the change.

        Raises:
            LabgymError: the change removes or orders placements that do not exist.
            DocumentError: the result names assets or supports that do not exist.
        """
        if self.empty:
            return layout
        items = {**layout.by_id, **{item.id: item for item in self.placed}}
        order = self._order(layout) if self.order is None else self.order
        unknown = [name for name in (*self.removed, *order) if name not in items]
        if unknown or len(set(order)) < len(order):
            raise LabgymError(f"the change does not fit the layout: {unknown[0] if unknown else 'a repeated id'!r}")
        changed = layout.replace(
            placements=tuple(items[name] for name in order),
            zones=layout.zones if self.zones is None else self.zones,
            assignment=layout.assignment if self.assignment is None else self.assignment,
        )
        changed.check_references("change")
        return changed

    def _order(self, layout: Layout) -> tuple[str, ...]:
        kept = [item.id for item in layout.placements if item.id not in self.removed]
        return (*kept, *(item.id for item in self.placed if item.id not in layout.by_id))
