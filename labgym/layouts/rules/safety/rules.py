"""All safety rules, and the issues of a layout under them."""

from __future__ import annotations

from labgym.layouts.rules.facility.issue import FacilityIssue
from labgym.layouts.rules.safety import fire, heights, pieces, planning, rooms, square, standing, walks, walls, wet
from labgym.layouts.rules.safety.rule import SafetyRule
from labgym.layouts.rules.safety.site import Site

RULES: tuple[SafetyRule, ...] = (
    *wet.RULES,
    *fire.RULES,
    *rooms.RULES,
    *walks.RULES,
    *walls.RULES,
    *heights.RULES,
    *standing.RULES,
    *square.RULES,
    *pieces.RULES,
    *planning.RULES,
)
"""The rules in the order of reports."""


def safety_issues(site: Site, ways: bool) -> tuple[FacilityIssue, ...]:
    """Return every issue of a layout under the safety rules.

    Args:
        ways: True for the rules that plan walks, False for all others.
    """
    return tuple(issue for rule in RULES if rule.ways == ways for issue in rule.issues(site))
