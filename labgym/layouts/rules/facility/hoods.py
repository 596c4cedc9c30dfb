"""Fume hoods: away from doorways and not opposite desks."""

from __future__ import annotations

from labgym.geometry import distance, penetration
from labgym.layouts.floor.exits import HOOD_DOOR_LEAST
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.facility.issue import FacilityIssue, issue
from labgym.layouts.rules.thresholds import ROOM_TOLERANCE
from labgym.layouts.rules.zones import front_zone

HOOD_DOOR = 3.0
"""Distance between a hood and a doorway, meters (NFPA 45 and ANSI/AIHA Z9.5: 10 ft, as university guides cite them)."""

HOOD_OPPOSITE = 3.0
"""No desk within this distance in front of a hood, meters (NFPA 45: not opposite desks)."""


def hood_issues(arrangement: Arrangement) -> list[FacilityIssue]:
    """Return a warning for each hood near a doorway, and for each desk opposite a hood."""
    issues = []
    desks = [row for row, asset in enumerate(arrangement.assets) if asset.subtype == "desk"]
    for row in arrangement.hoods:
        box, hood = arrangement.box(row), arrangement.placements[row].id
        for entrance in arrangement.building.entrances:
            gap = distance(box, entrance.opening)
            if entrance.space == arrangement.spaces[row] and gap < HOOD_DOOR:
                limit = HOOD_DOOR_LEAST if gap < HOOD_DOOR_LEAST else HOOD_DOOR
                message = f"{hood} is {gap:.2f} m from {entrance.label}, under {limit:g} m: move it away"
                issues.append(issue("hood_door", (hood,), gap, limit, message, "NFPA 45; ANSI/AIHA Z9.5"))
        zone = front_zone(box, HOOD_OPPOSITE)
        for desk in desks:
            together = arrangement.spaces[desk] == arrangement.spaces[row]
            if together and penetration(zone, arrangement.box(desk)) > ROOM_TOLERANCE:
                ids, gap = (hood, arrangement.placements[desk].id), distance(box, arrangement.box(desk))
                message = f"{ids[1]} stands opposite {hood} at {gap:.2f} m, under {HOOD_OPPOSITE:g} m: move it aside"
                issues.append(issue("hood_opposite_desk", ids, gap, HOOD_OPPOSITE, message, "NFPA 45"))
    return issues
