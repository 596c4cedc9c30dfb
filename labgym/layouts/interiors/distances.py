"""Distances that furniture keeps: habits, hazards of reagents, water, heat, and short trips."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

from labgym.geometry import OrientedBox
from labgym.layouts.brief import Content, Nearness, Proximity, Separation, Unit
from labgym.layouts.habits import Habits
from labgym.layouts.request import Request
from labgym.layouts.rules.nearness import APPARATUS_DISTANCE_M, PLACES_DISTANCE_M
from labgym.layouts.rules.safety.hazards import burning
from labgym.layouts.rules.separation import heat_band
from labgym.layouts.rules.supplies import WET
from labgym.layouts.rules.thresholds import Profile
from labgym.layouts.stocking import Cabinet, conflict_between
from labgym.protocols import Protocol

MARGIN = 0.02
"""Added to every distance between hazards, meters, so that rounding never undercuts a threshold."""


def nearness_of(units: Sequence[Unit], habits: Habits) -> Iterable[Nearness]:
    """Yield the habits of neighborhood that concern some units; the first unit of each kind counts."""
    first = first_of_role(units)
    for pair in habits.near:
        if pair.first in first and pair.second in first:
            yield Nearness(first[pair.first].id, first[pair.second].id, pair.weight)


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


WET_DISTANCE = 1.0 + MARGIN
"""Distance of what stores or handles water-reactives from wet fittings, meters: the rule's 1.0 m and a margin."""


def wet(unit: Unit) -> bool:
    """Whether a unit is a sink, an eyewash, a shower or an ice machine."""
    return unit.asset.subtype in WET


def dry_separations(units: Sequence[Unit]) -> tuple[Separation, ...]:
    """Return the distances of water-reactives from wet fittings."""
    return tuple(
        Separation(one.id, other.id, WET_DISTANCE, "reacts with water")
        for one in units
        if "reactive" in one.hazards
        for other in units
        if wet(other) and other.id != one.id
    )


def dry_distances(unit: Unit, placed: Iterable[tuple[Unit, OrientedBox]]) -> list[tuple[OrientedBox, float]]:
    """Return the footprints from which a unit keeps a distance because one is wet and the other reacts with water."""
    pairs = (
        (wet(unit) and "reactive" in other.hazards, wet(other) and "reactive" in unit.hazards, foot)
        for other, foot in placed
    )
    return [(foot, WET_DISTANCE) for one, two, foot in pairs if one or two]


@dataclass(frozen=True)
class HandlingDistances:
    """The distances of places where flammables are handled from the heat of others.

    Attributes:
        least: distances under which a layout has a violation. wished: distances at which the rule is fully satisfied.
    """

    least: tuple[Separation, ...]
    wished: tuple[Separation, ...]


def handling_distances(
    request: Request, units: Sequence[Unit], contents: Mapping[str, tuple[Content, ...]]
) -> HandlingDistances:
    """Return the distances of each location that handles a flammable from the units that carry heat sources.

    They hold between footprints, and so between the vessels and the heat sources on them. Heat that a protocol uses at
    the location itself does not count.
    """
    first, pairs = first_of_role(units), dict[tuple[str, str], tuple[float, float, str]]()
    for protocol in request.protocols:
        for location, reagent in burning_at(request, protocol):
            place = first.get(location)
            for unit in units:
                things = [unit.asset, *(content.asset for content in contents.get(unit.id, ()))]
                bands = [band for thing in things if (band := heat_band(thing, request.profile)) is not None]
                if place is None or unit.id == place.id or not bands:
                    continue
                low, high = max(band.d_low for band in bands), max(band.d_min for band in bands)
                pairs.setdefault((place.id, unit.id), (low, high, f"{reagent}, flammable or oxidizing, is used there"))
    return HandlingDistances(
        tuple(Separation(*pair, low + MARGIN, why) for pair, (low, _, why) in pairs.items()),
        tuple(Separation(*pair, high + MARGIN, why) for pair, (_, high, why) in pairs.items()),
    )


def proximities_of(request: Request, units: Sequence[Unit]) -> tuple[Proximity, ...]:
    """Return the pairs of units that a protocol requires near each other (constraint `near`), each once.

    Two places have several trips between them; a machine on the floor belongs to the apparatus at a place.
    """
    first, pairs = first_of_role(units), dict[frozenset[str], Proximity]()
    for protocol in request.protocols:
        for rule in protocol.spatial_constraints:
            if rule.kind == "near" and rule.object in protocol.locations:
                one, other = first.get(rule.subject), first.get(rule.object)
                if one is not None and other is not None and one.id != other.id:
                    places = rule.subject in protocol.locations
                    abreast = (one.width + other.width) / 2.0 + APPARATUS_DISTANCE_M / 2.0
                    limit = PLACES_DISTANCE_M if places else abreast
                    pair = Proximity(one.id, other.id, limit - MARGIN, rule.reason)
                    pairs.setdefault(frozenset((one.id, other.id)), pair)
    return tuple(pairs.values())


def neighborhoods(proximities: Sequence[Proximity]) -> list[frozenset[str]]:
    """Return the sets of units that pairs join directly or by others, in the order of the pairs."""
    groups: list[frozenset[str]] = []
    for rule in proximities:
        pair = frozenset((rule.first, rule.second))
        joined = [group for group in groups if not group.isdisjoint(pair)]
        groups = [group for group in groups if group not in joined] + [pair.union(*joined)]
    return groups


def first_of_role(units: Sequence[Unit]) -> dict[str, Unit]:
    """Return the first unit of each role: the one at which a protocol's steps are carried out."""
    first: dict[str, Unit] = {}
    for unit in units:
        first.setdefault(unit.asset.role, unit)
    return first


def burning_at(request: Request, protocol: Protocol) -> Iterator[tuple[str, str]]:
    """Yield the locations of a protocol at which a flammable or an oxidizer is used, and the first of them."""
    roles = {use.name: request.catalog.find(use.name) for use in protocol.reagents}
    for location in protocol.locations:
        names = [name for step in protocol.steps if step.location == location for name in step.uses if name in roles]
        burns = sorted(roles[name].name for name in names if burning(roles[name]))
        if burns:
            yield location, burns[0]
