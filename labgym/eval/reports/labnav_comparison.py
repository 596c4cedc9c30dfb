"""Comparison of two LabNav evaluations: paired differences of scores over the episodes that both drove."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import ClassVar

from labgym.documents import Document, Record
from labgym.errors import OptionError
from labgym.eval.driving.episode_row import LabNavRow
from labgym.eval.driving.intervals import estimate_text
from labgym.eval.driving.paired import MetricDifference
from labgym.eval.labnav.evaluation import LabNavEvaluation
from labgym.eval.labnav.figure import paired_difference, significant
from labgym.eval.labnav.summary import DIFFICULTIES
from labgym.eval.reports.comparison import ComparedEvaluation
from labgym.eval.reports.labnav_tables import CLASSES, tasks_of
from labgym.eval.reports.results import named_apart
from labgym.table import Table, number

ALL = "all"


class LabNavDifference(Record):
    """Differences in one group of episodes.

    Attributes:
        grouping: "all", "task", or a class of difficulty such as "by_length". name: name of the group.
        score, success, contacts: differences of the mean score and of the shares of success and of episodes with a
            contact.
    """

    grouping: str
    name: str
    score: MetricDifference
    success: MetricDifference
    contacts: MetricDifference


class LabNavComparison(Document):
    """Paired comparison of two evaluations; every difference is a - b.

    Attributes:
        suites: of both. a, b: the evaluations.
        groups: the group of all shared episodes first, then by task and difficulty.
    """

    SCHEMA: ClassVar[str] = "labgym.labnav-comparison/1"

    suites: tuple[str, str]
    a: ComparedEvaluation
    b: ComparedEvaluation
    groups: tuple[LabNavDifference, ...]


def compare_labnav(folders: Sequence[str | Path]) -> tuple[LabNavComparison, tuple[str, ...]]:
    """Return the comparison of the evaluations in two folders, and contradictions in the folders.

    Raises:
        DocumentError: a folder holds no finished evaluation of LabNav.
        OptionError: not two folders, or they share no episode.
    """
    if len(folders) != 2:
        raise OptionError(f"{len(folders)} folders of LabNav; labgym compare takes two, and labgym report any number")
    a, b = named_apart([LabNavEvaluation.read(folder) for folder in folders], LabNavEvaluation.named)
    rows = {one.name: {row.key: row for row in one.rows} for one in (a, b)}
    shared = [key for key, row in rows[a.name].items() if _same(row, rows[b.name].get(key))]
    if not shared:
        raise OptionError(f"{a.folder} and {b.folder} share no episode of LabNav: drive the same suite")
    pairs = [(rows[a.name][key], rows[b.name][key]) for key in shared]
    groups = [_difference(ALL, ALL, pairs)]
    for task in tasks_of([a, b]):
        own = [pair for pair in pairs if f"{pair[0].task}-{pair[0].level}" == task]
        groups += [_difference("task", task, own)] if own else []
    for field, class_of in DIFFICULTIES.items():
        # The class is that of the first: people met depend on the drive.
        names = {pair[0].key: class_of(pair[0]) for pair in pairs}
        for name in sorted({name for name in names.values() if name is not None}):
            groups.append(_difference(field, name, [pair for pair in pairs if names[pair[0].key] == name]))
    marks = ["" if one.thinking is None else one.thinking.mark for one in (a, b)]
    sides = [ComparedEvaluation.of(one, len(shared), mark) for one, mark in zip((a, b), marks, strict=True)]
    suites = a.summary.suite, b.summary.suite
    return LabNavComparison(suites=suites, a=sides[0], b=sides[1], groups=tuple(groups)), (*a.problems, *b.problems)


def labnav_comparison_tables(comparison: LabNavComparison) -> tuple[Table, ...]:
    """Return the table of all episodes and of the tasks, then one for each class of difficulty."""
    tables = []
    names = {"task": "By task", **CLASSES}
    for grouping, title in names.items():
        groups = [one for one in comparison.groups if one.grouping in (grouping, ALL if grouping == "task" else "")]
        if len(groups) > (0 if grouping == "task" else 1):
            tables.append(_table(comparison, groups, title))
    return tuple(tables)


def _table(comparison: LabNavComparison, groups: Sequence[LabNavDifference], title: str) -> Table:
    a, b = comparison.a.name, comparison.b.name
    rows = tuple(
        (
            one.name,
            str(one.score.difference.count),
            number(one.score.a, 3),
            number(one.score.b, 3),
            estimate_text(one.score.difference, 3, "+"),
            "yes" if significant(one.score) else "no",
            estimate_text(one.success.difference, 3, "+"),
            estimate_text(one.contacts.difference, 3, "+"),
        )
        for one in groups
    )
    heads = ("", "episodes", a, b, "score", "apart", "success", "touched")
    notes = (
        "Differences of the first minus the second, with 95% intervals over floors; apart: 0 is outside.",
        *(f"{side.name} {side.mark}." for side in (comparison.a, comparison.b) if side.mark),
    )
    return Table(f"{a} - {b}: {title.lower() if title == 'By task' else title}", heads, rows, notes)


def _difference(grouping: str, name: str, pairs: Sequence[tuple[LabNavRow, LabNavRow]]) -> LabNavDifference:
    def values(side: int, field: str) -> Mapping[str, float]:
        return {pair[side].key: float(getattr(pair[side], field) > 0) for pair in pairs}

    scores = [{pair[side].key: pair[side].score for pair in pairs} for side in (0, 1)]
    return LabNavDifference(
        grouping=grouping,
        name=name,
        score=paired_difference(*scores),
        success=paired_difference(values(0, "success"), values(1, "success")),
        contacts=paired_difference(values(0, "contacts"), values(1, "contacts")),
    )


def _same(row: LabNavRow, other: LabNavRow | None) -> bool:
    """Whether two rows are of the same episode of the same version of a suite."""
    fields = ("suite", "floor_hash", "shortest", "goals")
    return other is not None and all(getattr(row, name) == getattr(other, name) for name in fields)
