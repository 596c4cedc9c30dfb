"""Services: furniture stands within reach of the water, gas and exhaust that it needs."""

from __future__ import annotations

import math

from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.facility.issue import FacilityIssue, issue
from labgym.layouts.rules.supplies import SOURCES, unsupplied
from labgym.layouts.rules.thresholds import Severity


def supply_issues(arrangement: Arrangement) -> list[FacilityIssue]:
    """Return an issue for each piece beyond the reach of water, gas or exhaust; an error where the floor requires it.

    Floors without service points of a kind are not judged for it.
    """
    issues = []
    for piece in unsupplied(arrangement):
        source = SOURCES[piece.kind]
        severity: Severity = "error" if piece.required else "warning"
        if math.isinf(piece.beyond):
            message = f"{piece.id} needs {piece.kind}, but {piece.space!r} has no such point: add one"
            issues.append(issue("supply", (piece.id,), None, 0.0, message, source, severity))
        else:
            gap = piece.beyond
            message = f"{piece.id} is {gap:.2f} m beyond the reach of {piece.kind}: move it, or add a point near it"
            issues.append(issue("supply", (piece.id,), gap, 0.0, message, source, severity))
    return issues
