"""Services: furniture stands within reach of the water, gas and exhaust that it needs."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

from labgym.layouts.placement import FLOOR
from labgym.layouts.rules.earlier import standing
from labgym.layouts.rules.rule import Breach, FacilityRule
from labgym.layouts.rules.supplies import BURNERS, REACH, SOURCES, Supplies, supplies_of, unsupplied
from labgym.layouts.rules.thresholds import Severity

if TYPE_CHECKING:
    from labgym.layouts.rules.site import Site


def _supplied_and_burners(site: Site, row: int) -> object:
    placement = site.arrangement.placements[row]
    return placement if placement.asset in BURNERS else standing(site, row)


def _out_of_reach(site: Site) -> Iterator[Breach]:
    """Yield the pieces beyond the reach of a service; floors without points of a kind are not judged for it."""
    for piece in unsupplied(site.arrangement):
        source, severity = SOURCES[piece.kind], _severity(piece.required)
        if math.isinf(piece.beyond):
            message = f"{piece.id} needs {piece.kind}, but {piece.space!r} has no such point"
            yield Breach((piece.id,), None, 0.0, message, "add one", source, severity)
        else:
            message = f"{piece.id} is {piece.beyond:.2f} m beyond the reach of {piece.kind}"
            yield Breach((piece.id,), piece.beyond, 0.0, message, "move it, or add a point near it", source, severity)


def _severity(required: bool) -> Severity:
    return "error" if required else "warning"


def _supplied(site: Site) -> int:
    """Number of pieces that need a service of which the floor has points."""
    arrangement, floor = site.arrangement, site.arrangement.layout.floor
    if not floor.services:
        return 0
    described = Supplies.of(floor, floor.spaces[0]).described
    return sum(
        placement.support == FLOOR and not described.isdisjoint(supplies_of(asset))
        for placement, asset in zip(arrangement.placements, arrangement.assets, strict=True)
    )


SUPPLY = FacilityRule(
    name="supply",
    requires="Furniture stands within reach of the water, gas and exhaust that it needs",
    limit=", ".join(f"{kind} {reach:g} m" for kind, reach in REACH.items()),
    source="IPC 704.1; IFGC 411.1.3.1",
    count=_supplied,
    check=_out_of_reach,
    group="placing",
    looks_at=_supplied_and_burners,
)
RULES = (SUPPLY,)
