"""Kinds of loose objects: how many of them a level of clutter has, and where they stand."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

LEVELS = range(4)
"""Levels of clutter: none, tidy, busy, crowded."""

DENSITY = (0.0, 0.4, 1.0, 2.0)
"""Objects per 10 square meters of floor outside corridors, by level (assumption)."""

Stance = Literal["front", "edge", "aisle"]


@dataclass(frozen=True)
class Kind:
    """A kind of loose object.

    Attributes:
        asset: name in the catalog.
        stance: where it stands: in front of furniture; along walls, rows and islands; or in an aisle.
        weights: how often it is drawn, relative to the other kinds, at the levels 1 to 3.
        most: largest number in one layout, None for no limit.
    """

    asset: str
    stance: Stance
    weights: tuple[float, float, float]
    most: int | None = None


KINDS = (
    Kind("LabStool", "front", (5.0, 4.0, 4.0)),
    Kind("SmallCarton", "edge", (3.0, 3.0, 3.0)),
    Kind("Carton", "edge", (1.0, 3.0, 3.0)),
    Kind("Carton", "front", (0.0, 2.0, 3.0)),
    Kind("WasteBin", "edge", (2.0, 1.0, 1.0)),
    Kind("ServiceTrolley", "front", (0.5, 2.0, 4.0)),
    Kind("ServiceTrolley", "aisle", (0.0, 2.0, 4.0)),
    Kind("InstrumentTrolley", "edge", (1.0, 1.0, 1.0)),
    Kind("InstrumentTrolley", "aisle", (0.0, 2.0, 4.0)),
    Kind("CylinderTrolley", "edge", (0.5, 1.0, 1.5), most=2),
    Kind("SteelDrum", "edge", (0.0, 1.0, 1.5)),
    Kind("WetFloorSign", "aisle", (0.0, 1.0, 1.0), most=1),
    Kind("PalletTruck", "aisle", (0.0, 0.0, 1.0), most=1),
)
"""Loose objects; their shares are assumptions. Things are parked in wide aisles (rdmag.com on laboratory aisles)."""

OPENED = (0.0, 0.05, 0.15, 0.30)
"""Share of the floor furniture with drawers or doors that has one or two of them open, by level (assumption)."""
