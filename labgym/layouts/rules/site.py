"""A layout as the rules read it: rooms, what they hold and handle, wet fittings, distances in plan, walks."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from labgym.assets import Asset
from labgym.geometry import BoxArray, OrientedBox, pairwise_distance
from labgym.layouts.floor.spaces import OUTSIDE
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.handling import Handling, handlings
from labgym.layouts.rules.safety.hazards import hazardous
from labgym.layouts.rules.safety.roadmap import Roadmap
from labgym.layouts.rules.supplies import WET
from labgym.layouts.rules.thresholds import PROFILES, Profile
from labgym.layouts.rules.whereabouts import role_of
from labgym.protocols import Protocol

PLAN_HEIGHTS_M = (0.0, 1.0)
"""Heights of boxes whose distances are measured in plan, meters."""


@dataclass(frozen=True)
class Site:
    """A layout, the protocols that are run in it, and the thresholds that apply.

    Attributes:
        protocol: the protocol that the layout is assessed for.
    """

    arrangement: Arrangement
    protocol: Protocol | None = None
    profile: Profile = PROFILES["default"]

    @cached_property
    def protocols(self) -> tuple[Protocol, ...]:
        """The protocol that the layout is assessed for, and those that the layout embeds."""
        named = () if self.protocol is None else (self.protocol,)
        return (*named, *(other for other in self.arrangement.layout.protocols if other != self.protocol))

    @cached_property
    def named(self) -> frozenset[str]:
        """Assets that the protocols name as locations, as what a step uses, and in constraints; their roles, too."""
        names = set[str]()
        for protocol in self.protocols:
            names.update(name for step in protocol.steps for name in (step.location, *step.uses))
            names.update(name for rule in protocol.spatial_constraints for name in (rule.subject, rule.object))
        catalog = self.arrangement.layout.catalog
        return frozenset(names).union(role_of(name, catalog) for name in names)

    @cached_property
    def rooms(self) -> NDArray[np.intp]:
        """Room of each space, shape (spaces,): spaces that passages without a door join are one room."""
        spaces = self.arrangement.layout.floor.spaces
        index = {space.id: k for k, space in enumerate(spaces)}
        rooms = np.arange(len(spaces))
        for way in self.arrangement.layout.floor.doorways if len(spaces) > 1 else ():
            if way.opening.kind == "passage" and OUTSIDE not in way.spaces:
                first, second = (rooms[index[name]] for name in way.spaces)
                rooms[rooms == max(first, second)] = min(first, second)
        return rooms

    def room(self, row: int) -> int:
        """Return the room of an object."""
        return int(self.rooms[self.arrangement.spaces[row]])

    def name(self, room: int) -> str:
        """Return the name of a room in messages: the id of its first space."""
        return repr(self.arrangement.layout.floor.spaces[room].id)

    @cached_property
    def handled_by(self) -> tuple[tuple[Handling, ...], ...]:
        """Reagents and vessels of each protocol at its locations."""
        return tuple(handlings(self.arrangement, protocol) for protocol in self.protocols)

    @property
    def handled_now(self) -> tuple[Handling, ...]:
        """Reagents and vessels of the protocol that the layout is assessed for; empty without one."""
        return () if self.protocol is None else self.handled_by[0]

    @cached_property
    def handled(self) -> tuple[Handling, ...]:
        """Reagents and vessels of all protocols at their locations."""
        return tuple(place for places in self.handled_by for place in places)

    def reagents_of(self, place: Handling) -> tuple[Asset, ...]:
        """Return the reagents that are handled at a place."""
        if place.reagents not in self._reagents:
            catalog = self.arrangement.layout.catalog
            self._reagents[place.reagents] = tuple(catalog.get(name) for name in sorted(place.reagents))
        return self._reagents[place.reagents]

    @cached_property
    def _reagents(self) -> dict[frozenset[str], tuple[Asset, ...]]:
        """Reagents that have been looked up, by their names."""
        return {}

    @cached_property
    def contents(self) -> dict[int, tuple[tuple[str, Asset], ...]]:
        """Reagents and cylinders by room: the id of the placement that holds or handles each, and the asset."""
        contents: dict[int, dict[tuple[str, str], Asset]] = {}
        arrangement = self.arrangement
        for row, asset in enumerate(arrangement.assets):
            if asset.kind == "reagent" or asset.subtype == "gas_cylinder":
                own = contents.setdefault(self.room(row), {})
                own[arrangement.placements[row].id, asset.name] = asset
        for place in self.handled:
            own = contents.setdefault(self.room(place.location), {})
            for reagent in self.reagents_of(place):
                own[arrangement.placements[place.location].id, reagent.name] = reagent
        return {
            room: tuple((holder, asset) for (holder, _), asset in own.items()) for room, own in sorted(contents.items())
        }

    @cached_property
    def work(self) -> dict[int, tuple[int, ...]]:
        """Rows of the places of hazardous work by room: fume hoods, and where hazardous reagents are handled."""
        places = [*self.arrangement.hoods]
        places += [place.location for place in self.handled if any(map(hazardous, self.reagents_of(place)))]
        work: dict[int, dict[int, None]] = {}
        for row in places:
            work.setdefault(self.room(row), {})[row] = None
        return {room: tuple(rows) for room, rows in sorted(work.items())}

    @cached_property
    def wet(self) -> list[int]:
        """Rows of the wet fittings: sinks, eyewashes, showers and ice machines."""
        return wet_fittings(self.arrangement)

    def rows_in(self, room: int, roles: Iterable[str]) -> list[int]:
        """Return the rows of the objects of some roles in a room."""
        placed = self.arrangement.by_role
        return sorted(row for role in roles for row in placed.get(role, ()) if self.room(row) == room)

    @cached_property
    def roadmap(self) -> Roadmap:
        """Walks of people that pass no door."""
        return Roadmap(self.arrangement, self.rooms)

    def plan_gaps(self, rows: Sequence[int], boxes: Sequence[OrientedBox] | BoxArray) -> NDArray[np.float64]:
        """Return the distances in plan of objects from boxes, meters, shape (rows, boxes)."""
        others = boxes if isinstance(boxes, BoxArray) else BoxArray.of(boxes)
        return pairwise_distance(in_plan(self.arrangement.take(list(rows))), in_plan(others))


def wet_fittings(arrangement: Arrangement) -> list[int]:
    """Return the rows of the wet fittings: sinks, eyewashes, showers and ice machines."""
    return [row for row, asset in enumerate(arrangement.assets) if asset.subtype in WET]


def in_plan(boxes: BoxArray) -> BoxArray:
    """Return boxes of equal heights, whose distances are those of the footprints."""
    return BoxArray(boxes.centre, boxes.half, boxes.yaw, np.tile(PLAN_HEIGHTS_M, (len(boxes), 1)))
