"""An evaluation read from its folder: every figure is computed from the rows, and contradictions are reported."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

from labgym.errors import DocumentError
from labgym.eval.driving.drive import Route
from labgym.eval.driving.episode_row import EpisodeRow, Key
from labgym.eval.driving.files import (
    EPISODES,
    ROUTES,
    SUMMARY,
    TIMES,
    EpisodeRoute,
    EpisodeTime,
    read_lines,
)
from labgym.eval.driving.folders import short_name
from labgym.eval.driving.intervals import Estimate
from labgym.eval.driving.navigation_metrics import planning_time
from labgym.eval.driving.record import NavigationSummary
from labgym.layouts import Layout
from labgym.runs import RunProvenance, code_digest
from labgym.runs.identity import IDENTITY_FILE, RunIdentity
from labgym.runs.manifest import RunManifest, file_digest
from labgym.runs.provenance import PROVENANCE_FILE

COMPARED = ("episodes", "errors", "unreachable", "complete")
"""Figures of a summary that the rows must give, in addition to the metrics."""


@dataclass(frozen=True)
class Evaluation:
    """One policy's evaluation.

    Attributes:
        folder: path of its folder.
        name: name of the policy in tables.
        summary: the summary, every figure computed from the rows.
        rows, routes: by the suite's order; by episode.
        times: planning times by episode, milliseconds.
        code: digest of the code that drove.
        provenance: versions, commit and machine of each session.
        problems: contradictions between the files of the folder, one sentence each.
    """

    folder: Path
    name: str
    summary: NavigationSummary
    rows: tuple[EpisodeRow, ...]
    routes: dict[Key, Route]
    times: dict[Key, float | None]
    code: str
    provenance: tuple[RunProvenance, ...] = ()
    problems: tuple[str, ...] = ()

    @classmethod
    def read(cls, folder: str | Path) -> Evaluation:
        """Read the folder of an evaluation.

        Raises:
            DocumentError: the folder has no summary, or the summary cannot be read.
        """
        folder = Path(folder)
        summary = NavigationSummary.load(folder / SUMMARY)
        rows = read_lines(folder / EPISODES, EpisodeRow)
        routes = read_lines(folder / ROUTES, EpisodeRoute)
        times = read_lines(folder / TIMES, EpisodeTime)
        identity = identity_of(folder)
        code = identity.code if identity is not None else ""
        recomputed = summary.recomputed(tuple(rows.records.values()))
        differing = summary_differences(summary, recomputed, exactly=code == code_digest())
        problems = [*_mismatch(differing), *changed_files(folder), *rows.problems, *routes.problems, *times.problems]
        problems += _incomplete(recomputed, rows.records, routes.records)
        return cls(
            folder=folder,
            name=short_name(summary.policy),
            summary=recomputed,
            rows=tuple(rows.records.values()),
            routes={key: route.poses for key, route in routes.records.items()},
            times={key: time.planning_ms for key, time in times.records.items()},
            code=code,
            provenance=sessions_of(folder),
            problems=located(folder, problems),
        )

    def named(self, name: str) -> Evaluation:
        """Return the evaluation under another name."""
        return replace(self, name=name)

    def of(self, layout: Layout) -> tuple[EpisodeRow, ...]:
        """Return the episodes in a layout, if it is the layout that was driven in."""
        return tuple(row for row in self.rows if row.layout == layout.id and row.layout_hash == layout.hash)

    @cached_property
    def metrics(self) -> dict[str, Estimate]:
        """Metrics of the rows, and the planning time if it was measured."""
        return with_planning(self.summary.metrics, self.times)


def with_planning(metrics: Mapping[str, Estimate], times: Mapping[Key, float | None]) -> dict[str, Estimate]:
    """Return metrics, and if there are planning times also their mean."""
    return {**metrics, "planning_ms": planning_time(times)} if times else dict(metrics)


def summary_differences(summary: NavigationSummary, recomputed: NavigationSummary, exactly: bool) -> list[str]:
    """Return the figures in which two summaries differ.

    Args:
        exactly: whether the same code computed both, so that intervals are equal too.
    """
    names = [name for name in COMPARED if getattr(summary, name) != getattr(recomputed, name)]
    metrics = {**recomputed.metrics, **summary.metrics}
    return names + [
        name for name in metrics if not _agree(summary.metrics.get(name), recomputed.metrics.get(name), exactly)
    ]


def _agree(one: Estimate | None, other: Estimate | None, exactly: bool) -> bool:
    if one is None or other is None:
        return not exactly  # another version has other metrics
    if exactly:
        return one == other
    counts = (one.count, one.nulls) == (other.count, other.nulls)
    if one.value is None or other.value is None:
        return counts and one.value is other.value
    return counts and abs(one.value - other.value) <= 1e-9 * max(1.0, abs(other.value))


def _mismatch(names: Iterable[str]) -> list[str]:
    names = list(names)
    if not names:
        return []
    return [f"{SUMMARY} does not match the rows in {in_one_line(names)}; the figures shown are computed from the rows"]


def in_one_line(metrics: Iterable[str]) -> str:
    """Return the names of metrics, separated by commas; a name from a file may hold control characters."""
    return ", ".join(name if name.isprintable() else repr(name) for name in metrics)


def _incomplete(
    summary: NavigationSummary, rows: Mapping[Key, EpisodeRow], routes: Mapping[Key, EpisodeRoute]
) -> list[str]:
    problems = []
    if not summary.complete:
        problems.append(f"{EPISODES} holds {len(rows)} of {summary.expected} episodes; the others are left out")
    foreign = {row.layout for row in rows.values() if summary.layouts.get(row.layout) != row.layout_hash}
    if foreign:
        problems.append(f"{EPISODES} has rows of layouts that are not in {SUMMARY}: {', '.join(sorted(foreign)[:5])}")
    others = {row.policy for row in rows.values()} - {summary.policy}
    if others:
        problems.append(f"{EPISODES} has rows of other policies: {', '.join(sorted(others)[:5])}")
    unequal = sum(key not in routes for key in rows) + sum(key not in rows for key in routes)
    if unequal:
        problems.append(f"rows without a route, or routes without a row: {unequal}")
    return problems


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


def located(folder: Path, problems: Iterable[str]) -> tuple[str, ...]:
    """Return sentences about the files of a folder, each with the folder's name."""
    return tuple(f"{folder}: {problem}" for problem in problems)
