"""Corrosives: liquid acids and bases stand below eye level."""

from __future__ import annotations

from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.facility.issue import FacilityIssue, issue
from labgym.layouts.rules.thresholds import CORROSIVE_HEIGHT


def corrosive_issues(arrangement: Arrangement) -> list[FacilityIssue]:
    """Return a warning for each liquid acid or base above eye level."""
    issues = []
    for row in arrangement.reagents:
        hazards, bottom = arrangement.assets[row].hazards, float(arrangement.boxes.z[row, 0])
        chemistry = arrangement.assets[row].chemistry
        liquid = chemistry is not None and chemistry.state == "liquid"
        if (hazards.acid or hazards.base) and liquid and bottom > CORROSIVE_HEIGHT:
            reagent = arrangement.placements[row].id
            message = f"corrosive {reagent} stands at {bottom:.2f} m, above {CORROSIVE_HEIGHT} m: use a lower shelf"
            source = "university chemical storage practice"
            issues.append(issue("corrosive_height", (reagent,), bottom, CORROSIVE_HEIGHT, message, source))
    return issues
