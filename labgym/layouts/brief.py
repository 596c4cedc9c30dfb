"""The furnished brief: the furniture a floor gets, what each piece holds, and why; demands between pieces.

The proposer makes it once; the assembly reads it and asks nothing else.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

from labgym.assets import Asset
from labgym.geometry import OrientedBox
from labgym.layouts.placement import Placement
from labgym.layouts.tabletop import SurfaceSpot

Stance = Literal["wall", "island", "peninsula"]
Furnishing = Literal["full", "reduced", "required"]
Hazard = Literal["reactive", "dry", "burning", "metal", "work"]
"""Reacts with water or ignites in air; the same, and is stored; flammable or oxidizing; burns so that it needs a class
D extinguisher; hazardous work (fume hoods, and places at which hazardous reagents are handled)."""
LEVELS: tuple[Furnishing, ...] = ("full", "reduced", "required")
"""Levels of furnishing, fullest first: `required` is only what the protocol and safety require."""


@dataclass(frozen=True)
class Unit:
    """A piece of furniture that stands on the floor.

    Attributes:
        id: id of the future placement. asset: catalog entry.
        width, depth: footprint in meters; the front lies along the depth.
        front: free depth required in front, meters.
        stance: back against a wall, free on all sides (island), or one short end against a wall (peninsula).
        clear: distance that other furniture keeps on all sides, meters; 0 for the ordinary gap between neighbors.
        reason: why the room has it.
        supplies: kinds of service that it needs: water, gas, exhaust.
        hazards: of the reagents that it stores, and of those that protocols handle at it.
    """

    id: str
    asset: Asset
    width: float
    depth: float
    front: float
    stance: Stance = "wall"
    clear: float = 0.0
    reason: str = ""
    supplies: tuple[str, ...] = ()
    hazards: frozenset[Hazard] = frozenset()


@dataclass(frozen=True)
class Content:
    """An object in or on a unit: catalog entry, slot of the unit, spot relative to that slot's center, and why."""

    asset: Asset
    slot: int
    spot: SurfaceSpot
    reason: str


@dataclass(frozen=True)
class Separation:
    """A distance in meters that two units' footprints keep, and why."""

    first: str
    second: str
    distance: float
    reason: str


@dataclass(frozen=True)
class Nearness:
    """A preference for two units to be close, with an integer weight."""

    first: str
    second: str
    weight: int = 1


@dataclass(frozen=True)
class Proximity:
    """A greatest distance in meters between the goal poses of two units, and why."""

    first: str
    second: str
    distance: float
    reason: str


@dataclass(frozen=True)
class Demands:
    """Conditions between units.

    Attributes:
        separations, nearness, proximities: between units of the space.
        apart: boxes of other spaces and the distance to keep from each, by unit id.
    """

    separations: Sequence[Separation] = ()
    nearness: Sequence[Nearness] = ()
    proximities: Sequence[Proximity] = ()
    apart: Mapping[str, Iterable[tuple[OrientedBox, float]]] = field(default_factory=dict)


@dataclass(frozen=True)
class Brief:
    """Everything that the assembly needs to know.

    Attributes:
        contents: what each unit holds, by unit id, in the order in which the units were filled.
        fixed: placements that must stay, by id: units that the plan does not move, and objects on walls.
        wall_assets: catalog entries of the fixed objects on walls, by id.
    """

    units: tuple[Unit, ...]
    contents: Mapping[str, tuple[Content, ...]] = field(default_factory=dict)
    fixed: Mapping[str, Placement] = field(default_factory=dict)
    wall_assets: Mapping[str, Asset] = field(default_factory=dict)
    furnishing: Furnishing = "full"
