"""Areas of the floor that stay clear: inside doors, and keep-outs."""

from __future__ import annotations

from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.facility.issue import FacilityIssue, issue
from labgym.layouts.rules.zones import standing_in


def door_area_issues(arrangement: Arrangement) -> list[FacilityIssue]:
    """Return an error for each area inside a door in which objects stand."""
    issues = []
    for entrance in arrangement.building.entrances:
        zone = entrance.area
        blockers = standing_in(arrangement, zone, loose=True, space=entrance.space)
        if blockers:
            message = (
                f"{', '.join(blockers)} in the {zone.width:.2f} x {zone.depth:.2f} m area inside {entrance.label}: "
                "move it out"
            )
            source = "OSHA 29 CFR 1910.36 and .37"
            issues.append(issue("door_area", blockers, None, zone.depth, message, source, "error"))
    return issues


def keep_out_issues(arrangement: Arrangement) -> list[FacilityIssue]:
    """Return an error for each keep-out of the floor in which objects stand."""
    issues = []
    for area in arrangement.layout.floor.keep_outs:
        blockers = standing_in(arrangement, area.box, loose=True)
        if blockers:
            reason = f" ({area.reason})" if area.reason else ""
            message = f"{', '.join(blockers)} in the keep-out {area.id!r}{reason}: move it out"
            issues.append(issue("keep_out", blockers, None, 0.0, message, "the floor's keep-outs", "error"))
    return issues
