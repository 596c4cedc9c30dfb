"""Comparison of two evaluations: paired differences over the shared episodes, overall and by group, and its tables."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar

from labgym.documents import Document, Record
from labgym.errors import DocumentError, OptionError, UnknownNameError
from labgym.eval.driving.episode_row import LabNavRow
from labgym.eval.driving.evaluation import Evaluation, TransitionEvaluation
from labgym.eval.driving.intervals import estimate_text
from labgym.eval.driving.paired import (
    MetricDifference,
    Pair,
    by_detour,
    by_length,
    by_protocol,
    by_task,
    differences,
    paired,
)
from labgym.eval.evaluator import read_evaluation
from labgym.eval.labnav.evaluation import LabNavEvaluation
from labgym.eval.labnav.figure import paired_difference
from labgym.eval.labnav.summary import DIFFICULTIES, class_order
from labgym.eval.reports.labnav_tables import tasks_of
from labgym.eval.reports.results import distinguished
from labgym.eval.reports.tables import NAVIGATION_ROWS
from labgym.table import Table, number

ALL = "all"
GROUPINGS = {
    ALL: "Overall",
    "task": "Task",
    "length": "Length",
    "detour": "Detour",
    "protocol": "Protocol",
    **{field: heading for field, (heading, _) in DIFFICULTIES.items()},
}
"""Groupings and their headings, in the order of the tables."""

GROUP_METRICS = (
    "success", "spl", "collision_free", "time_to_goal", "navdp_success", "navdp_spl", "navdp_time", "score", "contacts",
)  # fmt: skip
"""Metrics in the tables of groups; the document has all."""

LABNAV_ROWS = (("score", "Score", 3), ("contacts", "Touched", 3))
"""Metrics of LabNav besides success."""

_HEADINGS = {
    name: (heading.removesuffix(" ↑").removesuffix(" ↓"), digits)
    for name, heading, digits in (*NAVIGATION_ROWS, *LABNAV_ROWS)
}
Groups = Mapping[str, Mapping[str, tuple[int, int, dict[str, MetricDifference]]]]
"""Number of episodes and of layouts, and differences by metric, of each group of each grouping."""


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
    def of(cls, evaluation: Evaluation[Any, Any], shared: int) -> ComparedEvaluation:
        """Return the side of an evaluation that has `shared` episodes in common with the other."""
        thinking = evaluation.thinking if isinstance(evaluation, LabNavEvaluation) else None
        return cls(
            name=evaluation.name,
            policy=evaluation.summary.policy,
            folder=str(evaluation.folder),
            seed=evaluation.summary.seed,
            episodes=len(evaluation.rows),
            shared=shared,
            mark="" if thinking is None else thinking.mark,
        )


class GroupDifference(Record):
    """Differences in one group of episodes.

    Attributes:
        grouping: quantity by which episodes are grouped. name: name of the group.
        episodes, layouts: numbers of episodes and of layouts in the group.
        metrics: differences by name of the metric.
    """

    grouping: str
    name: str
    episodes: int
    layouts: int
    metrics: dict[str, MetricDifference]


class Comparison(Document):
    """Paired comparison of two evaluations.

    Attributes:
        suite: name and version of the suite; of two of LabNav, which may share episodes, both names.
        a, b: the evaluations; every difference is a - b.
        groups: the group of all shared episodes first, then by task, difficulty and, of transitions, protocol.
    """

    SCHEMA: ClassVar[str] = "labgym.comparison/1"

    suite: str
    a: ComparedEvaluation
    b: ComparedEvaluation
    groups: tuple[GroupDifference, ...]


def evaluation_in(folder: str | Path, policy: str | None = None) -> Evaluation[Any, Any]:
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
    evaluations = [read_evaluation(path.parent) for path in sorted(folder.glob("**/summary.json"))]
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
) -> tuple[Evaluation[Any, Any], Evaluation[Any, Any]]:
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


def compare(a: Evaluation[Any, Any], b: Evaluation[Any, Any]) -> Comparison:
    """Return the paired differences a - b over the episodes that both evaluations hold.

    Raises:
        OptionError: the suites differ, no episode is shared, or the rows of an evaluation are mixed.
    """
    if isinstance(a, TransitionEvaluation) and isinstance(b, TransitionEvaluation):
        suite, groups = a.summary.suite.label, _transition_groups(a, b)
    elif isinstance(a, LabNavEvaluation) and isinstance(b, LabNavEvaluation):
        suite, groups = " and ".join(dict.fromkeys((a.summary.suite, b.summary.suite))), _labnav_groups(a, b)
    else:
        labnav, other = (a, b) if isinstance(a, LabNavEvaluation) else (b, a)
        raise OptionError(f"{labnav.folder} is of LabNav and {other.folder} is not: compare within one suite")
    rows = tuple(
        GroupDifference(grouping=grouping, name=name, episodes=episodes, layouts=layouts, metrics=metrics)
        for grouping, classes in groups.items()
        for name, (episodes, layouts, metrics) in classes.items()
    )
    first, second = (ComparedEvaluation.of(one, rows[0].episodes) for one in (a, b))
    return Comparison(suite=suite, a=first, b=second, groups=rows)


def _transition_groups(a: TransitionEvaluation, b: TransitionEvaluation) -> Groups:
    rules = [one.summary.suite.model_dump(exclude={"layouts", "description"}) for one in (a, b)]
    differing = [name for name in rules[0] if rules[0][name] != rules[1][name]]
    if differing:
        labels = " and ".join(one.summary.suite.label for one in (a, b))
        raise OptionError(f"the evaluations are of the suites {labels}, which differ in {', '.join(differing)}")
    every = paired(a.rows, b.rows)
    groupings: dict[str, Mapping[str, Sequence[Pair]]] = {
        ALL: {ALL: every},
        "task": by_task(every),
        "length": by_length(every),
        "detour": by_detour(every),
        "protocol": by_protocol(every),
    }
    return _grouped(groupings, lambda row: row.layout_hash, lambda own: differences(own, a.summary.suite.metrics))


def _grouped(
    groupings: Mapping[str, Mapping[str, Sequence[tuple[Any, Any]]]],
    place: Callable[[Any], str],
    difference: Callable[[Sequence[tuple[Any, Any]]], dict[str, MetricDifference]],
) -> Groups:
    """Return numbers and differences of groups of pairs; `place` returns the layout of a row."""
    return {
        grouping: {
            name: (len(own), len({place(row) for row, _ in own}), difference(own)) for name, own in classes.items()
        }
        for grouping, classes in groupings.items()
    }


def _labnav_groups(a: LabNavEvaluation, b: LabNavEvaluation) -> Groups:
    theirs = {row.key: row for row in b.rows}
    pairs = [(row, theirs[row.key]) for row in a.rows if _is_same(row, theirs.get(row.key))]
    if not pairs:
        raise OptionError(f"{a.folder} and {b.folder} share no episode of LabNav: drive the same suite")
    groupings: dict[str, dict[str, list[tuple[LabNavRow, LabNavRow]]]] = {ALL: {ALL: pairs}}
    tasks = {
        name: [pair for pair in pairs if f"{pair[0].task}-{pair[0].level}" == name]
        for name in tasks_of([a.summary, b.summary])
    }
    groupings["task"] = {name: own for name, own in tasks.items() if own}
    for field, (_, class_of) in DIFFICULTIES.items():
        # The class is that of the first: people met depend on the drive.
        names = {pair[0].key: class_of(pair[0]) for pair in pairs}
        groupings[field] = {
            name: [pair for pair in pairs if names[pair[0].key] == name]
            for name in sorted({name for name in names.values() if name is not None}, key=class_order)
        }
    shown = {name: own for name, own in groupings.items() if len(own) > 1 or name in (ALL, "task")}
    return _grouped(shown, lambda row: row.floor, _labnav_differences)


def _labnav_differences(pairs: Sequence[tuple[LabNavRow, LabNavRow]]) -> dict[str, MetricDifference]:
    values: dict[str, Callable[[LabNavRow], float]] = {
        "score": lambda row: row.score,
        "success": lambda row: float(row.ending == "success"),
        "contacts": lambda row: float(row.contacts > 0),
    }
    return {
        name: paired_difference(*({pair[side].key: value(pair[side]) for pair in pairs} for side in (0, 1)))
        for name, value in values.items()
    }


def _is_same(row: LabNavRow, other: LabNavRow | None) -> bool:
    """Whether two rows are of the same episode of the same version of a suite."""
    fields = ("suite", "floor_hash", "shortest", "goals")
    return other is not None and all(getattr(row, name) == getattr(other, name) for name in fields)


def comparison_tables(comparison: Comparison) -> tuple[Table, ...]:
    """Return the table of all shared episodes, then one per grouping."""
    names = comparison.a.name, comparison.b.name
    return tuple(
        _overall(comparison, names) if grouping == ALL else _by_group(comparison, grouping, heading, names)
        for grouping, heading in GROUPINGS.items()
        if any(group.grouping == grouping for group in comparison.groups)
    )


def _overall(comparison: Comparison, names: tuple[str, str]) -> Table:
    group = comparison.groups[0]
    rows = []
    for name, metric in group.metrics.items():
        heading, digits = _HEADINGS[name]
        means = number(metric.a, digits), number(metric.b, digits)
        apart = "yes" if metric.significant else "no"
        text = estimate_text(metric.difference, digits, "+")
        rows.append((heading, *means, text, apart, str(metric.difference.count)))
    counts = f"{group.episodes} shared of {comparison.a.episodes} and {comparison.b.episodes} episodes"
    return Table(
        title=f"{names[0]} - {names[1]}, suite {comparison.suite}, {counts} in {group.layouts} layouts",
        columns=("Metric", *names, "Difference", "Apart", "Episodes"),
        rows=tuple(rows),
        notes=(
            "Differences over the same episodes, first minus second. Brackets: 95% intervals over layouts and repeats.",
            "Apart: 0 is outside the interval. Time: episodes in which both succeeded.",
            *(f"{side.name} {side.mark}." for side in (comparison.a, comparison.b) if side.mark),
        ),
    )


def _by_group(comparison: Comparison, grouping: str, heading: str, names: tuple[str, str]) -> Table:
    groups = [group for group in comparison.groups if group.grouping == grouping]
    metrics = [name for name in GROUP_METRICS if name in comparison.groups[0].metrics]
    return Table(
        title=f"{names[0]} - {names[1]}, by {heading[0].lower()}{heading[1:]}",
        columns=(heading.partition(":")[0], "Episodes", "Layouts", *(_HEADINGS[name][0] for name in metrics)),
        rows=tuple(
            (
                group.name,
                str(group.episodes),
                str(group.layouts),
                *(estimate_text(group.metrics[name].difference, _HEADINGS[name][1], "+") for name in metrics),
            )
            for group in groups
        ),
        notes=("One layout has no interval. The intervals are not adjusted for the number of groups.",),
    )
