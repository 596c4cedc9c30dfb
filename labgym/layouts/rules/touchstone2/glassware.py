"""Glass, version 2: glassware on the floor scores 0, where version 1 left it out."""

from __future__ import annotations

from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.glass import glass_instances
from labgym.layouts.rules.satisfaction import Instance
from labgym.layouts.rules.thresholds import Profile
from labgym.layouts.rules.touchstone2.supports import fallen


def all_glass_instances(arrangement: Arrangement, profile: Profile) -> tuple[Instance, ...]:
    """Return version 1's instances, and one that scores 0 for each glass instrument on the floor.

    Glass on an object that lies on the floor, such as a beaker on a fallen hotplate, is on the floor too.
    """
    low = {
        arrangement.placements[row].id
        for row, asset in enumerate(arrangement.assets)
        if asset.kind == "instrument" and asset.hazards.glass_container and fallen(arrangement, row)
    }
    standing = tuple(one for one in glass_instances(arrangement, profile) if one.ids[0] not in low)
    on_floor = (
        Instance("glass", (placement.id,), 0.0, 0.0, 0.0, False, "glass on the floor")
        for placement in arrangement.placements
        if placement.id in low
    )
    return (*standing, *on_floor)
