"""Facility rules in addition to the metrics: exits, ways out, doors, fronts, hoods, emergency equipment.

A broken rule is an issue. Errors are what the generator and the optimizer never leave behind; warnings are advice.
"""

from labgym.layouts.rules.facility.issue import FacilityIssue
from labgym.layouts.rules.facility.issues import facility_issues

__all__ = ["FacilityIssue", "facility_issues"]
