"""Water: reagents that react with water or ignite in air are stored and handled away from wet fittings."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from labgym.geometry import BoxArray, OrientedBox
from labgym.layouts.rules.earlier import chemicals, standing
from labgym.layouts.rules.rule import Breach, FacilityRule
from labgym.layouts.rules.safety.hazards import water_reactive
from labgym.layouts.rules.site import Site

WET_DISTANCE_M = 1.0
"""Least distance in plan of a water-reactive or pyrophoric reagent from a wet fitting, meters: the reach of splashes
(Prudent Practices, 5.E.2: store water-reactives away from sinks and other sources of water; 4.D.2.1: they react with
water at once; the distance is ours)."""


def _stored(site: Site) -> list[int]:
    return [row for row in site.arrangement.reagents if water_reactive(site.arrangement.assets[row])]


def _used(site: Site) -> dict[int, str]:
    """Return the first such reagent that is handled on each piece of furniture, by the furniture's row.

    A step may use the whole surface, so that distances run from its outline.
    """
    arrangement, used = site.arrangement, dict[int, str]()
    for place in site.handled:
        reagents = [reagent.name for reagent in site.reagents_of(place) if water_reactive(reagent)]
        if reagents:
            root = arrangement.layout.root(arrangement.placements[place.location].id).id
            used.setdefault(arrangement.row(root), reagents[0])
    return used


def _fittings(site: Site) -> list[tuple[str, str, OrientedBox]]:
    """Return the id, the name and the box of each wet fitting."""
    arrangement = site.arrangement
    return [(arrangement.placements[row].id, arrangement.placements[row].id, arrangement.box(row)) for row in site.wet]


def _water_points(site: Site) -> list[tuple[str, str, OrientedBox]]:
    """Return the same of each water point, which has no id."""
    return [
        ("", f"the water point at ({point.x:.2f}, {point.y:.2f})", OrientedBox(point.x, point.y, 0.0, 0.0))
        for point in site.arrangement.layout.floor.services
        if point.kind == "water"
    ]


def _near(
    site: Site, places: Sequence[tuple[int, str, str]], sources: Sequence[tuple[str, str, OrientedBox]]
) -> Iterator[Breach]:
    """Yield the findings of places that are too near to a source of water.

    Args:
        places: rows of objects, each with what is done there and what to move.
    """
    if not places or not sources:
        return
    gaps = site.plan_gaps([row for row, _, _ in places], BoxArray.of([box for _, _, box in sources]))
    for (row, what, moved), distances in zip(places, gaps, strict=True):
        own = site.arrangement.placements[row].id
        for (fitting, name, _), gap in zip(sources, distances.tolist(), strict=True):
            if gap < WET_DISTANCE_M - 1e-9:
                ids = (own, fitting) if fitting else (own,)
                message = f"{own} {what} and is {gap:.2f} m from {name}, under {WET_DISTANCE_M:g} m"
                yield Breach(ids, gap, WET_DISTANCE_M, message, f"move {moved} {WET_DISTANCE_M - gap:.2f} m away")


def _standing_and_chemicals(site: Site, row: int) -> object:
    return standing(site, row) or chemicals(site, row)


def _check(site: Site) -> Iterator[Breach]:
    placements = site.arrangement.placements
    stored = [(row, "reacts with water or air", placements[row].support) for row in _stored(site)]
    yield from _near(site, stored, [*_fittings(site), *_water_points(site)])
    used = [
        (row, f"is where {name}, which reacts with water or air, is handled", f"{placements[row].id} or the fitting")
        for row, name in _used(site).items()
    ]
    # Cooling water of a condenser is part of a hood, so that water points do not count where reagents are handled.
    yield from _near(site, used, _fittings(site))


RULES = (
    FacilityRule(
        name="water_distance",
        requires="Reagents that react with water or ignite in air are stored and handled away from sinks, eyewashes, "
        "showers and ice machines, stored away from water points too, and never under one",
        limit=f"{WET_DISTANCE_M:g} m in plan",
        source="Prudent Practices, 4.D.2.1 and 5.E.2; NFPA 400",
        count=lambda site: len(_stored(site)) + len(_used(site)),
        check=_check,
        looks_at=_standing_and_chemicals,
    ),
)
