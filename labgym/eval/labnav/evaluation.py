"""An evaluation of LabNav read from its folder: every figure is computed from the rows."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from labgym.documents import read_json
from labgym.errors import DocumentError, OptionError, UnknownNameError
from labgym.eval.driving.drive import Route
from labgym.eval.driving.evaluation import changed_files, identity_of, in_one_line, located, sessions_of
from labgym.eval.driving.files import EPISODES, ROUTES, SUMMARY, TIMES, read_lines
from labgym.eval.driving.folders import short_name
from labgym.eval.labnav.row import LabNavRoute, LabNavRow, LabNavTime
from labgym.eval.labnav.summary import LabNavSummary, TaskSummary
from labgym.eval.labnav.thinking import Thinking
from labgym.runs import RunProvenance
from labgym.runs.identity import IDENTITY_FILE, RunIdentity

KIND = "labnav"
"""Kind of the runs of `labgym eval --suite labnav-...`."""
UNFINISHED = "the evaluation is not finished; run the same labgym eval command again"
NEARLY = 1e-9
"""Difference of figures that versions of a mathematics library may cause."""


@dataclass(frozen=True)
class LabNavEvaluation:
    """The evaluation of a policy on a suite of LabNav.

    Attributes:
        folder: path of its folder. name: name of the policy in tables.
        summary: every figure computed from the rows.
        rows, routes, times: of the episodes, in the order of the files; routes and times by the row's key.
        identity: the run; None if `run.json` is missing. provenance: versions, commit and machine of each session.
        problems: contradictions between the files of the folder, one sentence each.
    """

    folder: Path
    name: str
    summary: LabNavSummary
    rows: tuple[LabNavRow, ...]
    routes: dict[str, Route]
    times: dict[str, LabNavTime]
    identity: RunIdentity | None
    provenance: tuple[RunProvenance, ...] = ()
    problems: tuple[str, ...] = ()

    @classmethod
    def read(cls, folder: str | Path) -> LabNavEvaluation:
        """Read the folder of an evaluation.

        Raises:
            DocumentError: the evaluation is not finished, or its summary cannot be read.
        """
        folder = Path(folder)
        if not (folder / SUMMARY).is_file() and is_labnav_run(folder):
            raise DocumentError(folder, "", UNFINISHED)
        summary = LabNavSummary.load(folder / SUMMARY)
        rows = read_lines(folder / EPISODES, LabNavRow)
        routes = read_lines(folder / ROUTES, LabNavRoute)
        times = read_lines(folder / TIMES, LabNavTime)
        records = tuple(rows.records.values())
        recomputed = summary.recomputed(records)
        problems = [*changed_files(folder), *rows.problems, *routes.problems, *times.problems]
        differing = summary_differences(summary, recomputed)
        if differing:
            words = f"{SUMMARY} does not match the rows in {in_one_line(differing)}"
            problems.insert(0, f"{words}; the figures shown are computed from the rows")
        return cls(
            folder=folder,
            name=short_name(summary.policy),
            summary=recomputed,
            rows=records,
            routes={key: route.poses for key, route in routes.records.items()},
            times=times.records,
            identity=identity_of(folder),
            provenance=sessions_of(folder),
            problems=located(folder, [*problems, *_incomplete(recomputed, records, routes.records)]),
        )

    def named(self, name: str) -> LabNavEvaluation:
        """Return the evaluation under another name."""
        return replace(self, name=name)

    @cached_property
    def thinking(self) -> Thinking | None:
        """The measured time of the policy; None if it was not measured."""
        summary = self.summary
        declared = summary.latency if summary.declared is None else summary.declared
        return Thinking.of(self.times.values(), declared, summary.latency)

    @cached_property
    def tasks(self) -> dict[str, TaskSummary]:
        """The results by task and level, such as "aisle-2"."""
        return {f"{each.task}-{each.level}": each for each in self.summary.tasks}

    @cached_property
    def scores(self) -> dict[str, float]:
        """The scores by the rows' key."""
        return {row.key: row.score for row in self.rows}

    def row(self, key: str) -> LabNavRow:
        """Return the row of an episode by its key, such as people-2/floors-val-0003/1, or by a unique end of it.

        Raises:
            UnknownNameError: there is no such episode.
            OptionError: there are several.
        """
        fitting = [row for row in self.rows if row.key == key or row.key.endswith(f"/{key.lstrip('/')}")]
        exact = [row for row in fitting if row.key == key] or fitting
        if not exact:
            raise UnknownNameError(f"{self.folder}: episode", key, [row.key for row in self.rows])
        if len(exact) > 1:
            names = ", ".join(row.key for row in exact[:5])
            raise OptionError(f"{self.folder}: episode {key!r} is one of {names}: name its task too")
        return exact[0]


def is_labnav_run(folder: str | Path) -> bool:
    """Whether a folder holds an evaluation of LabNav, finished or not."""
    for name, field, value in ((IDENTITY_FILE, "kind", KIND), (SUMMARY, "schema", LabNavSummary.SCHEMA)):
        path = Path(folder) / name
        if path.is_file():
            try:
                data = read_json(path)
            except DocumentError:
                continue
            if isinstance(data, dict) and data.get(field) == value:
                return True
    return False


def summary_differences(summary: LabNavSummary, recomputed: LabNavSummary) -> list[str]:
    """Return the figures in which a summary differs from that of the rows."""
    names = [] if _alike(summary.labnav, recomputed.labnav) else ["labnav"]
    for one, other in zip(summary.tasks, recomputed.tasks, strict=True):
        fields = ("episodes", "errors", "score", "success", "contacts", "endings", "contact", "parked")
        unlike = [name for name in fields if not _alike(getattr(one, name), getattr(other, name))]
        names += [f"{name} of {one.task}-{one.level}" for name in unlike]
    return names


def _alike(one: Any, other: Any) -> bool:
    """Whether two figures are equal but for rounding."""
    values = [getattr(each, "value", each) for each in (one, other)]
    if all(isinstance(value, float) for value in values):
        return math.isclose(values[0], values[1], rel_tol=NEARLY, abs_tol=NEARLY)
    return bool(values[0] == values[1])


def _incomplete(summary: LabNavSummary, rows: Sequence[LabNavRow], routes: Iterable[str]) -> list[str]:
    problems = []
    counted, expected = sum(each.episodes for each in summary.tasks), sum(each.expected for each in summary.tasks)
    if counted != expected:
        problems.append(f"{EPISODES} holds {counted} of {expected} episodes; the others are left out")
    others = {row.policy for row in rows} - {summary.policy}
    if others:
        problems.append(f"{EPISODES} has rows of other policies: {in_one_line(sorted(others)[:5])}")
    foreign = len(rows) - counted
    if foreign:
        problems.append(f"{EPISODES} has {foreign} rows of tasks that are not in {SUMMARY}")
    unequal = len({row.key for row in rows} ^ set(routes))
    if unequal:
        problems.append(f"rows without a route, or routes without a row: {unequal}")
    return problems
