"""The verdict on a repair: what is still wrong by the rules, and by a judge that shares no code with them."""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import dataclass

from labgym.eval.outside import WrittenPlan, findings
from labgym.layouts.model import Layout
from labgym.layouts.rules.objective import Assessment, evaluate_layout
from labgym.layouts.rules.rule_sets import PAPER, RuleSet
from labgym.protocols import Protocol


@dataclass(frozen=True)
class RepairVerdict:
    """The faults of a repaired layout.

    Attributes:
        v: number of violations.
        missing: required assets that are not placed.
        free_standing: wall units away from their wall.
        errors: rules of the other facility errors.
        warnings: rules of the facility warnings beyond those of the sound layout, once for each.
        outside: kinds of findings of the independent judge beyond those of the sound layout.
    """

    v: int
    missing: tuple[str, ...]
    free_standing: tuple[str, ...]
    errors: tuple[str, ...]
    warnings: tuple[str, ...]
    outside: tuple[str, ...]

    @property
    def repaired(self) -> bool:
        """Whether nothing is wrong."""
        return not (self.v or self.missing or self.free_standing or self.errors or self.warnings or self.outside)


def verdict(sound: Layout, after: Layout, protocol: Protocol | None, rules: str | RuleSet = PAPER) -> RepairVerdict:
    """Return the verdict on a repaired layout, given the layout before the damage."""
    assessment = evaluate_layout(after, protocol, rules, navigation=True)
    earlier = evaluate_layout(sound, protocol, rules)
    errors = [issue for issue in assessment.errors if issue.rule != "back_to_wall"]
    return RepairVerdict(
        v=assessment.v,
        missing=assessment.missing or (),
        free_standing=tuple(i.ids[0] for i in assessment.errors if i.rule == "back_to_wall"),
        errors=tuple(issue.rule for issue in errors),
        warnings=_beyond(_warnings(assessment), _warnings(earlier)),
        outside=_beyond(_findings(after), _findings(sound)),
    )


def _warnings(assessment: Assessment) -> Counter[str]:
    return Counter(issue.rule for issue in assessment.issues if issue.severity == "warning")


def _findings(layout: Layout) -> Counter[str]:
    plan = WrittenPlan(json.loads(json.dumps(layout.to_json())))
    return Counter(finding.kind for finding in findings(plan))


def _beyond(after: Counter[str], before: Counter[str]) -> tuple[str, ...]:
    return tuple(sorted((after - before).elements()))
