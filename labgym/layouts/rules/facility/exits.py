"""Exits: the number and the width of doors, and ways of the required width from them to every place of work."""

from __future__ import annotations

from labgym.layouts.floor import Room
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.building import Building, OneRoom
from labgym.layouts.rules.egress import narrow_ways
from labgym.layouts.rules.facility.issue import FacilityIssue, issue
from labgym.layouts.rules.thresholds import EGRESS_WIDTH, Profile

EXIT_WIDTH = 0.914
"""Clear width of a laboratory's exit door, meters (California Building Code, 24 CCR: 36 in)."""


def exit_issues(room: Room, profile: Profile) -> list[FacilityIssue]:
    """Return what is wrong with the number and width of a room's doors."""
    return building_exit_issues(OneRoom(room), profile)


def building_exit_issues(building: Building, profile: Profile) -> list[FacilityIssue]:
    """Return what is wrong with the number and width of a building's doors."""
    issues = []
    for label, width in dict.fromkeys((entrance.label, entrance.width) for entrance in building.entrances):
        if width < EXIT_WIDTH - 0.005:
            message = f"{label} is {width:.2f} m wide; an exit needs {EXIT_WIDTH:.2f} m: widen it"
            issues.append(issue("exit_width", (), width, EXIT_WIDTH, message, "24 CCR (California Building Code)"))
    for place in building.workplaces:
        doors = sum(entrance.space == place.space for entrance in building.entrances)
        if not doors:
            message = f"no exit for {place.area:.0f} m²{place.where}: add a door"
            issues.append(issue("no_exit", (), 0.0, 1.0, message, "OSHA 29 CFR 1910.36(b)", "error"))
        elif place.area > profile.second_exit_area and doors < 2:
            source = profile.second_exit_source
            message = (
                f"only one exit for {place.area:.0f} m²{place.where}; above {profile.second_exit_area} m² two are "
                f"required ({source}): add a door"
            )
            issues.append(issue("second_exit", (), float(doors), 2.0, message, source, profile.second_exit))
    return issues


def egress_issues(arrangement: Arrangement) -> list[FacilityIssue]:
    """Return an error for each door that no way of the required width joins with every place of work."""
    issues = []
    for way in narrow_ways(arrangement):
        first, count = way.destinations[0], len(way.destinations) - 1
        where = first + (f" and {count} more" if count else "")
        message = (
            f"the widest way from {way.entrance} to {where} is {way.width:.2f} m; "
            f"{EGRESS_WIDTH:.2f} m is required: widen the passage"
        )
        source = "OSHA 29 CFR 1910.36(g); NFPA 101"
        issues.append(issue("egress", way.destinations, way.width, EGRESS_WIDTH, message, source, "error"))
    return issues
