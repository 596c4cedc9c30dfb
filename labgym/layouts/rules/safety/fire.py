"""Fire: flammables and oxidizers stay off doors, exits and ovens, where they are stored and where they are used."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from labgym.geometry import pairwise_distance
from labgym.layouts.rules.building import Entrance
from labgym.layouts.rules.earlier import chemicals
from labgym.layouts.rules.rule import Breach, FacilityRule
from labgym.layouts.rules.safety.hazards import burning
from labgym.layouts.rules.site import Site

DOOR_DISTANCE_M = 1.0
"""Least distance in plan of flammables and oxidizers from a door of their room, meters (NFPA 30, 9.5.1 and OSHA
1910.106(d)(5): storage does not limit exits; the distance is that of a hood from a doorway, BS 7258-2)."""
EXIT_DISTANCE_M = 3.0
"""Preferred distance from a door that leads out, meters (NFPA 45, A.8.8: 10 ft for hoods)."""
OVEN_DISTANCE_M = 0.3
"""Least distance of an oxidizer from an oven or a furnace, meters: that of flammables (profile `default`)."""
OVEN_PREFERRED_M = 1.0
"""Preferred distance of an oxidizer from an oven or a furnace, meters (fire-code practice: 36 in, rounded up)."""
OVENS = frozenset({"oven", "flame"})
"""Heat classes of ovens, furnaces and burners."""


def _places(site: Site) -> list[tuple[int, str, tuple[int, ...]]]:
    """Return, for each place of flammables and oxidizers, its row, what it is, and the rows that are measured."""
    assets = site.arrangement.assets
    stored = [(row, "is stored", (row,)) for row in site.arrangement.reagents if burning(assets[row])]
    used = [
        (place.location, f"handles {reagents[0].name}", place.vessels)
        for place in site.handled
        if (reagents := [reagent for reagent in site.reagents_of(place) if burning(reagent)])
    ]
    return [*stored, *used]


def _doors(site: Site, exits_only: bool) -> list[Entrance]:
    return [
        entrance
        for entrance in site.arrangement.building.entrances
        if entrance.exit or not (exits_only or entrance.passage)
    ]


def _near_doors(limit: float, exits_only: bool) -> Callable[[Site], Iterator[Breach]]:
    def check(site: Site) -> Iterator[Breach]:
        places, doors = _places(site), _doors(site, exits_only)
        if not places or not doors:
            return
        rows = [row for _, _, rows in places for row in rows]
        starts = np.cumsum([0, *(len(own) for _, _, own in places[:-1])])
        gaps = np.minimum.reduceat(site.plan_gaps(rows, [door.opening for door in doors]), starts, axis=0)
        for (row, what, _), distances in zip(places, gaps, strict=True):
            for door, gap in zip(doors, distances.tolist(), strict=True):
                if gap < limit - 1e-9 and door.space == site.arrangement.spaces[row]:
                    own = site.arrangement.placements[row].id
                    message = f"{own} {what}, {gap:.2f} m from {door.label}, under {limit:g} m"
                    yield Breach((own,), gap, limit, message, f"move it {limit - gap:.2f} m away")

    return check


def _near_ovens(limit: float) -> Callable[[Site], Iterator[Breach]]:
    def check(site: Site) -> Iterator[Breach]:
        arrangement = site.arrangement
        ovens = [row for row, asset in enumerate(arrangement.assets) if asset.heat_class in OVENS]
        for row, rows, own in _oxidizers(site):
            others = [oven for oven in ovens if oven not in own]
            if not others:
                continue
            gaps = pairwise_distance(arrangement.take(list(rows)), arrangement.take(others)).min(axis=0)
            for oven, gap in zip(others, gaps.tolist(), strict=True):
                if gap < limit - 1e-9:
                    ids = arrangement.placements[row].id, arrangement.placements[oven].id
                    message = f"{ids[0]} holds an oxidizer {gap:.2f} m from {ids[1]}, under {limit:g} m"
                    yield Breach(ids, gap, limit, message, f"move one of them {limit - gap:.2f} m away")

    return check


def _oxidizers(site: Site) -> list[tuple[int, tuple[int, ...], frozenset[int]]]:
    """Return the row, the rows that are measured and the rows of its heat, for each place of oxidizers."""
    assets = site.arrangement.assets
    stored = [(row, (row,), frozenset[int]()) for row in site.arrangement.reagents if assets[row].hazards.oxidizer]
    used = [
        (place.location, place.vessels, place.own_rows)
        for place in site.handled
        if any(reagent.hazards.oxidizer for reagent in site.reagents_of(place))
    ]
    return [*stored, *used]


RULES = (
    FacilityRule(
        name="flammable_door",
        requires="Flammables and oxidizers are stored and used away from the doors of their room",
        limit=f"{DOOR_DISTANCE_M:g} m in plan",
        source="OSHA 29 CFR 1910.106(d)(5); NFPA 30, 9.5; BS 7258-2",
        count=lambda site: len(_places(site)),
        check=_near_doors(DOOR_DISTANCE_M, exits_only=False),
        looks_at=chemicals,
    ),
    FacilityRule(
        name="flammable_exit",
        requires="Flammables and oxidizers are stored and used away from doors that lead out",
        limit=f"{EXIT_DISTANCE_M:g} m in plan",
        source="NFPA 45 (10 ft, as for hoods)",
        severity="warning",
        count=lambda site: len(_places(site)),
        check=_near_doors(EXIT_DISTANCE_M, exits_only=True),
        looks_at=chemicals,
    ),
    FacilityRule(
        name="oxidizer_heat",
        requires="Oxidizers are stored and used away from ovens, furnaces and burners",
        limit=f"{OVEN_DISTANCE_M:g} m",
        source="fire-code practice; NFPA 400, 15.3",
        count=lambda site: len(_oxidizers(site)),
        check=_near_ovens(OVEN_DISTANCE_M),
        looks_at=chemicals,
    ),
    FacilityRule(
        name="oxidizer_heat_preferred",
        requires="Oxidizers are stored and used well away from ovens, furnaces and burners",
        limit=f"{OVEN_PREFERRED_M:g} m",
        source="fire-code practice: 36 in from heating appliances",
        severity="warning",
        count=lambda site: len(_oxidizers(site)),
        check=_near_ovens(OVEN_PREFERRED_M),
        looks_at=chemicals,
    ),
)
