"""Out of bounds by the kind of support: an instrument on the floor, furniture on a bench, a clock on a table."""

from __future__ import annotations

from labgym.assets import Asset
from labgym.layouts.placement import FLOOR, WALL
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.bounds import BoundsFault

FREE_STANDING = 1.2
"""Desktop assets of this height and more, such as gas cylinders, also stand on the floor, meters: on a bench of 0.9 m
they would end above the 1.9 to 2.1 m that a standing person reaches."""


PORTABLE = frozenset({"container", "spill", "fire", "carton"})
"""Subtypes of floor assets that also stand on furniture: containers on a waste station, a spill kit on a shelf."""


def support_faults(arrangement: Arrangement) -> tuple[BoundsFault, ...]:
    """Return a fault for each object that stands on the wrong kind of support.

    Desktop assets stand on other objects, floor assets on the floor (portable ones also on furniture), and wall assets
    hang on a wall.
    """
    return tuple(
        BoundsFault(placement.id, "support", 0.0)
        for placement, asset in zip(arrangement.placements, arrangement.assets, strict=True)
        if not _carried(arrangement, placement.support, asset)
    )


def fallen(arrangement: Arrangement, row: int) -> bool:
    """Return whether an object, or what finally carries it, is a desktop asset on the floor or on a wall."""
    root = arrangement.layout.root(arrangement.placements[row].id)
    asset = arrangement.layout.asset(root.id)
    return asset.placing == "desktop" and not _carried(arrangement, root.support, asset)


def _carried(arrangement: Arrangement, support: str, asset: Asset) -> bool:
    if asset.placing == "floor":
        return support == FLOOR or (support != WALL and asset.subtype in PORTABLE)
    if asset.placing == "wall":
        return support == WALL
    if support == FLOOR:
        return asset.size.height >= FREE_STANDING
    return support != WALL and arrangement.layout.asset(support).subtype != "seat"
