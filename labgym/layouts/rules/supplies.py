"""Supplies: which furniture needs water, gas or exhaust, and how far from a service point it may stand."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from labgym.assets import Asset
from labgym.geometry import OrientedBox, to_local
from labgym.layouts.floor import Floor, Service, Space
from labgym.layouts.placement import FLOOR
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.thresholds import EXHAUST_REACH, GAS_REACH, WATER_REACH

REACH: dict[str, float] = {"water": WATER_REACH, "gas": GAS_REACH, "exhaust": EXHAUST_REACH}
"""Distances by kind of service, meters."""
SOURCES = {
    "water": "IPC 704.1 and table 909.1",
    "gas": "IFGC 411.1.3.1",
    "exhaust": "assumption: one offset of the duct below the ceiling",
}
WET = frozenset({"sink", "eyewash", "shower", "ice"})
"""Subtypes of assets that need water and a drain."""
GAS = frozenset({"gas_cylinder", "gas_cabinet"})
"""Subtypes of assets that are connected to a gas point."""
BURNERS = frozenset({"BunsenBurner"})
"""Assets that burn gas from the tap: what carries one needs a gas point."""


@dataclass(frozen=True)
class Supplies:
    """The service points that serve a space.

    Attributes:
        points: in the space or in its walls; positions in the frame that the caller chose.
        described: kinds of which the floor has a point anywhere; furniture stands near them if it can.
        required: kinds that furniture must have within reach.
    """

    points: tuple[Service, ...] = ()
    described: frozenset[str] = frozenset()
    required: frozenset[str] = frozenset()

    @classmethod
    def of(cls, floor: Floor, space: Space) -> Supplies:
        """Return the service points of a space, in the floor's frame."""
        return cls(
            tuple(service for service in floor.services_of(space.id) if service.kind in REACH),
            frozenset(service.kind for service in floor.services if service.kind in REACH),
            frozenset(service.kind for service in floor.services if service.kind in REACH and service.required),
        )

    def moved(self, frame: tuple[float, float, float]) -> Supplies:
        """Return the same points in a frame (x, y, yaw) of the frame that they are in."""
        local = to_local([(point.x, point.y) for point in self.points], frame).tolist() if self.points else []
        points = (p.model_copy(update={"x": x, "y": y}) for p, (x, y) in zip(self.points, local, strict=True))
        return Supplies(tuple(points), self.described, self.required)

    def of_kind(self, kind: str) -> list[Service]:
        """Return the points of a kind."""
        return [point for point in self.points if point.kind == kind]


def supplies_of(asset: Asset, contents: Iterable[Asset] = ()) -> tuple[str, ...]:
    """Return the kinds of service that a piece of furniture needs: water, gas, exhaust.

    Args:
        contents: what stands on it.
    """
    kinds = []
    if asset.subtype in WET:
        kinds.append("water")
    if asset.subtype in GAS or any(content.name in BURNERS for content in contents):
        kinds.append("gas")
    if asset.fume_hood:
        kinds.append("exhaust")
    return tuple(kinds)


def reach_of(point: Service) -> float:
    """Return how far from a service point furniture may stand, meters in the plan."""
    return REACH[point.kind] if point.reach is None else point.reach


def shortfall(box: OrientedBox, points: Sequence[Service]) -> float:
    """Return how far a footprint is beyond the reach of the nearest of some points, meters; 0 within, inf without."""
    beyond = math.inf
    for point in points:
        x, y = box.to_local(point.x, point.y)
        gap = math.hypot(max(abs(x) - box.width / 2.0, 0.0), max(abs(y) - box.depth / 2.0, 0.0))
        beyond = min(beyond, max(gap - reach_of(point), 0.0))
        if beyond == 0.0:
            break
    return beyond


@dataclass(frozen=True)
class Unsupplied:
    """A piece of furniture beyond the reach of a service that it needs.

    Attributes:
        beyond: how much nearer it must be, meters; inf if its space has no such point.
        space: id of its space.
    """

    id: str
    kind: str
    beyond: float
    space: str
    required: bool


def unsupplied(arrangement: Arrangement) -> list[Unsupplied]:
    """Return the furniture of a layout that is beyond the reach of a service of which the floor has points."""
    layout = arrangement.layout
    if not layout.floor.services:
        return []
    supplies = [Supplies.of(layout.floor, space) for space in layout.floor.spaces]
    burning = {
        placement.support: layout.asset(placement.id) for placement in layout.placements if placement.asset in BURNERS
    }
    found = []
    for row in arrangement.standing:
        placement = arrangement.placements[row]
        burner = burning.get(placement.id)
        kinds = supplies_of(arrangement.assets[row], () if burner is None else (burner,))
        if placement.support != FLOOR or not kinds:
            continue
        index = arrangement.spaces[row]
        near = supplies[index]
        for kind in kinds:
            beyond = shortfall(layout.box(placement.id), near.of_kind(kind)) if kind in near.described else 0.0
            if beyond > 1e-6:
                space = layout.floor.spaces[index].id
                found.append(Unsupplied(placement.id, kind, beyond, space, kind in near.required))
    return found
