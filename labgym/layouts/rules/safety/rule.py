"""A safety rule: its limit, source, severity, what it applies to and how it is checked."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from labgym.layouts.rules.facility.issue import FacilityIssue
from labgym.layouts.rules.safety.site import Site
from labgym.layouts.rules.thresholds import Severity


@dataclass(frozen=True)
class Finding:
    """One way in which a layout breaks a rule.

    Attributes:
        ids: placements that take part; the first is the object that the rule is about.
        value: what was measured, meters or a count; None if there is nothing to measure.
        limit: the limit for this object, in the same unit.
        message: what is wrong, the value and the limit. remedy: what to do.
    """

    ids: tuple[str, ...]
    value: float | None
    limit: float
    message: str
    remedy: str


@dataclass(frozen=True)
class SafetyRule:
    """A rule on what a laboratory holds and where it stands.

    Attributes:
        name: short name, as in reports.
        requires: the requirement in one sentence.
        limit: the threshold in words, with its unit.
        source: the standard or guide that the rule comes from.
        severity: an `error` counts in v(L); a `warning` counts in the facility score only.
        count: returns the number of objects that the rule applies to.
        check: returns the findings.
        ways: whether it plans walks; such rules are applied with navigation only.
    """

    name: str
    requires: str
    limit: str
    source: str
    severity: Severity
    count: Callable[[Site], int]
    check: Callable[[Site], Iterable[Finding]]
    ways: bool = False

    def issues(self, site: Site) -> list[FacilityIssue]:
        """Return the issues of a layout."""
        return [
            FacilityIssue(
                rule=self.name,
                ids=finding.ids,
                value=finding.value,
                limit=finding.limit,
                message=f"{finding.message}: {finding.remedy}",
                source=self.source,
                severity=self.severity,
            )
            for finding in self.check(site)
        ]
