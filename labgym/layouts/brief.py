"""The brief of a room: the furniture that a protocol calls for and what must hold between the pieces."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

Wall = Literal["front", "back", "left", "right"]
Stance = Literal["wall", "island", "peninsula"]


@dataclass(frozen=True)
class Unit:
    """A piece of floor furniture that the floor plan places.

    Attributes:
        id: id of the placement to be. asset: catalogue name.
        width, depth: footprint in metres, front along the depth. front: free depth wanted before it, metres.
        stance: back against a wall, free on all sides (island), or one short end against a wall (peninsula).
        walls: walls that it may stand against, the liked ones first.
        anchors: liked place along each wall, 0 to 1 from the wall's start; an island's is its y. Absent: anywhere.
    """

    id: str
    asset: str
    width: float
    depth: float
    front: float
    stance: Stance = "wall"
    walls: tuple[Wall, ...] = ("back", "left", "right", "front")
    anchors: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Separation:
    """Two units whose footprints stay a distance in metres apart, and why."""

    first: str
    second: str
    distance: float
    reason: str


@dataclass(frozen=True)
class Nearness:
    """Two units that like to be close, with an integer weight."""

    first: str
    second: str
    weight: int = 1


@dataclass(frozen=True)
class Brief:
    """Everything that the floor plan must place, and what must hold.

    Attributes:
        hoods: ids of the units that are fume hoods.
        aisle: clear width around islands, metres.
        door_zone: clear depth inside each door, metres. hood_door: least distance of a hood from a door, metres.
    """

    units: tuple[Unit, ...]
    separations: tuple[Separation, ...] = ()
    nearness: tuple[Nearness, ...] = ()
    hoods: tuple[str, ...] = ()
    aisle: float = 1.2
    door_zone: float = 1.2
    hood_door: float = 1.0
    furnishing: str = "full"
