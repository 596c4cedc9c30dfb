"""Faults that a repaired layout still has, and the reasons."""

from __future__ import annotations

from collections.abc import Iterator

from labgym.layouts.model import Layout
from labgym.layouts.moves import may_move
from labgym.layouts.repairs.rank import State
from labgym.layouts.rules.facility.showers import HOOD_TO_SHOWER
from labgym.layouts.rules.objective import Assessment
from labgym.layouts.rules.rule import FacilityIssue


def problems(state: State) -> tuple[str, ...]:
    """Return what is wrong with a layout and why it stays, one sentence for each fault.

    Hard facility errors count under every rule set, also those that no moved object can change: a
    building without an exit, fixed objects in a way out, no shower that is reached from a hood.
    """
    assessment, layout = state.assessment, state.layout
    described = [violation.message for violation in assessment.violations.items]
    sentences = [
        f"{violation.message} ({_reason(layout, violation.ids)})"
        for violation in assessment.violations.items
        if violation.kind != "missing"
    ]
    sentences += [
        f"{issue.message} ({_reason(layout, issue.ids)})"
        for issue in _errors(assessment)
        if not any(map(issue.message.startswith, described))
    ]
    sentences += [f"{name} is missing (no free place was found for it)" for name in assessment.lacking]
    return tuple(sentences)


def _errors(assessment: Assessment) -> Iterator[FacilityIssue]:
    """Yield the facility errors of the layout, then those of the building and of fixed objects, and absent showers."""
    yield from assessment.errors
    if not assessment.rules.facility_in_cost:
        return
    yielded = {issue.message for issue in assessment.errors}
    advised = HOOD_TO_SHOWER in assessment.rules.facility
    for issue in assessment.issues:
        absent = advised and issue.rule == HOOD_TO_SHOWER.name and issue.value is None
        if (issue.severity == "error" or absent) and issue.message not in yielded:
            yield issue


def _reason(layout: Layout, ids: tuple[str, ...]) -> str:
    if not ids:
        return "the building itself is not changed"
    items = [layout.root(item).id for item in ids if item in layout.by_id]
    if items and not any(may_move(layout, item) for item in items):
        return "fixed objects stay"
    return "no other place or arrangement that was tried is better"
