"""Exits: the number and the width of doors, and ways of the required width from them to every place of work."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from labgym.layouts.rules.building import Workplace
from labgym.layouts.rules.earlier import nothing, standing
from labgym.layouts.rules.egress import narrow_exits, narrow_ways
from labgym.layouts.rules.rule import Breach, FacilityRule
from labgym.layouts.rules.thresholds import EGRESS_WIDTH

if TYPE_CHECKING:
    from labgym.layouts.rules.site import Site

EXIT_WIDTH = 0.914
"""Clear width of a laboratory's exit door, meters (California Building Code, 24 CCR: 36 in)."""
LEAST_WIDTH = 0.711
"""Least width of a way out at any point, meters (OSHA 29 CFR 1910.36(g)(2): 28 in)."""


def _narrow_doors(site: Site) -> Iterator[Breach]:
    for label, width in _doors(site):
        if width < LEAST_WIDTH - 0.005:
            message = f"{label} is {width:.2f} m wide; a way out needs {LEAST_WIDTH:.2f} m"
            yield Breach((), width, LEAST_WIDTH, message, "widen it", "OSHA 29 CFR 1910.36(g)(2)", "error")
        elif width < EXIT_WIDTH - 0.005:
            message = f"{label} is {width:.2f} m wide; an exit needs {EXIT_WIDTH:.2f} m"
            yield Breach((), width, EXIT_WIDTH, message, "widen it", severity="warning")


def _doors(site: Site) -> tuple[tuple[str, float], ...]:
    entrances = site.arrangement.building.entrances
    return tuple(dict.fromkeys((entrance.label, entrance.width) for entrance in entrances))


def _exits(site: Site) -> Iterator[tuple[Workplace, int]]:
    """Yield each place of work with the number of its doors."""
    building = site.arrangement.building
    for place in building.workplaces:
        yield place, sum(entrance.space == place.space for entrance in building.entrances)


def _without_exit(site: Site) -> Iterator[Breach]:
    for place, doors in _exits(site):
        if not doors:
            yield Breach((), 0.0, 1.0, f"no exit for {place.area:.0f} m²{place.where}", "add a door")


def _with_one_exit(site: Site) -> Iterator[Breach]:
    limit, source = site.profile.second_exit_area, site.profile.second_exit_source
    for place, doors in _exits(site):
        if doors == 1 and place.area > limit:
            message = (
                f"only one exit for {place.area:.0f} m²{place.where}; above {limit} m² two are required ({source})"
            )
            yield Breach((), float(doors), 2.0, message, "add a door", source, site.profile.second_exit)


def _blocked_ways(site: Site) -> Iterator[Breach]:
    for way in narrow_ways(site.arrangement):
        first, count = way.destinations[0], len(way.destinations) - 1
        where = first + (f" and {count} more" if count else "")
        message = (
            f"the widest way from {way.entrance} to {where} is {way.width:.2f} m; {EGRESS_WIDTH:.2f} m is required"
        )
        yield Breach(way.destinations, way.width, EGRESS_WIDTH, message, "widen the passage")


RULES = (
    FacilityRule(
        name="exit_width",
        requires="Doors are wide enough for an exit",
        limit=f"{EXIT_WIDTH:g} m; an error under {LEAST_WIDTH:g} m",
        source="24 CCR (California Building Code); OSHA 29 CFR 1910.36(g)(2)",
        count=lambda site: len(_doors(site)),
        check=_narrow_doors,
        group="building",
        per_object=False,
        looks_at=nothing,
    ),
    FacilityRule(
        name="no_exit",
        requires="Each laboratory has an exit",
        limit="1 door",
        source="OSHA 29 CFR 1910.36(b)",
        count=lambda site: len(site.arrangement.building.workplaces),
        check=_without_exit,
        group="building",
        per_object=False,
        looks_at=nothing,
    ),
    FacilityRule(
        name="second_exit",
        requires="A large laboratory has two exits",
        limit="2 doors above the area of the profile (`second_exit_area`)",
        source="NFPA 45",
        count=lambda site: len(site.arrangement.building.workplaces),
        check=_with_one_exit,
        group="building",
        per_object=False,
        looks_at=nothing,
    ),
)
EGRESS = FacilityRule(
    name="egress",
    requires="From each exit a way out leads to every place of work",
    limit=f"{EGRESS_WIDTH:g} m wide",
    source="OSHA 29 CFR 1910.36(g); NFPA 101",
    count=lambda site: sum(entrance.exit for entrance in site.arrangement.building.entrances),
    check=_blocked_ways,
    group="placing",
    ways=True,
    per_object=False,
    broken=lambda site: narrow_exits(site.arrangement),
    looks_at=standing,
)
