"""An evaluation of any suite: driven, or read from its folder, with every figure computed from the rows."""

from __future__ import annotations

import json
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar, Generic, Self, TypeVar

from labgym.documents import read_json
from labgym.errors import DocumentError
from labgym.eval.driving.drive import Route
from labgym.eval.driving.episode_row import EpisodeRow, TransitionRow
from labgym.eval.driving.files import (
    EPISODES,
    ROUTES,
    SUMMARY,
    TIMES,
    EpisodeRoute,
    EpisodeTime,
    Lines,
    parse_lines,
    read_lines,
    short_name,
)
from labgym.eval.driving.intervals import Estimate
from labgym.eval.driving.navigation_metrics import planning_time
from labgym.eval.driving.record import EvaluationSummary, NavigationSummary
from labgym.layouts import Layout
from labgym.runs import RunProvenance, code_digest
from labgym.runs.identity import IDENTITY_FILE, RunIdentity
from labgym.runs.manifest import RunManifest, file_digest
from labgym.runs.provenance import PROVENANCE_FILE

UNFINISHED = "the evaluation is not finished; run the same labgym eval command again"
KINDS = ("eval", "labnav")
"""Kinds of the runs of `labgym eval`: of transitions and of LabNav."""
S = TypeVar("S", bound=EvaluationSummary)
R = TypeVar("R", bound=EpisodeRow)


@dataclass(frozen=True)
class Evaluation(ABC, Generic[S, R]):
    """One policy's evaluation.

    Attributes:
        folder: path of its folder; empty if it wrote nothing.
        name: name of the policy in tables.
        summary: the summary, every figure computed from the rows.
        rows, routes, times: by the suite's order; routes and measured times by the row's key.
        identity: the run; None if it wrote nothing, or if `run.json` is missing.
        provenance: versions, commit and machine of each session.
        problems: contradictions between the files of the folder, one sentence each.
    """

    KIND: ClassVar[str]
    SUMMARY: ClassVar[type[EvaluationSummary]]
    ROW: ClassVar[type[EpisodeRow]]

    folder: Path
    name: str
    summary: S
    rows: tuple[R, ...]
    routes: dict[str, Route]
    times: dict[str, EpisodeTime]
    identity: RunIdentity | None = None
    provenance: tuple[RunProvenance, ...] = ()
    problems: tuple[str, ...] = ()

    @classmethod
    def of(cls, content: Mapping[str, bytes], summary: Callable[[tuple[R, ...]], S], folder: Path) -> Self:
        """Return an evaluation that was driven.

        Args:
            content: of rows, routes and times by the file's name. summary: returns the summary of the rows.
            folder: where it was written.
        """
        rows: Any = tuple(parse_lines(EPISODES, content[EPISODES], cls.ROW).values())
        own = summary(rows)
        routes = parse_lines(ROUTES, content[ROUTES], EpisodeRoute)
        times = parse_lines(TIMES, content[TIMES], EpisodeTime)
        return cls(folder, short_name(own.policy), own, rows, _poses(routes), times)

    @classmethod
    def read(cls, folder: str | Path) -> Self:
        """Read the folder of an evaluation.

        Raises:
            DocumentError: the evaluation is not finished, or its summary cannot be read.
        """
        folder = Path(folder)
        if is_unfinished(folder):
            raise DocumentError(folder, "", UNFINISHED)
        summary: Any = cls.SUMMARY.load(folder / SUMMARY)
        rows: Lines[Any] = read_lines(folder / EPISODES, cls.ROW)
        routes, times = read_lines(folder / ROUTES, EpisodeRoute), read_lines(folder / TIMES, EpisodeTime)
        records = tuple(rows.records.values())
        identity = identity_of(folder)
        recomputed = summary.recomputed(records)
        differing = summary.differences(recomputed, exactly=identity is not None and identity.code == code_digest())
        problems = [*changed_files(folder), *rows.problems, *routes.problems, *times.problems]
        if differing:
            words = f"{SUMMARY} does not match the rows in {in_one_line(differing)}"
            problems.insert(0, f"{words}; the figures shown are computed from the rows")
        problems += recomputed.incomplete(records)
        others = {row.policy for row in records} - {summary.policy}
        if others:
            problems.append(f"{EPISODES} has rows of other policies: {in_one_line(sorted(others)[:5])}")
        unequal = len(rows.records.keys() ^ routes.records.keys())
        if unequal:
            problems.append(f"rows without a route, or routes without a row: {unequal}")
        return cls(
            folder=folder,
            name=short_name(summary.policy),
            summary=recomputed,
            rows=records,
            routes=_poses(routes.records),
            times=times.records,
            identity=identity,
            provenance=sessions_of(folder),
            problems=tuple(f"{folder}: {problem}" for problem in problems),
        )

    def named(self, name: str) -> Self:
        """Return the evaluation under another name."""
        return replace(self, name=name)

    @property
    def origin(self) -> str:
        """Number of episodes, seed and code, in words."""
        code = "unknown" if self.identity is None else self.identity.code[:12]
        return f"{len(self.rows)} episodes, seed {self.summary.seed}, code {code}"

    @property
    def commit(self) -> str:
        """Commit of the last session, in words; "" without sessions."""
        if not self.provenance:
            return ""
        last = self.provenance[-1]
        return f"{last.commit or 'not a checkout'}{' with changes' if last.dirty else ''}"

    @property
    @abstractmethod
    def metrics(self) -> Mapping[str, Estimate]:
        """The figures by name."""

    def __getitem__(self, metric: str) -> float | None:
        """Return a metric's value, or None if it applies to no episode."""
        return self.metrics[metric].value


@dataclass(frozen=True)
class TransitionEvaluation(Evaluation[NavigationSummary, TransitionRow]):
    """The evaluation of a policy on transitions, such as those of lab30."""

    KIND = KINDS[0]
    SUMMARY = NavigationSummary
    ROW = TransitionRow

    def in_layout(self, layout: Layout) -> tuple[TransitionRow, ...]:
        """Return the episodes in a layout, if it is the layout that was driven in."""
        return tuple(row for row in self.rows if row.layout == layout.id and row.layout_hash == layout.hash)

    @cached_property
    def metrics(self) -> dict[str, Estimate]:
        """Metrics of the rows, and the planning time if it was measured."""
        times = {key: time.planning_ms for key, time in self.times.items()}
        return {**self.summary.metrics, **({"planning_ms": planning_time(times)} if times else {})}


def is_unfinished(folder: Path) -> bool:
    """Return whether a folder holds an evaluation that was interrupted."""
    if not (folder / IDENTITY_FILE).is_file() or (folder / SUMMARY).exists():
        return False
    try:
        data = read_json(folder / IDENTITY_FILE)
    except DocumentError:
        return False
    return isinstance(data, dict) and data.get("kind") in KINDS


def in_one_line(metrics: Iterable[str]) -> str:
    """Return the names of metrics, separated by commas; a name from a file may hold control characters."""
    return ", ".join(name if name.isprintable() else repr(name) for name in metrics)


def _poses(routes: Mapping[str, EpisodeRoute]) -> dict[str, Route]:
    return {key: route.poses for key, route in routes.items()}


def changed_files(folder: Path) -> list[str]:
    """Return a sentence for each file whose hash is not that of the manifest."""
    try:
        manifest = RunManifest.read(folder)
    except DocumentError as error:
        return [f"manifest.json cannot be read ({error})"]
    if manifest is None:
        return ["manifest.json is missing, so that the files cannot be checked"]
    changed = [name for name, digest in manifest.files.items() if file_digest(folder / name) != digest]
    return [f"{', '.join(changed)}: not as the run wrote it, by its hash in manifest.json"] if changed else []


def identity_of(folder: Path) -> RunIdentity | None:
    """Return the identity of the run in a folder; None if it is missing or broken."""
    try:
        return RunIdentity.load(folder / IDENTITY_FILE)
    except DocumentError:
        return None


def sessions_of(folder: Path) -> tuple[RunProvenance, ...]:
    """Return versions, commit and machine of each session of the run in a folder."""
    path = folder / PROVENANCE_FILE
    sessions = []
    for line in path.read_text(encoding="utf-8", errors="replace").splitlines() if path.is_file() else ():
        try:
            sessions.append(RunProvenance.model_validate(json.loads(line)))
        except ValueError:
            continue
    return tuple(sessions)
