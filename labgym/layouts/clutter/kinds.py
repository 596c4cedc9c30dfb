"""Kinds of loose objects, and drawers and doors that somebody left open."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np

from labgym.assets import Asset
from labgym.assets.articulation import joints
from labgym.layouts.model import Layout
from labgym.layouts.placement import FLOOR, Placement
from labgym.layouts.rules.thresholds import MOVABLE

LEVELS = range(4)
"""Levels of clutter: none, tidy, busy, crowded."""

DENSITY = (0.0, 0.4, 1.0, 2.0)
"""Objects per 10 square meters of floor outside corridors, by level (assumption)."""

Stance = Literal["front", "edge", "aisle"]


@dataclass(frozen=True)
class ClutterKind:
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
    ClutterKind("LabStool", "front", (5.0, 4.0, 4.0)),
    ClutterKind("SmallCarton", "edge", (3.0, 3.0, 3.0)),
    ClutterKind("Carton", "edge", (1.0, 3.0, 3.0)),
    ClutterKind("Carton", "front", (0.0, 2.0, 3.0)),
    ClutterKind("WasteBin", "edge", (2.0, 1.0, 1.0)),
    ClutterKind("ServiceTrolley", "front", (0.5, 2.0, 4.0)),
    ClutterKind("ServiceTrolley", "aisle", (0.0, 2.0, 4.0)),
    ClutterKind("InstrumentTrolley", "edge", (1.0, 1.0, 1.0)),
    ClutterKind("InstrumentTrolley", "aisle", (0.0, 2.0, 4.0)),
    ClutterKind("CylinderTrolley", "edge", (0.5, 1.0, 1.5), most=2),
    ClutterKind("SteelDrum", "edge", (0.0, 1.0, 1.5)),
    ClutterKind("WetFloorSign", "aisle", (0.0, 1.0, 1.0), most=1),
    ClutterKind("PalletTruck", "aisle", (0.0, 0.0, 1.0), most=1),
)
"""Loose objects; their shares are assumptions. Things are parked in wide aisles (rdmag.com on laboratory aisles)."""

OPENED = (0.0, 0.05, 0.15, 0.30)
"""Share of the floor furniture with drawers or doors that has one or two of them open, by level (assumption)."""


PULLED_OUT = (0.3, 1.0)
"""Range of the share of its travel by which a drawer is pulled out (assumption)."""
AJAR = (math.radians(30.0), math.radians(90.0))
"""Range of the angles of open doors, radians: wider ones would reach in front of the neighbor (assumption)."""


def openable(layout: Layout) -> Iterator[Placement]:
    """Yield the furniture on the floor that has drawers or doors."""
    for placement in layout.placements:
        asset = layout.asset(placement.id)
        if placement.support == FLOOR and asset.subtype not in MOVABLE:
            if any(not joint.balanced for joint in joints(asset).values()):
                yield placement


def draw_openings(asset: Asset, generator: np.random.Generator) -> Iterator[tuple[str, float]]:
    """Yield the drawers and doors of an asset in random order, and how far each is open, as a share of its range."""
    choices = [joint for joint in joints(asset).values() if not joint.balanced]
    for joint in (choices[int(pick)] for pick in generator.permutation(len(choices))):
        if joint.kind == "slide":
            share = float(generator.uniform(*PULLED_OUT))
        else:
            share = float(generator.uniform(*AJAR)) / joint.travel
        yield joint.name, round(share, 2)
