"""The rows of the damage benchmark: a case, what the repair did, and the verdict."""

from __future__ import annotations

import json
import time
from collections import Counter
from dataclasses import dataclass

from labgym.documents import Record
from labgym.eval.outside import WrittenPlan, findings
from labgym.layouts.model import Layout
from labgym.layouts.repairs import repair_layout
from labgym.layouts.rules.objective import Assessment, evaluate_layout
from labgym.layouts.rules.rule_sets import PAPER, RuleSet
from labgym.paper.repairs.cases import RepairCase, patient
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


DIGITS = 2
"""Decimals of processor times."""


class RepairRow(Record):
    """A case of the damage benchmark.

    Attributes:
        kind, pieces, draw: the case. place, protocol, seed: its laboratory.
        objects: number of placements of the damaged layout. damaged: ids of the damaged pieces.
        v_damaged, v: number of violations before and after the repair.
        moved, added: number of objects that the repair moved by themselves, and added.
        missing, free_standing, errors, warnings, outside: what is wrong after the repair, as in `Verdict`.
        repaired: whether nothing is wrong.
    """

    kind: str
    pieces: int
    draw: int
    place: str
    protocol: str
    seed: int
    objects: int
    damaged: tuple[str, ...]
    v_damaged: int
    v: int
    moved: int
    added: int
    missing: tuple[str, ...]
    free_standing: tuple[str, ...]
    errors: tuple[str, ...]
    warnings: tuple[str, ...]
    outside: tuple[str, ...]
    repaired: bool

    @property
    def moved_share(self) -> float:
        """The share of the objects that the repair moved."""
        return self.moved / self.objects


def repair_row(case: RepairCase, seed: int, rules: str | RuleSet = PAPER) -> tuple[RepairRow, float]:
    """Return the row of a case, and the processor time of the repair in seconds: damage, repair and judge a laboratory.

    Raises:
        LabgymError: no laboratory can be damaged in that way.
    """
    ill = patient(case, seed)
    layout = ill.damage.layout
    start = time.process_time()
    result = repair_layout(layout, rules=rules)
    seconds = time.process_time() - start
    judged = verdict(ill.sound, result.layout, layout.protocol, rules)
    kinds = [change.kind for change in result.changes]
    row = RepairRow(
        kind=case.kind,
        pieces=case.pieces,
        draw=case.draw,
        place=ill.place,
        protocol=ill.protocol,
        seed=ill.seed,
        objects=len(layout.placements),
        damaged=ill.damage.ids,
        v_damaged=result.before.v,
        moved=sum(kind in ("moved", "resettled") for kind in kinds),
        added=kinds.count("added"),
        repaired=judged.repaired,
        **vars(judged),
    )
    return row, round(seconds, DIGITS)
