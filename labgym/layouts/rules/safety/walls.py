"""Wall items cover no door, window or passage; emergency equipment has a free front."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from labgym.geometry import BoxArray, OrientedBox, pairwise_penetration
from labgym.layouts.placement import WALL
from labgym.layouts.rules.earlier import standing
from labgym.layouts.rules.rule import Breach, FacilityRule
from labgym.layouts.rules.safety.hazards import CLASS_B, CLASS_D
from labgym.layouts.rules.site import Site
from labgym.layouts.rules.thresholds import LOOSE, MOVABLE, WALL_TOLERANCE
from labgym.layouts.rules.zones import front_zone, standing_in_each

OPENING_DEPTH_M = 0.5
"""Depth before the faces of a wall in which an item covers its openings, meters."""
EMERGENCY = frozenset({"fire", "eyewash", "shower", "first_aid", "spill"})
"""Subtypes of equipment that people take or use at once."""
EXTINGUISHER_FRONT_M = 0.6
"""Depth in front of an extinguisher without furniture up to its top, meters: the catalog's clearance."""


def _hanging(site: Site) -> list[int]:
    return [row for row, placement in enumerate(site.arrangement.placements) if placement.support == WALL]


def opening_boxes(site: Site) -> list[tuple[str, OrientedBox]]:
    """Return the openings of all walls: the name of each, and its box as deep as what covers it may stand off."""
    return [
        (
            f"the {opening.kind} at {wall.point(opening.position)[0]:.2f}, {wall.point(opening.position)[1]:.2f}",
            OrientedBox(
                *wall.point(opening.position),
                opening.width,
                wall.thickness + 2.0 * OPENING_DEPTH_M,
                wall.yaw,
                opening.sill,
                opening.top,
            ),
        )
        for wall in site.arrangement.layout.floor.walls
        for opening in wall.openings
    ]


def _covering(site: Site) -> Iterator[Breach]:
    arrangement, items, openings = site.arrangement, _hanging(site), opening_boxes(site)
    if not items or not openings:
        return
    depths = pairwise_penetration(arrangement.take(items), BoxArray.of([box for _, box in openings]))
    for i, j in np.argwhere(depths > WALL_TOLERANCE + 1e-9).tolist():
        own, depth = arrangement.placements[items[i]].id, float(depths[i, j])
        message = f"{own} reaches {depth:.2f} m over {openings[j][0]}, over {WALL_TOLERANCE:g} m"
        yield Breach((own,), depth, WALL_TOLERANCE, message, f"hang it on plain wall, {depth:.2f} m or more aside")


def _extinguishers(site: Site) -> list[int]:
    return [row for row, asset in enumerate(site.arrangement.assets) if asset.role in CLASS_B | CLASS_D]


def _standing_and_extinguishers(site: Site, row: int) -> object:
    is_extinguisher = site.arrangement.assets[row].role in CLASS_B | CLASS_D
    return site.arrangement.placements[row] if is_extinguisher else standing(site, row)


def _obstructed(site: Site) -> Iterator[Breach]:
    arrangement = site.arrangement
    rows = _extinguishers(site)
    boxes = [arrangement.box(row) for row in rows]
    zones = [replace(front_zone(box, EXTINGUISHER_FRONT_M), z1=box.z1) for box in boxes]
    standing = standing_in_each(arrangement, zones, [arrangement.spaces[row] for row in rows])
    for row, found in zip(rows, standing, strict=True):
        own = arrangement.placements[row].id
        others = (one for one in found if one != own)
        blockers = [one for one in others if arrangement.assets[arrangement.row(one)].subtype not in MOVABLE]
        if blockers:
            names = ", ".join(blockers)
            message = f"{names} in the {EXTINGUISHER_FRONT_M:g} m in front of {own}"
            yield Breach((own, *blockers), None, EXTINGUISHER_FRONT_M, message, f"move {own} or {names}")


def _emergency(site: Site) -> list[int]:
    assets = enumerate(site.arrangement.assets)
    return [row for row, asset in assets if asset.subtype in EMERGENCY and asset.clearance > 0.0]


def _strewn(site: Site) -> Iterator[Breach]:
    arrangement, rows = site.arrangement, _emergency(site)
    zones = [front_zone(arrangement.box(row), arrangement.assets[row].clearance) for row in rows]
    standing = standing_in_each(arrangement, zones, [arrangement.spaces[row] for row in rows], loose=True)
    for row, zone, found in zip(rows, zones, standing, strict=True):
        own = arrangement.placements[row].id
        loose = [one for one in found if arrangement.assets[arrangement.row(one)].subtype in LOOSE]
        if loose:
            message = f"{', '.join(loose)} in the {zone.depth:g} m in front of {own}"
            yield Breach((*loose, own), None, zone.depth, message, f"move {', '.join(loose)} away")


RULES = (
    FacilityRule(
        name="wall_opening",
        requires="What hangs on a wall covers no door, passage, window or glazing",
        limit=f"{WALL_TOLERANCE:g} m over the edge",
        source="OSHA 29 CFR 1910.37(a)(3); NFPA 101, 7.1.10",
        count=lambda site: len(_hanging(site)),
        check=_covering,
        looks_at=standing,
    ),
    FacilityRule(
        name="extinguisher_front",
        requires="Nothing stands in front of an extinguisher",
        limit=f"{EXTINGUISHER_FRONT_M:g} m",
        source="NFPA 10, 6.1.3.3; OSHA 29 CFR 1910.157(c)(1)",
        count=lambda site: len(_extinguishers(site)),
        check=_obstructed,
        looks_at=_standing_and_extinguishers,
    ),
    FacilityRule(
        name="emergency_front",
        requires="No carton, stool, trolley or drum stands in front of emergency equipment",
        limit="catalog clearance",
        source="ANSI/ISEA Z358.1-2014, 4.5.2 and 5.4.2; NFPA 10, 6.1.3.3; OSHA 29 CFR 1910.157(c)(1)",
        count=lambda site: len(_emergency(site)),
        check=_strewn,
        looks_at=standing,
    ),
)
