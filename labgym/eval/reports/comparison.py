"""Comparison of two evaluations: paired differences over the shared episodes, overall and by group, and its tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import ClassVar, Literal

from labgym.documents import Document, Record
from labgym.errors import DocumentError, OptionError, UnknownNameError
from labgym.eval.driving.evaluation import TransitionEvaluation
from labgym.eval.driving.intervals import estimate_text
from labgym.eval.driving.paired import (
    TIMES,
    MetricDifference,
    Pair,
    by_detour,
    by_length,
    by_protocol,
    by_task,
    differences,
    paired,
)
from labgym.eval.labnav.evaluation import LabNavEvaluation
from labgym.eval.reports.results import distinguished
from labgym.eval.reports.tables import NAVDP_ROWS, NAVIGATION_ROWS
from labgym.table import Table, number

Grouping = Literal["all", "task", "length", "detour", "protocol"]

GROUPINGS: dict[Grouping, str] = {
    "all": "Overall",
    "task": "Task",
    "length": "Length",
    "detour": "Detour",
    "protocol": "Protocol",
}
"""Groupings and their headings, in the order of the tables."""

GROUP_METRICS = ("success", "spl", "collision_free", "time_to_goal", "navdp_success", "navdp_spl", "navdp_time")
"""Metrics in the tables of groups; the document has all."""

_HEADINGS = {name: (heading.removesuffix(" ↑").removesuffix(" ↓"), digits) for name, heading, digits in (
    *NAVIGATION_ROWS, *NAVDP_ROWS
)}  # fmt: skip


class ComparedEvaluation(Record):
    """One side of a comparison.

    Attributes:
        name: name in tables. policy: label of the policy. folder: where its rows are. seed: random seed of the
            evaluation.
        episodes: number of its rows. shared: number of those that the other side drove too.
        mark: in LabNav, of a policy that thinks longer than it declares; else "".
    """

    name: str
    policy: str
    folder: str
    seed: int
    episodes: int
    shared: int
    mark: str = ""

    @classmethod
    def of(cls, evaluation: TransitionEvaluation | LabNavEvaluation, shared: int, mark: str = "") -> ComparedEvaluation:
        """Return the side of an evaluation that has `shared` episodes in common with the other."""
        return cls(
            name=evaluation.name,
            policy=evaluation.summary.policy,
            folder=str(evaluation.folder),
            seed=evaluation.summary.seed,
            episodes=len(evaluation.rows),
            shared=shared,
            mark=mark,
        )


class GroupDifference(Record):
    """Differences in one group of episodes.

    Attributes:
        grouping: quantity by which episodes are grouped. name: name of the group.
        episodes, layouts: numbers of episodes and of layouts in the group.
        metrics: differences by name of the metric.
    """

    grouping: Grouping
    name: str
    episodes: int
    layouts: int
    metrics: dict[str, MetricDifference]


class Comparison(Document):
    """Paired comparison of two evaluations of one suite.

    Attributes:
        suite: name and version of the suite.
        a, b: the evaluations; every difference is a - b.
        groups: the group of all shared episodes first, then by task, length, detour and protocol.
    """

    SCHEMA: ClassVar[str] = "labgym.comparison/1"

    suite: str
    a: ComparedEvaluation
    b: ComparedEvaluation
    groups: tuple[GroupDifference, ...]


def evaluation_in(folder: str | Path, policy: str | None = None) -> TransitionEvaluation:
    """Return the evaluation in a folder written by `labgym eval` or `labgym run`.

    Args:
        folder: the folder.
        policy: name or label of the policy; None if the folder holds a single evaluation.

    Raises:
        DocumentError: the folder holds no evaluation, or a file is broken.
        OptionError: it holds several evaluations that fit.
        UnknownNameError: it holds no evaluation of the policy.
    """
    folder = Path(folder)
    evaluations = [TransitionEvaluation.read(path.parent) for path in sorted(folder.glob("**/summary.json"))]
    if not evaluations:
        raise DocumentError(folder, "", "holds no finished evaluation (summary.json)")
    fitting = [one for one in evaluations if policy in (None, one.summary.policy, one.name)]
    if not fitting:
        raise UnknownNameError(f"{folder}: policy", policy, {one.name for one in evaluations})
    if len(fitting) > 1:
        remedy = "name the folder of one" if policy else "name the policies (--policies A B)"
        raise OptionError(f"{folder} holds evaluations of {', '.join(one.name for one in fitting)}; {remedy}")
    return fitting[0]


def chosen_evaluations(
    folders: Sequence[str | Path], policies: Sequence[str] = ()
) -> tuple[TransitionEvaluation, TransitionEvaluation]:
    """Return the two evaluations that the arguments of `labgym compare` name, with different names in tables.

    Args:
        folders: two folders, or one that holds both evaluations.
        policies: names of both policies, one for both folders, or none if each folder holds one evaluation.

    Raises:
        DocumentError, OptionError, UnknownNameError: see `evaluation_in`; OptionError also if they do not name two.
    """
    if not 1 <= len(folders) <= 2 or len(policies) > 2 or (len(folders) == 1 and len(policies) < 2):
        raise OptionError(
            f"{len(folders)} folders and {len(policies)} policies do not name two evaluations; name two folders, or "
            "one folder and two policies (--policies A B)"
        )
    first, second = (policies[0], policies[-1]) if policies else (None, None)
    a, b = distinguished([evaluation_in(folders[0], first), evaluation_in(folders[-1], second)])
    return a, b


def compare(a: TransitionEvaluation, b: TransitionEvaluation) -> Comparison:
    """Return the paired differences a - b over the episodes that both evaluations hold.

    Raises:
        OptionError: the suites differ, no episode is shared, or the rows of an evaluation are mixed.
    """
    rules = [one.summary.suite.model_dump(exclude={"layouts", "description"}) for one in (a, b)]
    differing = [name for name in rules[0] if rules[0][name] != rules[1][name]]
    if differing:
        labels = " and ".join(one.summary.suite.label for one in (a, b))
        raise OptionError(f"the evaluations are of the suites {labels}, which differ in {', '.join(differing)}")
    pairing = paired(a.rows, b.rows)
    metrics = a.summary.suite.metrics
    groupings: dict[Grouping, Mapping[str, Sequence[Pair]]] = {
        "all": {"all": pairing.pairs},
        "task": by_task(pairing.pairs),
        "length": by_length(pairing.pairs),
        "detour": by_detour(pairing.pairs),
        "protocol": by_protocol(pairing.pairs),
    }
    groups = tuple(
        GroupDifference(
            grouping=grouping,
            name=name,
            episodes=len(pairs),
            layouts=len({row.layout_hash for row, _ in pairs}),
            metrics=differences(pairs, metrics),
        )
        for grouping, classes in groupings.items()
        for name, pairs in classes.items()
    )
    sides = (ComparedEvaluation.of(one, len(pairing.pairs)) for one in (a, b))
    return Comparison(suite=a.summary.suite.label, a=next(sides), b=next(sides), groups=groups)


def comparison_tables(comparison: Comparison) -> tuple[Table, ...]:
    """Return the table of all shared episodes, then one per grouping."""
    names = comparison.a.name, comparison.b.name
    return tuple(
        _overall(comparison, names) if grouping == "all" else _by_group(comparison, grouping, heading, names)
        for grouping, heading in GROUPINGS.items()
    )


def _overall(comparison: Comparison, names: tuple[str, str]) -> Table:
    group = comparison.groups[0]
    rows = []
    for name, metric in group.metrics.items():
        heading, digits = _HEADINGS[name]
        means = number(metric.a, digits), number(metric.b, digits)
        rows.append((heading, *means, estimate_text(metric.difference, digits, "+"), str(metric.difference.count)))
    counts = f"{group.episodes} shared of {comparison.a.episodes} and {comparison.b.episodes} episodes"
    return Table(
        title=f"{names[0]} - {names[1]}, suite {comparison.suite}, {counts} in {group.layouts} layouts",
        columns=("Metric", *names, "Difference", "Episodes"),
        rows=tuple(rows),
        notes=(
            "Differences over the same episodes, first minus second. Brackets: 95% intervals over layouts and repeats.",
            "Time: episodes in which both succeeded.",
        ),
    )


def _by_group(comparison: Comparison, grouping: Grouping, heading: str, names: tuple[str, str]) -> Table:
    groups = [group for group in comparison.groups if group.grouping == grouping]
    metrics = [name for name in GROUP_METRICS if name in comparison.groups[0].metrics]
    return Table(
        title=f"{names[0]} - {names[1]} by {heading.lower()}",
        columns=(heading, "Episodes", "Layouts", *(_HEADINGS[name][0] for name in metrics)),
        rows=tuple(
            (
                group.name,
                str(group.episodes),
                str(group.layouts),
                *(estimate_text(group.metrics[name].difference, 2 if name in TIMES else 3, "+") for name in metrics),
            )
            for group in groups
        ),
        notes=("One layout has no interval. The intervals are not adjusted for the number of groups.",),
    )
