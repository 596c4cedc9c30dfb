"""Drawers and doors of furniture that somebody left open."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from labgym.assets import Asset
from labgym.assets.articulation import joints
from labgym.layouts.model import Layout
from labgym.layouts.placement import FLOOR, Placement
from labgym.layouts.rules.thresholds import MOVABLE

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
