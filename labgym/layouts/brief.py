"""The furnished brief: the furniture a room gets, what each piece holds, why, and what must hold between pieces.

`briefing.write_brief` makes it once; wall choice, floor plan and assembly read it and ask nothing else.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from labgym.assets import Asset
from labgym.layouts.placement import Placement
from labgym.layouts.rules.zones import DOOR_AREA
from labgym.layouts.tabletop import Spot

Wall = Literal["front", "back", "left", "right"]
Stance = Literal["wall", "island", "peninsula"]
Furnishing = Literal["full", "reduced", "required"]
Hazard = Literal["reactive", "dry", "burning", "metal", "work"]
"""Reacts with water or ignites in air; the same, and is stored; flammable or oxidizing; burns so that it needs a class
D extinguisher; hazardous work (fume hoods, and places at which hazardous reagents are handled)."""
LEVELS: tuple[Furnishing, ...] = ("full", "reduced", "required")
"""Levels of furnishing, fullest first: `required` is only what the protocol and safety require."""


@dataclass(frozen=True)
class Unit:
    """A piece of floor furniture that the floor plan places.

    Attributes:
        id: id of the future placement. asset: catalog entry.
        width, depth: footprint in meters; the front lies along the depth.
        front: free depth required in front, meters.
        stance: back against a wall, free on all sides (island), or one short end against a wall (peninsula).
        walls: walls that it may stand against, preferred ones first.
        clear: distance that other furniture keeps on all sides, meters; 0 for the ordinary gap between neighbors.
        anchors: preferred position along each wall, 0 to 1 from the wall's start; for an island its y ("island") and,
            if it is not to stand in the middle, its x ("island_x").
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
    walls: tuple[Wall, ...] = ("back", "left", "right", "front")
    anchors: Mapping[str, float] = field(default_factory=dict)
    clear: float = 0.0
    reason: str = ""
    supplies: tuple[str, ...] = ()
    hazards: frozenset[Hazard] = frozenset()


@dataclass(frozen=True)
class Content:
    """An object in or on a unit: catalog entry, slot of the unit, spot relative to that slot's center, and why."""

    asset: Asset
    slot: int
    spot: Spot
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
class Brief:
    """Everything that the floor plan and the assembly need to know.

    Attributes:
        contents: what each unit holds, by unit id, in the order in which the units were filled.
        fixed: placements that must stay, by id: units that the plan does not move, and objects on walls.
        wall_assets: catalog entries of the fixed objects on walls, by id.
        hoods: ids of the units that are fume hoods.
        aisle: clear width around islands, meters.
        door_zone: clear depth inside each door, meters. hood_door: least distance of a hood from a door, meters.
    """

    units: tuple[Unit, ...]
    separations: tuple[Separation, ...] = ()
    nearness: tuple[Nearness, ...] = ()
    contents: Mapping[str, tuple[Content, ...]] = field(default_factory=dict)
    fixed: Mapping[str, Placement] = field(default_factory=dict)
    wall_assets: Mapping[str, Asset] = field(default_factory=dict)
    hoods: tuple[str, ...] = ()
    aisle: float = 1.2
    door_zone: float = DOOR_AREA
    hood_door: float = 1.0
    furnishing: Furnishing = "full"
