"""Walks to emergency equipment: showers and eyewashes in 10 s, extinguishers within their travel distance; no door.

Nobody needs to start at a hazard to need an extinguisher or to wash hands: each extinguisher and hand-wash sink can be
reached from the doors of its room.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from labgym.layouts.rules.earlier import kinds, standing
from labgym.layouts.rules.facility.showers import SHOWER_WALK
from labgym.layouts.rules.regulations.premises import PERSON
from labgym.layouts.rules.rule import Breach, FacilityRule
from labgym.layouts.rules.safety.hazards import CLASS_B, CLASS_D, FireClass, fire_classes
from labgym.layouts.rules.safety.room_walks import ARM_REACH_M
from labgym.layouts.rules.site import Site
from labgym.layouts.rules.thresholds import Severity

CLASS_B_WALK_M = 15.2
"""Longest walk from flammables to a class B extinguisher, meters (NFPA 10, table 6.3.1.1: 50 ft)."""
CLASS_B_PREFERRED_M = 9.1
"""Preferred walk, meters (the same table: 30 ft for the smaller extinguishers)."""
CLASS_D_WALK_M = 22.9
"""Longest walk from active metals and hydrides to a class D extinguisher, meters (NFPA 10, 6.5: 75 ft)."""

REACHED = CLASS_B | CLASS_D | {"HandWashSink"}
"""Roles of what people reach from wherever they come in."""


@dataclass(frozen=True)
class Walk:
    """A limit on the walks from places of one kind to equipment of one kind."""

    name: str
    starts: Callable[[Site], list[int]]
    accepted: frozenset[str]
    limit: float
    equipment: str
    requires: str
    source: str
    severity: Severity


def _workplaces(site: Site) -> list[int]:
    return [row for rows in site.work.values() for row in rows]


def _holding(fire: FireClass) -> Callable[[Site], list[int]]:
    """Return the furniture that holds or handles what burns with a class of fire, once each."""

    def starts(site: Site) -> list[int]:
        arrangement = site.arrangement
        holders = [
            arrangement.layout.root(holder).id
            for own in site.contents.values()
            for holder, asset in own
            if fire in fire_classes(asset)
        ]
        return [arrangement.row(holder) for holder in dict.fromkeys(holders)]

    return starts


WALKS = (
    Walk(
        "shower_walk", _workplaces, frozenset({"EmergencyShower"}), SHOWER_WALK, "emergency shower",
        "From each hood and place of hazardous work, a shower is reached in 10 s without passing a door",
        "ANSI/ISEA Z358.1-2014, 4.5.2 (10 s, 55 ft)", "error",
    ),
    Walk(
        "eyewash_walk", _workplaces, frozenset({"EyewashStation"}), SHOWER_WALK, "eyewash",
        "From each hood and place of hazardous work, an eyewash is reached in 10 s without passing a door",
        "ANSI/ISEA Z358.1-2014, 5.4.2 (10 s, 55 ft)", "error",
    ),
    Walk(
        "extinguisher_b_walk", _holding("B"), CLASS_B, CLASS_B_WALK_M, "class B extinguisher",
        "From flammables, a class B extinguisher is reached without passing a door",
        "NFPA 10, table 6.3.1.1 (50 ft)", "error",
    ),
    Walk(
        "extinguisher_b_walk_preferred", _holding("B"), CLASS_B, CLASS_B_PREFERRED_M, "class B extinguisher",
        "From flammables, a class B extinguisher is near",
        "NFPA 10, table 6.3.1.1 (30 ft)", "warning",
    ),
    Walk(
        "extinguisher_d_walk", _holding("D"), CLASS_D, CLASS_D_WALK_M, "class D extinguisher",
        "From active metals, metal hydrides and pyrophorics, a class D extinguisher is reached without passing a door",
        "NFPA 10, 6.5 (75 ft)", "error",
    ),
)  # fmt: skip
"""Walks that are limited. Rooms without the equipment break the rules on rooms and are left out."""


def _finding(site: Site, walk: Walk, row: int, goals: list[int], length: float) -> Breach:
    own, *named = (site.arrangement.placements[one].id for one in (row, *goals))
    value = length if math.isfinite(length) else None
    way = "no way leads" if value is None else f"the walk is {value:.1f} m"
    message = f"{way} from {own} to any {walk.equipment}, at most {walk.limit:g} m is allowed"
    return Breach((own, *named), value, walk.limit, message, f"move {', '.join(named)} nearer, or free the way")


def _walked(site: Site, row: int) -> object:
    """Look at what stands, what calls for equipment, and the equipment; at others only at what they are."""
    placement, asset = site.arrangement.placements[row], site.arrangement.assets[row]
    called = asset.kind == "reagent" or asset.subtype in ("gas_cylinder", "shower") or asset.fume_hood
    equipment = any(asset.role in walk.accepted for walk in WALKS)
    if called or equipment or any(row == place.location for place in site.handled):
        return placement
    return standing(site, row) or kinds(site, row)


def _rule(walk: Walk) -> FacilityRule:
    def check(site: Site) -> Iterator[Breach]:
        roadmap, starts = site.roadmap, walk.starts(site)
        for room in dict.fromkeys(site.room(row) for row in starts):
            goals = site.rows_in(room, walk.accepted)
            rows = [row for row in starts if site.room(row) == room]
            for anywhere in (False, True) if goals else ():
                near = roadmap.within(rows, goals, room, walk.limit, anywhere).tolist()
                rows = [row for row, is_near in zip(rows, near, strict=True) if not is_near]
                if not rows:
                    break
            for row in rows if goals else ():
                length = roadmap.length(row, goals)
                if length > walk.limit + 1e-9:
                    yield _finding(site, walk, row, goals, length)

    return FacilityRule(
        name=walk.name,
        requires=walk.requires,
        limit=f"{walk.limit:g} m walk",
        source=walk.source,
        severity=walk.severity,
        count=lambda site: len(walk.starts(site)),
        check=check,
        ways=True,
        looks_at=_walked,
    )


def _equipment(site: Site) -> list[int]:
    return [row for row, asset in enumerate(site.arrangement.assets) if asset.role in REACHED]


def _out_of_reach(site: Site) -> Iterator[Breach]:
    for row in _equipment(site):
        if not site.roadmap.reached(row):
            own = site.arrangement.placements[row].id
            message = f"no way leads from a door of the room to within {ARM_REACH_M:g} m of {own}"
            yield Breach((own,), None, ARM_REACH_M, message, f"move {own}, or free a way {2 * PERSON:g} m wide to it")


RULES = (
    *(_rule(walk) for walk in WALKS),
    FacilityRule(
        name="equipment_reach",
        requires="A person can walk to every extinguisher and every hand-wash sink",
        limit=f"{ARM_REACH_M:g} m from a way {2 * PERSON:g} m wide",
        source="NFPA 10, 6.1.3.1; OSHA 29 CFR 1910.157(c)(1) and 1910.141(d)(2)",
        count=lambda site: len(_equipment(site)),
        check=_out_of_reach,
        ways=True,
        looks_at=_walked,
    ),
)
