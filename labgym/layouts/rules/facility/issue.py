"""A facility rule that a layout breaks."""

from __future__ import annotations

from collections.abc import Iterable

from labgym.documents import Record
from labgym.layouts.rules.thresholds import Severity


class FacilityIssue(Record):
    """A facility rule that a layout breaks.

    Attributes:
        rule: short name.
        severity: `error` (the generator and the optimizer never leave it behind) or `warning`.
        value, limit: meters or a count; value None if there is nothing to measure.
        source: the standard or guide that the rule comes from.
    """

    rule: str
    ids: tuple[str, ...]
    value: float | None
    limit: float
    message: str
    source: str
    severity: Severity = "warning"


def issue(
    rule: str,
    ids: Iterable[str],
    value: float | None,
    limit: float,
    message: str,
    source: str,
    severity: Severity = "warning",
) -> FacilityIssue:
    """Return an issue; its message ends with the remedy."""
    return FacilityIssue(
        rule=rule, ids=tuple(ids), value=value, limit=limit, message=message, source=source, severity=severity
    )
