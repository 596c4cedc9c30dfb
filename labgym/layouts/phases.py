"""The phases between a proposal and a finished layout: optimize, complete, refine, repair."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

from labgym.layouts.adjust import Adjuster
from labgym.layouts.method import DEFAULT, Method
from labgym.layouts.model import Layout
from labgym.layouts.optimise import optimise_assessed
from labgym.layouts.refinement import refine_assessed
from labgym.layouts.repairs import repair_layout
from labgym.layouts.repairs.additions import with_missing
from labgym.layouts.repairs.rank import RepairState
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


@dataclass(frozen=True)
class Phases:
    """The phases of a method, for one protocol and rule set.

    Attributes:
        protocol: what the layouts are for.
        trace: records every iteration.
        complete: whether the optimization adds required assets that the proposal lacks, and whether a layout that still
            fails after both phases is repaired by all means (`labgym.layouts.repairs`).
    """

    protocol: Protocol
    rules: RuleSet
    method: Method = DEFAULT
    trace: Recorder | None = None
    complete: bool = True

    @cached_property
    def adjuster(self) -> Adjuster:
        """The adjuster of all phases; one that asks a language model counts its questions."""
        return self.method.adjusts_with()

    def improved(self, layout: Layout) -> tuple[Layout, Assessment]:
        """Return a proposal after the phases, and its assessment with navigation."""
        if self.trace is not None:
            self.trace.begin(layout, self.protocol, self.rules)
        if not self.method.facility:
            layout, _ = self._run(layout, replace(self.rules, facility_in_cost=False))
            return layout, evaluate_layout(layout, self.protocol, self.rules, navigation=True)
        layout, assessment = self._run(layout, self.rules)
        return self.repaired(layout, assessment) if self.method.repairs and self.complete else (layout, assessment)

    def repaired(self, layout: Layout, assessment: Assessment) -> tuple[Layout, Assessment]:
        """Return a layout, repaired by all means if its assessment with navigation fails, and its new assessment."""
        if not failures(assessment):
            return layout, assessment
        repair = repair_layout(layout, self.protocol, assessment.rules, self.adjuster, self.trace, seeded=True)
        return repair.layout, repair.after

    def _run(self, layout: Layout, rules: RuleSet) -> tuple[Layout, Assessment]:
        """Return a layout after optimization, completion and refinement, and its assessment with navigation."""
        optimise, refine = self.method.optimise, self.method.refine
        if optimise:
            layout, assessment = self._optimised(layout, rules)
            if self.complete and assessment.missing:
                layout, assessment = self._completed(layout, assessment)
        else:
            assessment = evaluate_layout(layout, self.protocol, rules, navigation=True)
        if refine:
            return refine_assessed(layout, assessment, self.protocol, self.adjuster, optimise, self.trace)
        return layout, assessment

    def _optimised(self, layout: Layout, rules: RuleSet) -> tuple[Layout, Assessment]:
        return optimise_assessed(layout, self.protocol, rules, self.adjuster, self.trace, self.method.refine)

    def _completed(self, layout: Layout, assessment: Assessment) -> tuple[Layout, Assessment]:
        """Return the layout with what it lacks, optimized again."""
        navigation = self.method.refine
        state = with_missing(
            RepairState.of(layout, self.protocol, assessment.rules, navigation=navigation, seeded=True)
        )
        if state.layout is layout:
            return layout, assessment
        if self.trace is not None:
            self.trace.update("complete", None, state.layout)
        return self._optimised(state.layout, assessment.rules)
