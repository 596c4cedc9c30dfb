"""Emergency showers: the clear space around them, and the walk from each hood to the nearest."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

from labgym.geometry import BoxArray, OrientedBox, distance, pairwise_distance
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.earlier import standing
from labgym.layouts.rules.open_doors import with_open_doors
from labgym.layouts.rules.rule import Breach, FacilityRule
from labgym.layouts.rules.thresholds import SHOWER_RADIUS
from labgym.layouts.rules.zones import HEADROOM
from labgym.navigation import PLANNING_RADIUS, goal_pose, occupancy
from labgym.navigation.grid_search import distance_field

if TYPE_CHECKING:
    from labgym.layouts.rules.site import Site

SHOWER_WALK = 16.8
"""Walk from a hood to a safety shower: 10 s at walking pace, 55 ft (ANSI/ISEA Z358.1-2014), meters."""


def shower_walks(arrangement: Arrangement) -> dict[str, float]:
    """Return the walk from the front of each hood to the nearest safety shower, meters; inf if there is no way.

    Measured over the free floor for a disc of the planning radius on a 5 cm grid, which overstates by up to 8%. People
    open interior doors.
    """
    walks = {arrangement.placements[row].id: math.inf for row in arrangement.hoods}
    showers = arrangement.showers
    if not walks or not showers:
        return walks
    grid = occupancy(with_open_doors(arrangement.layout)).dilated(PLANNING_RADIUS)
    field = distance_field(grid, *(goal_pose(arrangement.box(shower))[:2] for shower in showers))
    for hood in walks:
        x, y, _ = goal_pose(arrangement.layout.box(hood))
        if grid.free(x, y):
            walks[hood] = float(field[grid.cell_of(x, y)])
    return walks


def _standing_and_showers(site: Site, row: int) -> object:
    asset = site.arrangement.assets[row]
    return site.arrangement.placements[row] if asset.fume_hood or asset.subtype == "shower" else standing(site, row)


def _crowded(site: Site) -> Iterator[Breach]:
    arrangement, spaces = site.arrangement, site.arrangement.spaces
    for row in arrangement.showers:
        shower = arrangement.placements[row].id
        box = arrangement.box(row)
        center = OrientedBox(box.x, box.y, 0.0, 0.0, 0.0, 0.0, HEADROOM)
        here = spaces[row]
        others = [other for other in arrangement.standing if spaces[other] == here and other != row]
        if not others:
            continue
        gaps = pairwise_distance(BoxArray.of([center]), arrangement.take(others))[0].tolist()
        nearest = dict(zip(others, gaps, strict=True))
        for other, part in arrangement.open_parts:
            if other in nearest:
                nearest[other] = min(nearest[other], distance(center, part))
        for other, gap in nearest.items():
            placement = arrangement.placements[other]
            if gap < SHOWER_RADIUS - 1e-3:
                message = f"{placement.id} is {gap:.2f} m from the center of {shower}, under {SHOWER_RADIUS} m"
                remedy = f"move it {SHOWER_RADIUS - gap:.2f} m away"
                yield Breach((shower, placement.id), gap, SHOWER_RADIUS, message, remedy)


def _far(site: Site) -> Iterator[Breach]:
    for hood, walk in shower_walks(site.arrangement).items():
        if walk > SHOWER_WALK:
            length = walk if math.isfinite(walk) else None
            way = "no way leads" if length is None else f"the walk is {walk:.1f} m"
            message = f"{way} from {hood} to an emergency shower; at most {SHOWER_WALK} m is allowed"
            yield Breach((hood,), length, SHOWER_WALK, message, "add a shower")


SHOWER_CLEAR = FacilityRule(
    name="shower_clear",
    requires="Nothing stands in the clear space around an emergency shower",
    limit=f"{SHOWER_RADIUS:g} m",
    source="ANSI/ISEA Z358.1-2014",
    count=lambda site: len(site.arrangement.showers),
    check=_crowded,
    group="placing",
    looks_at=_standing_and_showers,
)
HOOD_TO_SHOWER = FacilityRule(
    name="shower_walk",
    requires="From each hood a safety shower is near; people open interior doors",
    limit=f"{SHOWER_WALK:g} m walk",
    source="ANSI/ISEA Z358.1-2014",
    severity="warning",
    count=lambda site: len(site.arrangement.hoods),
    check=_far,
    group="placing",
    looks_at=_standing_and_showers,
)
