"""Flam and Incomp: distances of reagents from heat sources and from each other, surface to surface."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from itertools import combinations

from labgym.assets import Asset, Hazard, incompatible
from labgym.geometry import pairwise_distance
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.earlier import chemicals
from labgym.layouts.rules.rule import Instance, Term, worst_mean
from labgym.layouts.rules.storage import closed_cabinet
from labgym.layouts.rules.thresholds import Band, Profile

HEAT_CLASSES = frozenset({"flame", "hot_surface", "bath", "oven"})
"""Heat sources that count; an `instrument` merely runs warm."""


def heat_band(asset: Asset, profile: Profile) -> Band | None:
    """Return the distances that a flammable reagent keeps from an asset, or None if it is not a heat source."""
    if asset.heat_class not in HEAT_CLASSES:
        return None
    return profile.flame if asset.heat_class == "flame" else profile.heat


def flammable_instances(arrangement: Arrangement, profile: Profile) -> tuple[Instance, ...]:
    """Return one instance for each pair of a placed flammable reagent and a placed heat source.

    A cabinet does not shield: a stored reagent keeps its distance like any other.
    """
    bands = [(row, heat_band(asset, profile)) for row, asset in enumerate(arrangement.assets)]
    sources = [(row, band) for row, band in bands if band is not None]
    reagents = [row for row in arrangement.reagents if arrangement.assets[row].hazards.flammable]
    if not sources or not reagents:
        return ()
    gaps = pairwise_distance(arrangement.take(reagents), arrangement.take([row for row, _ in sources]))
    instances = []
    for i, reagent in enumerate(reagents):
        for j, (source, band) in enumerate(sources):
            ids = arrangement.placements[reagent].id, arrangement.placements[source].id
            gap = float(gaps[i, j])
            note = f"flammable near a heat source ({arrangement.assets[source].heat_class})"
            instances.append(
                Instance("flammable", ids, gap, band.d_low, band.satisfaction(gap), gap < band.d_low, note)
            )
    return tuple(instances)


def incompatible_instances(arrangement: Arrangement, profile: Profile) -> tuple[Instance, ...]:
    """Return one instance for each pair of placed reagents that are incompatible."""
    reagents = arrangement.reagents
    assets = [arrangement.assets[row] for row in reagents]
    pairs = [
        (i, j, hazard)
        for i, j in combinations(range(len(reagents)), 2)
        if (hazard := hazard_between(assets[i], assets[j], profile.pairs)) is not None
    ]
    if not pairs:
        return ()
    boxes, band = arrangement.take(reagents), profile.incompatible
    gaps = pairwise_distance(boxes, boxes)
    instances = []
    for i, j, hazard in pairs:
        ids = arrangement.placements[reagents[i]].id, arrangement.placements[reagents[j]].id
        gap = float(gaps[i, j])
        hard = gap < band.d_low
        instances.append(Instance("incompatible", ids, gap, band.d_low, band.satisfaction(gap), hard, hazard.hazard))
    return tuple(instances)


def contained(arrangement: Arrangement, instances: Sequence[Instance]) -> tuple[Instance, ...]:
    """Return the containment-aware variant of Incomp: reagents in two closed cabinets count as separated."""
    return tuple(
        replace(instance, satisfaction=1.0, hard=False) if _partitioned(arrangement, instance) else instance
        for instance in instances
    )


@lru_cache(maxsize=65536)
def hazard_between(first: Asset, second: Asset, pairs: str) -> Hazard | None:
    """Return why two assets must not meet under a rule set, or None if they may."""
    return incompatible(first, second, pairs)


def _partitioned(arrangement: Arrangement, instance: Instance) -> bool:
    cabinets = [closed_cabinet(arrangement, arrangement.index[placement]) for placement in instance.ids]
    return None not in cabinets and len(set(cabinets)) == len(cabinets)


def apart(instance: Instance) -> tuple[float, str, str]:
    """Return how a pair that is too close is described: meters short, what is wrong, what to do."""
    gap = instance.distance or 0.0
    short, (first, second) = instance.limit - gap, instance.ids
    message = f"{first} is {gap:.2f} m from {second}, under {instance.limit:g} m: {instance.note}"
    return short, message, f"move {first} and {second} {short:.2f} m further apart"


STORED_FLAMMABLES = Term(
    name="flammable",
    metric="flam",
    requires="Flammable reagents keep their distance from heat sources",
    source="fire-code practice; profile `heat` and `flame`",
    instances=lambda site: flammable_instances(site.arrangement, site.profile),
    remedy=apart,
    score=worst_mean,
    looks_at=chemicals,
)
STORED_INCOMPATIBLES = Term(
    name="incompatible",
    metric="incomp",
    requires="Incompatible reagents keep their distance from each other",
    source="IFC 5003.9.8; profile `incompatible`",
    instances=lambda site: incompatible_instances(site.arrangement, site.profile),
    remedy=apart,
    score=worst_mean,
    looks_at=chemicals,
)
