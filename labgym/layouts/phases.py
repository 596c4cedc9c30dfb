"""The phases between a proposal and a finished layout: optimize, complete, refine, repair."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from labgym.layouts.adjust import Adjuster
from labgym.layouts.model import Layout
from labgym.layouts.optimise import optimise_assessed
from labgym.layouts.refinement import refine_assessed
from labgym.layouts.repairs import repair_layout
from labgym.layouts.repairs.additions import with_missing
from labgym.layouts.repairs.rank import State
from labgym.layouts.rules.objective import Assessment, evaluate_layout
from labgym.layouts.rules.rule_sets import RuleSet
from labgym.layouts.trace import Recorder
from labgym.protocols import Protocol

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


def improved(
    layout: Layout,
    protocol: Protocol,
    rules: RuleSet,
    adjuster: Adjuster | None = None,
    optimise: bool = True,
    refine: bool = True,
    complete: bool = True,
    trace: Recorder | None = None,
    facility: bool = True,
) -> tuple[Layout, Assessment]:
    """Return a layout after the phases, and its assessment with navigation.

    Args:
        layout: the proposal.
        protocol: what the layout is for.
        rules: rule set, with its thresholds.
        adjuster: adjusts layouts; by default rules and search.
        optimise: whether to repair and adjust the layout, and what the refinement changes.
        refine: whether to refine it for navigation; if not, nothing considers navigation.
        complete: whether the optimization adds required assets that the proposal lacks, and whether a layout that still
            fails after both phases is repaired by all means (`labgym.layouts.repairs`).
        trace: records every iteration.
        facility: whether the optimization also follows the facility rules and clears ways, and the repair runs. If not,
            its cost is v(L) alone, as in the paper, and only the refinement considers navigation.
    """
    if trace is not None:
        trace.begin(layout, protocol, rules)
    if not facility:
        plain = replace(rules, facility_in_cost=False)
        layout, _ = _phases(layout, protocol, plain, adjuster, optimise, refine, complete, trace)
        return layout, evaluate_layout(layout, protocol, rules, navigation=True)
    layout, assessment = _phases(layout, protocol, rules, adjuster, optimise, refine, complete, trace)
    if optimise and refine and complete:
        return repaired(layout, assessment, protocol, adjuster, trace)
    return layout, assessment


def repaired(
    layout: Layout,
    assessment: Assessment,
    protocol: Protocol,
    adjuster: Adjuster | None = None,
    trace: Recorder | None = None,
) -> tuple[Layout, Assessment]:
    """Return a layout that is drawn by a seed, repaired by all means if it fails, and its assessment with navigation.

    Args:
        assessment: the assessment of the layout with navigation.
    """
    if not failures(assessment):
        return layout, assessment
    repair = repair_layout(layout, protocol, assessment.rules, adjuster, trace, seeded=True)
    return repair.layout, repair.after


def _phases(
    layout: Layout,
    protocol: Protocol,
    rules: RuleSet,
    adjuster: Adjuster | None,
    optimise: bool,
    refine: bool,
    complete: bool,
    trace: Recorder | None,
) -> tuple[Layout, Assessment]:
    """Return a layout after optimization, completion and refinement, and its assessment with navigation."""
    if optimise:
        layout, assessment = optimise_assessed(layout, protocol, rules, adjuster, trace, refine)
        if complete and assessment.missing:
            layout, assessment = _completed(layout, assessment, protocol, adjuster, refine, trace)
    else:
        assessment = evaluate_layout(layout, protocol, rules, navigation=True)
    if refine:
        layout, assessment = refine_assessed(layout, assessment, protocol, adjuster, optimise, trace)
    return layout, assessment


def _completed(
    layout: Layout,
    assessment: Assessment,
    protocol: Protocol,
    adjuster: Adjuster | None,
    refine: bool,
    trace: Recorder | None,
) -> tuple[Layout, Assessment]:
    """Return the layout with what it lacks, optimized again."""
    state = with_missing(State.of(layout, protocol, assessment.rules, navigation=refine, seeded=True))
    if state.layout is layout:
        return layout, assessment
    if trace is not None:
        trace.update("complete", None, state.layout)
    return optimise_assessed(state.layout, protocol, assessment.rules, adjuster, trace, refine)
