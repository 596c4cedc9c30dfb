"""Writes the furnished brief of a room: cabinets, furniture, contents, and the distances that hazards require."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from labgym.layouts.brief import Brief, Content, Furnishing, Nearness, Separation, Unit
from labgym.layouts.cabinets import Cabinet, conflict_between, plan_cabinets
from labgym.layouts.furnishing import AISLE, HEAVY_AISLE, draw_sides, furniture
from labgym.layouts.habits import Habits
from labgym.layouts.placement import WALL
from labgym.layouts.request import Request
from labgym.layouts.rules.safety.hazards import burning
from labgym.layouts.rules.separation import heat_band
from labgym.layouts.rules.thresholds import Profile
from labgym.layouts.stocking import stock

MARGIN = 0.02
"""Added to every distance between hazards, meters, so that rounding never undercuts a threshold."""
TIGHT_FRONT = 1.2
"""Free depth in front of a hood in a room that is not fully furnished, meters; 1.5 otherwise."""


def write_brief(request: Request, furnishing: Furnishing, generator: np.random.Generator) -> Brief:
    """Return the furnished brief of a room.

    Raises:
        InfeasibleError: something that the protocol requires fits on no surface or shelf.
    """
    sides = draw_sides(generator)
    cabinets = plan_cabinets(request)
    units = furniture(request, cabinets, sides, furnishing, generator)
    contents = stock(request, cabinets, units, generator)
    full = furnishing == "full"
    return Brief(
        units=units if full else tuple(replace(unit, front=min(unit.front, TIGHT_FRONT)) for unit in units),
        separations=tuple(separations_of(cabinets, contents, request.profile)),
        nearness=tuple(nearness_of(units, request.habits)),
        contents=contents,
        fixed={placement.id: placement for placement in request.fixed},
        wall_assets={
            placement.id: request.fixed_asset(placement) for placement in request.fixed if placement.support == WALL
        },
        hoods=tuple(unit.id for unit in units if unit.asset.fume_hood),
        aisle=HEAVY_AISLE if full else AISLE,
        furnishing=furnishing,
    )


def nearness_of(units: Sequence[Unit], habits: Habits) -> Iterable[Nearness]:
    """Yield the habits of neighborhood that concern some units; the first unit of each kind counts."""
    first: dict[str, str] = {}
    for unit in units:
        first.setdefault(unit.asset.role, unit.id)
    for pair in habits.near:
        if pair.first in first and pair.second in first:
            yield Nearness(first[pair.first], first[pair.second], pair.weight)


def separations_of(
    cabinets: Sequence[Cabinet], contents: Mapping[str, tuple[Content, ...]], profile: Profile
) -> Iterable[Separation]:
    """Yield the distances of flammables and oxidizers from heat sources, and of incompatible cabinets."""
    for unit_id, items in contents.items():
        bands = [band for item in items if (band := heat_band(item.asset, profile)) is not None]
        for cabinet in cabinets:
            held = sorted(filter(burning, cabinet.reagents), key=lambda asset: not asset.hazards.flammable)
            if bands and held:
                distance = max(band.d_min for band in bands) + MARGIN
                what = "is flammable" if held[0].hazards.flammable else "feeds fires"
                yield Separation(cabinet.id, unit_id, distance, f"{held[0].name} {what}")
    for first, second in combinations(cabinets, 2):
        conflict = conflict_between(first, second, profile)
        if conflict is not None:
            yield Separation(first.id, second.id, profile.incompatible.d_min + MARGIN, conflict)
