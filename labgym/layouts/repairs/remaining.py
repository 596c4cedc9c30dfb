"""What is still wrong with a repaired layout, and why."""

from __future__ import annotations

from collections.abc import Iterator

from labgym.layouts.model import Layout
from labgym.layouts.moves import may_move
from labgym.layouts.repairs.rank import State
from labgym.layouts.rules.facility import FacilityIssue, facility_issues
from labgym.layouts.rules.objective import Assessment
from labgym.layouts.rules.touchstone2.equipment import missing_equipment, required_equipment
from labgym.protocols import Protocol


def problems(state: State) -> tuple[str, ...]:
    """Return what is wrong with a layout and why it stays, one sentence for each fault.

    Hard facility errors count under every version of the metrics, also those that no moved object can change: a
    building without an exit, fixed objects in a way out, safety equipment that is missing.
    """
    assessment, layout = state.assessment, state.layout
    sentences = [
        f"{violation.message} ({_reason(layout, violation.ids)})"
        for violation in assessment.violations.items
        if violation.kind != "missing"
    ]
    sentences += [
        f"{issue.message} ({_reason(layout, issue.ids)})"
        for issue in _errors(assessment)
        if not any(issue.message.startswith(violation.message) for violation in assessment.violations.items)
    ]
    sentences += [f"{name} is missing (no free place was found for it)" for name in assessment.lacking]
    return (*sentences, *_unequipped(assessment, state.protocol))


def _errors(assessment: Assessment) -> Iterator[FacilityIssue]:
    """Yield the facility errors of the layout, then those of the building and of fixed objects alone."""
    yield from assessment.errors
    if "facility" in assessment.profile.left_out:
        return
    yielded = {issue.message for issue in assessment.errors}
    for issue in facility_issues(assessment.arrangement, assessment.profile):
        if issue.severity == "error" and issue.message not in yielded:
            yield issue


def _unequipped(assessment: Assessment, protocol: Protocol | None) -> Iterator[str]:
    """Yield the safety equipment that the version of the metrics does not require, but the reagents do."""
    arrangement = assessment.arrangement
    required = required_equipment(arrangement, protocol)
    lacking = set(assessment.lacking)
    for name in missing_equipment(arrangement, required, assessment.out_of_bounds):
        if name not in lacking and "facility" not in assessment.profile.left_out:
            source = next(requirement.source for requirement in required if requirement.asset == name)
            yield f"{name} is required for the reagents ({source}) but missing: --metrics touchstone-v2 adds it"


def _reason(layout: Layout, ids: tuple[str, ...]) -> str:
    if not ids:
        return "the building itself is not changed"
    items = [layout.root(item).id for item in ids if item in layout.by_id]
    if items and not any(may_move(layout, item) for item in items):
        return "fixed objects stay"
    return "no other place or arrangement that was tried is better"
