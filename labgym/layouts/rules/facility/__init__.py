"""Facility rules on buildings and furniture: exits, ways out, doors, fronts, hoods, emergency showers.

A broken rule is an issue. Errors are what the generator and the optimizer never leave behind; warnings are advice.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from labgym.layouts.rules.facility import backs, corrosives, exits, fronts, hoods, kept_clear, services, showers
from labgym.layouts.rules.rule import FacilityIssue, FacilityRule

if TYPE_CHECKING:
    from labgym.layouts.rules.site import Site

EXITS: tuple[FacilityRule, ...] = exits.RULES
"""Number and width of doors."""
PLACING: tuple[FacilityRule, ...] = (
    *kept_clear.RULES,
    *backs.RULES,
    *fronts.RULES,
    showers.SHOWER_CLEAR,
    services.SUPPLY,
)
"""Where furniture stands, ways apart."""
WAYS: tuple[FacilityRule, ...] = (exits.EGRESS,)
HOODS: tuple[FacilityRule, ...] = hoods.RULES
EMERGENCY: tuple[FacilityRule, ...] = (showers.HOOD_TO_SHOWER, *corrosives.RULES)
"""Rules that the safety rules replace by stricter ones."""


def issues(rules: Iterable[FacilityRule], site: Site) -> list[FacilityIssue]:
    """Return the issues of a layout under some facility rules."""
    return [issue for rule in rules for issue in rule.issues(site)]
