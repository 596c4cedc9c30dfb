"""Corrosives: liquid acids and bases stand below eye level."""

from __future__ import annotations

from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.facility.issue import FacilityIssue, issue
from labgym.layouts.rules.thresholds import CORROSIVE_HEIGHT


def corrosive_liquids(arrangement: Arrangement) -> list[int]:
    """Return the rows of the liquid acids and bases."""
    assets = arrangement.assets
    return [row for row in arrangement.reagents if assets[row].hazards.corrosive and assets[row].phase == "liquid"]


def corrosive_issues(arrangement: Arrangement) -> list[FacilityIssue]:
    """Return a warning for each liquid acid or base above eye level."""
    issues = []
    for row in corrosive_liquids(arrangement):
        bottom = float(arrangement.boxes.z[row, 0])
        if bottom > CORROSIVE_HEIGHT:
            reagent = arrangement.placements[row].id
            message = f"corrosive {reagent} stands at {bottom:.2f} m, above {CORROSIVE_HEIGHT} m: use a lower shelf"
            source = "university chemical storage practice"
            issues.append(issue("corrosive_height", (reagent,), bottom, CORROSIVE_HEIGHT, message, source))
    return issues
