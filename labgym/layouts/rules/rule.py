"""The kinds of rules that a rule set lists: terms with their instances, drives, and facility rules."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal

from labgym.documents import Record
from labgym.layouts.rules.earlier import LooksAt
from labgym.layouts.rules.thresholds import WORST, Severity
from labgym.navigation.plan import PLANNING_RADIUS

if TYPE_CHECKING:
    from labgym.layouts.rules.objective import Assessment
    from labgym.layouts.rules.site import Site
    from labgym.navigation.feasibility import Leg


@dataclass(frozen=True)
class Instance:
    """One instance of a chemical rule: a pair to keep apart, a reagent to store, glassware to keep from the edge.

    Attributes:
        ids: placements that take part.
        distance: what the rule measures, meters; None for storage.
        limit: the distance under which the satisfaction is 0 (d_low), meters; 0 without a limit.
        satisfaction: in [0, 1]; 0 if a participant is out of bounds or collides.
        hard: whether it counts in v(L): a pair under d_low, a reagent that is not stored.
        note: hazard or reason, for messages.
    """

    rule: str
    ids: tuple[str, ...]
    distance: float | None
    limit: float
    satisfaction: float
    hard: bool
    note: str = ""


def penalised(instances: Sequence[Instance], faulty: frozenset[str]) -> tuple[Instance, ...]:
    """Apply the geometry penalty: an instance with a participant in `faulty` scores 0."""
    return tuple(
        instance if faulty.isdisjoint(instance.ids) else replace(instance, satisfaction=0.0) for instance in instances
    )


def mean(instances: Sequence[Instance]) -> float | None:
    """Return the mean satisfaction, None without instances."""
    return sum(instance.satisfaction for instance in instances) / len(instances) if instances else None


def worst_mean(instances: Sequence[Instance], worst: int = WORST) -> float | None:
    """Return the mean of the worst few satisfactions, None without instances."""
    lowest = sorted(instance.satisfaction for instance in instances)[:worst]
    return sum(lowest) / len(lowest) if lowest else None


@dataclass(frozen=True)
class Term:
    """A rule that is measured on instances: pairs to keep apart, reagents to store, fronts to keep free.

    Attributes:
        name: short name; that of its hard violations.
        metric: field of the report that holds its score.
        requires: the requirement in one sentence.
        source: the standard or guide that it comes from.
        instances: returns the instances of a layout.
        remedy: returns how a hard instance is described: amount in meters (1 for counts), what is wrong, what to do.
            None if no instance is hard.
        score: returns the metric of instances, None without any.
        lowers: half of F that it lowers: the mean satisfaction, or the share of objects in no violation.
        chemical: whether its score is part of S_chem.
        looks_at: what the term looks at (`StateChanges.concern`); None for everything.
        void: objects whose instances score 0: `faulty` ones are out of bounds or collide; `unusable` ones also include
            those with a blocked front.
    """

    name: str
    metric: str
    requires: str
    source: str
    instances: Callable[[Site], Iterable[Instance]]
    remedy: Callable[[Instance], tuple[float, str, str]] | None = None
    score: Callable[[Sequence[Instance]], float | None] = mean
    lowers: Literal["satisfaction", "geometry"] = "satisfaction"
    void: Literal["faulty", "unusable"] = "faulty"
    chemical: bool = True
    looks_at: LooksAt | None = None


@dataclass(frozen=True)
class DriveRule:
    """Drives of the robot that must be possible; each infeasible one is a hard violation.

    Attributes:
        name: short name. metric: field of the report that holds the share of feasible drives.
        requires: the requirement in one sentence.
        source: the standard or guide that it comes from.
        legs: returns the drives of a layout for the protocol that it is assessed for.
        radius: of the disc for which a path must exist, meters.
    """

    name: str
    metric: str
    requires: str
    source: str
    legs: Callable[[Site], list[Leg]]
    radius: float = PLANNING_RADIUS


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


@dataclass(frozen=True)
class Breach:
    """One way in which a layout breaks a facility rule.

    Attributes:
        ids: placements that take part; the first is the object that the rule is about.
        value: what was measured, meters or a count; None if there is nothing to measure.
        limit: the limit for this object, in the same unit.
        message: what is wrong, the value and the limit. remedy: what to do.
        source, severity: if they differ from those of the rule.
    """

    ids: tuple[str, ...]
    value: float | None
    limit: float
    message: str
    remedy: str
    source: str | None = None
    severity: Severity | None = None


@dataclass(frozen=True)
class FacilityRule:
    """A rule on a laboratory's building, on where its furniture stands, or on what it holds.

    Attributes:
        name: short name, as in reports.
        requires: the requirement in one sentence.
        limit: the threshold in words, with its unit.
        source: the standard or guide that the rule comes from.
        count: returns the number of objects that the rule applies to.
        check: returns the findings.
        severity: the most severe of its findings; an `error` of a hard rule counts in v(L).
        group: `building` rules are not cured by moving objects; errors of `placing` rules are part of the cost that the
            optimizer minimizes; `safety` rules concern what a laboratory holds.
        ways: whether it plans ways of people; such rules are applied with navigation only.
        per_object: whether the score counts the objects (the first ids of findings) or the findings, for rules about
            doors, exits and rooms.
        scores_warnings: whether findings of severity `warning` count in the score of a rule of severity `error`.
        term: name of a term that counts the same faults in v(L).
        broken: returns the ids of the errors without their messages, where that is much faster.
        looks_at: what the rule looks at (`StateChanges.concern`); None for everything.
    """

    name: str
    requires: str
    limit: str
    source: str
    count: Callable[[Site], int]
    check: Callable[[Site], Iterable[Breach]]
    severity: Severity = "error"
    group: Literal["building", "placing", "safety"] = "safety"
    ways: bool = False
    per_object: bool = True
    scores_warnings: bool = True
    term: str = ""
    broken: Callable[[Site], list[tuple[str, ...]]] | None = None
    looks_at: LooksAt | None = None

    def issues(self, site: Site) -> list[FacilityIssue]:
        """Return the issues of a layout."""
        return [
            FacilityIssue(
                rule=self.name,
                ids=finding.ids,
                value=finding.value,
                limit=finding.limit,
                message=f"{finding.message}: {finding.remedy}",
                source=finding.source or self.source,
                severity=finding.severity or self.severity,
            )
            for finding in self.check(site)
        ]

    def share(self, site: Site, issues: Iterable[FacilityIssue]) -> float | None:
        """Return the share of the objects it applies to that keep the rule, None if it applies to none.

        Several issues of one object count once; an issue without ids counts as one object.
        """
        count = self.count(site)
        if not count:
            return None
        counted = [issue for issue in issues if self.scores_warnings or issue.severity == self.severity]
        broken = len({issue.ids[:1] or issue.message for issue in counted}) if self.per_object else len(counted)
        return 1.0 - min(broken / count, 1.0)


def facility_figures(assessment: Assessment) -> dict[str, Any]:
    """Return the mean over the facility rules, the share of objects that keep each, and the number of hard errors."""
    return {
        "facility": assessment.facility_score,
        "facility_rules": assessment.facility,
        "hard_facility": len(assessment.hard_issues),
    }
