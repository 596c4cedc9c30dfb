"""Violations and missing assets of a layout that was kept in spite of them, as plain data for its provenance."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from labgym.layouts.rules.objective import Assessment

FAILURES = "failures"
"""Key of the failures in the options of a layout's provenance."""
LISTED = 50
"""Most messages of each kind."""


def failures(assessment: Assessment) -> dict[str, Any]:
    """Return the violations, facility errors and missing assets of a layout; empty for a valid layout.

    The keys are `v` and `facility` (numbers), `violations` and `errors` (messages, at most 50 of each), and `missing`
    (names of required assets that are not placed).
    """
    missing = list(assessment.missing or ())
    if not (assessment.v or assessment.errors or missing):
        return {}
    return {
        "v": assessment.v,
        "facility": len(assessment.errors),
        "violations": [violation.message for violation in assessment.violations.items[:LISTED]],
        "errors": [issue.message for issue in assessment.errors[:LISTED]],
        "missing": missing,
    }


def summary(problems: Mapping[str, Any]) -> str:
    """Return one line on how many failures there are, and the first of them."""
    counts = [
        (problems["v"], "violation", "violations"),
        (problems["facility"], "facility error", "facility errors"),
        (len(problems["missing"]), "missing asset", "missing assets"),
    ]
    numbers = ", ".join(f"{count} {one if count == 1 else many}" for count, one, many in counts if count)
    messages = [*problems["violations"], *problems["errors"]]
    first = messages[0] if messages else f"not placed: {', '.join(problems['missing'])}"
    return f"kept with {numbers}: {first}"
