"""The evaluator: a policy over a suite, every goal pair of every layout once."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tqdm import tqdm

from labgym.errors import LabgymError, OptionError
from labgym.eval.drive import Drive, Key, Route
from labgym.eval.episode_row import EpisodeRow
from labgym.eval.navigation_metrics import summarise
from labgym.eval.record import NavigationSummary, Provenance, RunIdentity, provenance
from labgym.eval.run_folder import RunFolder
from labgym.eval.suites import Suite, load_suite, suite_of
from labgym.eval.workers import Job, PolicySource, run_jobs
from labgym.layouts import Layout
from labgym.navigation import goal_pairs
from labgym.policies import Policy


@dataclass(frozen=True)
class NavigationReport:
    """The result of an evaluation.

    Attributes:
        summary: metrics with intervals, and the record of the run; `summary.json`.
        rows: episodes in the suite's order; `episodes.jsonl`.
        routes: the poses that the robot went through, by layout id and pair; `routes.jsonl`.
    """

    summary: NavigationSummary
    rows: tuple[EpisodeRow, ...]
    routes: dict[Key, Route]

    def __getitem__(self, metric: str) -> float | None:
        """Return a metric's value; None where it applies to no episode."""
        return self.summary.metrics[metric].value


def evaluate(
    policy: str | Policy,
    suite: str | Path | Suite | Sequence[Layout] = "test",
    workers: int = 1,
    out: str | Path | None = None,
    seed: int = 0,
    progress: bool = True,
    options: dict[str, Any] | None = None,
) -> NavigationReport:
    """Drive every goal pair of every layout of a suite once.

    The numbers are the same with any number of workers, the measured planning time aside.

    Args:
        policy: a name for `make_policy`, or a policy. With several workers an object is copied to each.
        suite: name of a suite, path of one (`.json`), a `Suite`, or layouts, each with its protocol.
        workers: processes, each of which takes a layout at a time; 1 stays in this process.
        out: folder for `run.json`, `episodes.jsonl`, `routes.jsonl` and `summary.json`. Episodes are written layout by
            layout; a run that was stopped goes on where it was. None writes nothing.
        seed: of everything random in the policy, and of the intervals.
        progress: whether to show a progress bar.
        options: arguments for `make_policy`.

    Raises:
        UnknownNameError: the suite or the policy does not exist.
        OptionError: an option is not what it may be, or the folder holds another run.
        LabgymError: two layouts have one id, a layout has no protocol, or a worker died.
    """
    if isinstance(workers, bool) or not isinstance(workers, int) or workers < 1:
        raise OptionError(f"workers is {workers!r}, expected a whole number of at least 1")
    suite, layouts = _resolved(suite)
    source = _source(policy, dict(options or {}))
    made = source.make()
    record = provenance(made)
    identity = RunIdentity(suite=suite, policy=source.label, options=source.options, seed=seed, code=record.code)
    folder = RunFolder(None if out is None else Path(out), identity)
    run = _Run(source, suite, layouts, seed, made.privileged, record, {"workers": workers, "progress": progress})
    if source.instance is None:
        made.close()
    done = folder.resume(run.expected)
    try:
        run.drive(done, folder, workers, progress)
    except BaseException:
        folder.finish(run.report(done).summary, done)
        raise
    report = run.report(done)
    folder.finish(report.summary, done)
    return report


class _Run:
    """What is to be driven, and the report on what was."""

    def __init__(
        self,
        source: PolicySource,
        suite: Suite,
        layouts: tuple[Layout, ...],
        seed: int,
        privileged: bool,
        record: Provenance,
        arguments: dict[str, Any],
    ) -> None:
        self._source, self._suite, self._layouts, self._seed = source, suite, layouts, seed
        self._privileged, self._record, self._arguments = privileged, record, arguments
        self.expected: dict[str, tuple[str, int]] = {
            layout.id: (layout.hash, len(goal_pairs(layout))) for layout in layouts
        }

    def drive(self, done: dict[Key, Drive], folder: RunFolder, workers: int, progress: bool) -> None:
        """Drive what is not done, adding to it layout by layout."""
        total = sum(count for _, count in self.expected.values())
        jobs = [
            Job(self._source, layout, self._suite, self._seed)
            for layout in self._layouts
            if any((layout.id, pair) not in done for pair in range(self.expected[layout.id][1]))
        ]
        with tqdm(total=total, initial=len(done), desc=self._source.label, unit="ep", disable=not progress) as bar:
            for _, drives in run_jobs(jobs, workers):
                done.update({drive.row.key: drive for drive in drives})
                folder.append(drives)
                bar.update(len(drives))

    def report(self, done: dict[Key, Drive]) -> NavigationReport:
        """Return the report on what is done."""
        keys = [(layout, pair) for layout, (_, count) in self.expected.items() for pair in range(count)]
        drives = [done[key] for key in keys if key in done]
        rows = tuple(drive.row for drive in drives)
        summary = NavigationSummary(
            suite=self._suite,
            policy=self._source.label,
            options=self._source.options,
            privileged=self._privileged,
            seed=self._seed,
            layouts={layout: digest for layout, (digest, _) in self.expected.items()},
            episodes=len(rows),
            expected=len(keys),
            errors=sum(row.error is not None for row in rows),
            unreachable=sum(row.shortest_path_length is None for row in rows),
            complete=len(rows) == len(keys),
            metrics=summarise(rows, self._seed),
            arguments=self._arguments,
            provenance=self._record,
        )
        return NavigationReport(summary, rows, {drive.row.key: drive.route for drive in drives})


def _resolved(suite: str | Path | Suite | Sequence[Layout]) -> tuple[Suite, tuple[Layout, ...]]:
    if isinstance(suite, str | Path):
        suite = load_suite(suite)
    if isinstance(suite, Suite):
        return suite, suite.load_layouts()
    layouts = tuple(suite)
    ids = [layout.id for layout in layouts]
    twice = sorted({name for name in ids if ids.count(name) > 1})
    if twice or not layouts:
        problem = f"two layouts are called {twice[0]!r}" if twice else "no layouts are given"
        raise LabgymError(f"{problem}; an evaluation needs at least one layout, each with an id of its own")
    return suite_of(layouts), layouts


def _source(policy: str | Policy, options: dict[str, Any]) -> PolicySource:
    if isinstance(policy, Policy):
        if options:
            raise OptionError(f"options {sorted(options)} are for a policy by name; this one is made already")
        return PolicySource(policy.name, {}, policy)
    try:
        return PolicySource(policy, json.loads(json.dumps(options)))
    except TypeError as error:
        raise OptionError(f"options of policy {policy!r} must be plain JSON data: {error}") from error
