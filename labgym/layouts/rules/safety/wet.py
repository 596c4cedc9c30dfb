"""Water: reagents that react with water or ignite in air stand away from wet fittings."""

from __future__ import annotations

from collections.abc import Iterator

from labgym.geometry import BoxArray, OrientedBox
from labgym.layouts.rules.safety.hazards import water_reactive
from labgym.layouts.rules.safety.rule import Finding, SafetyRule
from labgym.layouts.rules.safety.site import Site

WET_DISTANCE_M = 1.0
"""Least distance in plan of a water-reactive or pyrophoric reagent from a wet fitting, meters: the reach of splashes
(Prudent Practices, 5.E.2: store water-reactives away from sinks and other sources of water; the distance is ours)."""


def _subjects(site: Site) -> list[int]:
    return [row for row in site.arrangement.reagents if water_reactive(site.arrangement.assets[row])]


def _sources(site: Site) -> list[tuple[str, str, OrientedBox]]:
    """Return the id ("" for a service point), the name and the box of each source of water."""
    arrangement = site.arrangement
    fittings = [
        (arrangement.placements[row].id, arrangement.placements[row].id, arrangement.box(row)) for row in site.wet
    ]
    points = [
        ("", f"the water point at ({point.x:.2f}, {point.y:.2f})", OrientedBox(point.x, point.y, 0.0, 0.0))
        for point in arrangement.layout.floor.services
        if point.kind == "water"
    ]
    return [*fittings, *points]


def _check(site: Site) -> Iterator[Finding]:
    reagents, sources = _subjects(site), _sources(site)
    if not reagents or not sources:
        return
    gaps = site.plan_gaps(reagents, BoxArray.of([box for _, _, box in sources]))
    for i, row in enumerate(reagents):
        reagent = site.arrangement.placements[row].id
        holder = site.arrangement.placements[row].support
        for j, (fitting, name, _) in enumerate(sources):
            gap = float(gaps[i, j])
            if gap < WET_DISTANCE_M - 1e-9:
                ids = (reagent, fitting) if fitting else (reagent,)
                message = (
                    f"{reagent} reacts with water or air and is {gap:.2f} m from {name}, under {WET_DISTANCE_M:g} m"
                )
                yield Finding(ids, gap, WET_DISTANCE_M, message, f"move {holder} {WET_DISTANCE_M - gap:.2f} m away")


RULES = (
    SafetyRule(
        name="water_distance",
        requires="Reagents that react with water or ignite in air keep their distance from sinks, eyewashes, showers, "
        "ice machines and water points, and never stand under one",
        limit=f"{WET_DISTANCE_M:g} m in plan",
        source="Prudent Practices, 5.E.2; NFPA 400",
        severity="error",
        count=lambda site: len(_subjects(site)),
        check=_check,
    ),
)
