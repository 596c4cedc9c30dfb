"""Flam and Incomp where reagents are used: at the location of each step that handles them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from labgym.geometry import pairwise_distance
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.rule import Instance
from labgym.layouts.rules.separation import (
    STORED_FLAMMABLES,
    STORED_INCOMPATIBLES,
    flammable_instances,
    hazard_between,
    heat_band,
    incompatible_instances,
)
from labgym.layouts.rules.storage import closed_cabinet
from labgym.layouts.rules.thresholds import Profile
from labgym.layouts.rules.whereabouts import Whereabouts
from labgym.protocols import Protocol


@dataclass(frozen=True)
class Handling:
    """The reagents that a protocol handles at one location.

    Attributes:
        location: row of the location.
        vessels: rows of the instruments that the steps with a reagent use and that stand there; the location's own row
            without any.
        reagents: roles of the reagents.
        own: roles of everything that is used there, by other protocols of the layout too, which take turns; its
            reagents do not count as neighbors.
        own_rows: rows of what of it stands there; its heat does not count as a neighbor.
    """

    location: int
    vessels: tuple[int, ...]
    reagents: frozenset[str]
    own: frozenset[str]
    own_rows: frozenset[int]


def handlings(arrangement: Arrangement, protocol: Protocol) -> tuple[Handling, ...]:
    """Return what a protocol handles at each of its locations that is placed, in the order of the first visit."""
    whereabouts = Whereabouts(arrangement, protocol)
    names = {use.name for use in protocol.reagents}
    sharing = tuple(one for one in arrangement.layout.protocols if one != protocol)
    places = []
    for location in protocol.locations:
        row = whereabouts.place(location)
        steps = [step for step in protocol.steps if step.location == location]
        reagents = {name for step in steps for name in step.uses if name in names}
        if row is None or not reagents:
            continue
        handled = [step for step in steps if not names.isdisjoint(step.uses)]
        tools = dict.fromkeys(name for step in handled for name in step.uses if name not in names)
        vessels = tuple(
            vessel
            for name in tools
            for vessel in whereabouts.of_name(name)
            if row in whereabouts.carriers(vessel) and arrangement.assets[vessel].heat_class is None
        )
        roles = frozenset(whereabouts.role(name) for name in reagents)
        shared = (step for one in sharing for step in one.steps if step.location == location)
        used = dict.fromkeys(name for step in (*steps, *shared) for name in step.uses)
        own_rows = (each for name in used for each in whereabouts.of_name(name))
        places.append(
            Handling(
                location=row,
                vessels=vessels or (row,),
                reagents=roles,
                own=frozenset(whereabouts.role(name) for name in used),
                own_rows=frozenset(each for each in own_rows if row in whereabouts.carriers(each)),
            )
        )
    return tuple(places)


def flammable_handling(arrangement: Arrangement, places: Sequence[Handling], profile: Profile) -> tuple[Instance, ...]:
    """Return one instance for each location that handles a flammable reagent and each heat source of others.

    The distance runs from the nearest vessel. Heat that a protocol of the layout uses at the location does not count.

    Args:
        places: what the protocol handles, as `handlings` returns it.
    """
    catalog, sources = arrangement.layout.catalog, []
    for row, asset in enumerate(arrangement.assets):
        band = heat_band(asset, profile)
        if band is not None:
            sources.append((row, band))
    instances = []
    for place in places:
        flammable = sorted(name for name in place.reagents if catalog.get(name).hazards.flammable)
        near = [(source, band) for source, band in sources if source not in place.own_rows] if flammable else []
        gaps = _gaps(arrangement, place.vessels, [source for source, _ in near])
        for (source, band), gap in zip(near, gaps, strict=True):
            ids = arrangement.placements[place.location].id, arrangement.placements[source].id
            note = f"{flammable[0]}, flammable, is used near a heat source ({arrangement.assets[source].heat_class})"
            hard = gap < band.d_low
            instances.append(Instance("flammable", ids, gap, band.d_low, band.satisfaction(gap), hard, note))
    return tuple(instances)


def incompatible_handling(
    arrangement: Arrangement, places: Sequence[Handling], profile: Profile
) -> tuple[Instance, ...]:
    """Return one instance for each location and each placed reagent incompatible with what is used there.

    Reagents that the protocol uses at the location do not count; a reagent in a closed cabinet is separated
    (IFC 5003.9.8: an approved cabinet replaces the distance).

    Args:
        places: what the protocol handles, as `handlings` returns it.
    """
    catalog, band = arrangement.layout.catalog, profile.incompatible
    instances = []
    for place in places:
        handled = [catalog.get(name) for name in sorted(place.reagents)]
        near = []
        for row in arrangement.reagents:
            asset = arrangement.assets[row]
            hazards = (hazard_between(one, asset, profile.pairs) for one in handled)
            hazard = None if asset.role in place.own else next((one for one in hazards if one is not None), None)
            if hazard is not None:
                near.append((row, hazard))
        gaps = _gaps(arrangement, place.vessels, [row for row, _ in near])
        for (row, hazard), gap in zip(near, gaps, strict=True):
            shut = closed_cabinet(arrangement, row) is not None
            satisfaction = 1.0 if shut else band.satisfaction(gap)
            ids = arrangement.placements[place.location].id, arrangement.placements[row].id
            hard = not shut and gap < band.d_low
            note = f"{hazard.hazard}, where it is used"
            instances.append(Instance("incompatible", ids, gap, band.d_low, satisfaction, hard, note))
    return tuple(instances)


def _gaps(arrangement: Arrangement, rows: tuple[int, ...], others: list[int]) -> list[float]:
    """Return the distance of each of some other objects from the nearest of some objects, meters."""
    if not others:
        return []
    gaps: list[float] = pairwise_distance(arrangement.take(list(rows)), arrangement.take(others)).min(axis=0).tolist()
    return gaps


FLAMMABLES = replace(
    STORED_FLAMMABLES,
    requires="Flammable reagents keep their distance from heat sources, where they stand and where they are used",
    instances=lambda site: (
        *flammable_instances(site.arrangement, site.profile),
        *flammable_handling(site.arrangement, site.handled_now, site.profile),
    ),
)
INCOMPATIBLES = replace(
    STORED_INCOMPATIBLES,
    requires="Incompatible reagents keep their distance from each other, where they stand and where they are used",
    instances=lambda site: (
        *incompatible_instances(site.arrangement, site.profile),
        *incompatible_handling(site.arrangement, site.handled_now, site.profile),
    ),
)
