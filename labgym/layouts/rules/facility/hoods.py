"""Fume hoods: away from doorways and not opposite desks."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from labgym.geometry import BoxArray, distance, pairwise_distance, penetration
from labgym.layouts.floor.fields import HOOD_DOOR_LEAST
from labgym.layouts.rules.rule import Breach, FacilityRule
from labgym.layouts.rules.thresholds import ROOM_TOLERANCE
from labgym.layouts.rules.zones import front_zone

if TYPE_CHECKING:
    from labgym.layouts.rules.site import Site

HOOD_DOOR = 3.0
"""Distance between a hood and a doorway, meters (NFPA 45 and ANSI/AIHA Z9.5: 10 ft, as university guides cite them)."""

HOOD_OPPOSITE = 3.0
"""No desk within this distance in front of a hood, meters (NFPA 45: not opposite desks)."""


def _hoods_and_desks(site: Site, row: int) -> object:
    asset = site.arrangement.assets[row]
    return site.arrangement.placements[row] if asset.fume_hood or asset.subtype == "desk" else None


def _near_doors(site: Site) -> Iterator[Breach]:
    arrangement = site.arrangement
    entrances = arrangement.building.entrances
    openings = BoxArray.of([entrance.opening for entrance in entrances])
    gaps = pairwise_distance(arrangement.take(arrangement.hoods), openings).tolist() if entrances else ()
    for row, own in zip(arrangement.hoods if entrances else (), gaps, strict=True):
        hood = arrangement.placements[row].id
        for entrance, gap in zip(entrances, own, strict=True):
            if entrance.space == arrangement.spaces[row] and gap < HOOD_DOOR:
                limit = HOOD_DOOR_LEAST if gap < HOOD_DOOR_LEAST else HOOD_DOOR
                message = f"{hood} is {gap:.2f} m from {entrance.label}, under {limit:g} m"
                yield Breach((hood,), gap, limit, message, "move it away")


def _opposite_desks(site: Site) -> Iterator[Breach]:
    arrangement = site.arrangement
    desks = [row for row, asset in enumerate(arrangement.assets) if asset.subtype == "desk"]
    for row in arrangement.hoods:
        box, hood = arrangement.box(row), arrangement.placements[row].id
        zone = front_zone(box, HOOD_OPPOSITE)
        for desk in desks:
            together = arrangement.spaces[desk] == arrangement.spaces[row]
            if together and penetration(zone, arrangement.box(desk)) > ROOM_TOLERANCE:
                ids, gap = (hood, arrangement.placements[desk].id), distance(box, arrangement.box(desk))
                message = f"{ids[1]} stands opposite {hood} at {gap:.2f} m, under {HOOD_OPPOSITE:g} m"
                yield Breach(ids, gap, HOOD_OPPOSITE, message, "move it aside")


RULES = (
    FacilityRule(
        name="hood_door",
        requires="Fume hoods stand away from the doorways of their room",
        limit=f"{HOOD_DOOR:g} m",
        source="NFPA 45; ANSI/AIHA Z9.5",
        severity="warning",
        count=lambda site: len(site.arrangement.hoods),
        check=_near_doors,
        group="placing",
        looks_at=_hoods_and_desks,
    ),
    FacilityRule(
        name="hood_opposite_desk",
        requires="No desk stands opposite a fume hood",
        limit=f"{HOOD_OPPOSITE:g} m",
        source="NFPA 45",
        severity="warning",
        count=lambda site: len(site.arrangement.hoods),
        check=_opposite_desks,
        group="placing",
        looks_at=_hoods_and_desks,
    ),
)
