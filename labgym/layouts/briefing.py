"""Demands between pieces of furniture: neighborhoods by habit, and the distances that hazards require."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import combinations

from labgym.layouts.brief import Content, Nearness, Separation, Unit
from labgym.layouts.cabinets import Cabinet, conflict_between
from labgym.layouts.habits import Habits
from labgym.layouts.rules.safety.hazards import burning
from labgym.layouts.rules.separation import heat_band
from labgym.layouts.rules.thresholds import Profile

MARGIN = 0.02
"""Added to every distance between hazards, meters, so that rounding never undercuts a threshold."""


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
