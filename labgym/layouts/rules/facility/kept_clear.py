"""Areas of the floor that stay clear: inside doors, and keep-outs."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from labgym.layouts.rules.earlier import standing
from labgym.layouts.rules.rule import Breach, FacilityRule
from labgym.layouts.rules.zones import DOOR_AREA, standing_in_each

if TYPE_CHECKING:
    from labgym.layouts.rules.site import Site


def _in_doors(site: Site) -> Iterator[Breach]:
    entrances = site.arrangement.building.entrances
    zones, spaces = [entrance.area for entrance in entrances], [entrance.space for entrance in entrances]
    standing = standing_in_each(site.arrangement, zones, spaces, loose=True)
    for entrance, zone, blockers in zip(entrances, zones, standing, strict=True):
        if blockers:
            area = f"the {zone.width:.2f} x {zone.depth:.2f} m area inside {entrance.label}"
            yield Breach(blockers, None, zone.depth, f"{', '.join(blockers)} in {area}", "move it out")


def _in_keep_outs(site: Site) -> Iterator[Breach]:
    areas = site.arrangement.layout.floor.keep_outs
    standing = standing_in_each(site.arrangement, [area.box for area in areas], [None] * len(areas), loose=True)
    for area, blockers in zip(areas, standing, strict=True):
        if blockers:
            reason = f" ({area.reason})" if area.reason else ""
            message = f"{', '.join(blockers)} in the keep-out {area.id!r}{reason}"
            yield Breach(blockers, None, 0.0, message, "move it out")


RULES = (
    FacilityRule(
        name="door_area",
        requires="Nothing stands in the area inside a door",
        limit=f"{DOOR_AREA:g} x {DOOR_AREA:g} m, or the width of the door",
        source="OSHA 29 CFR 1910.36 and .37",
        count=lambda site: len(site.arrangement.building.entrances),
        check=_in_doors,
        group="placing",
        per_object=False,
        looks_at=standing,
    ),
    FacilityRule(
        name="keep_out",
        requires="Nothing stands in the keep-outs of the floor",
        limit="each keep-out",
        source="the floor's keep-outs",
        count=lambda site: len(site.arrangement.layout.floor.keep_outs),
        check=_in_keep_outs,
        group="placing",
        per_object=False,
        looks_at=standing,
    ),
)
