"""The evaluator: drives a policy over every goal pair of every layout of a suite."""

from __future__ import annotations

import contextlib
import inspect
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from tqdm import tqdm

from labgym.documents import canonical_hash
from labgym.errors import LabgymError, OptionError
from labgym.eval.driving.assignments import episode_keys
from labgym.eval.driving.drive import Drive, Route
from labgym.eval.driving.episode_row import EpisodeRow, Key
from labgym.eval.driving.navigation_metrics import VERSION, summarise
from labgym.eval.driving.record import EvaluationIdentity, EvaluationProvenance, NavigationSummary, provenance
from labgym.eval.driving.run_folder import RunFolder
from labgym.eval.driving.suites import Jitter, Suite, load_suite, suite_of
from labgym.eval.driving.workers import Job, run_jobs
from labgym.layouts import Layout
from labgym.policies import Policy
from labgym.policies.fingerprint.sources import module_file
from labgym.policies.policy import Driver, Sensors
from labgym.policies.process import PolicyProcess, PolicySource, ProcessLimits, close_shared_process, shared_process
from labgym.policies.registry import is_class_place


@dataclass(frozen=True)
class NavigationReport:
    """The result of an evaluation.

    Attributes:
        summary: metrics with intervals, and the record of the evaluation; `summary.json`.
        rows: episodes in the suite's order; `episodes.jsonl`.
        routes: poses (x, y, yaw) of the robot in meters and radians, by layout id, pair and repeat; `routes.jsonl`.
    """

    summary: NavigationSummary
    rows: tuple[EpisodeRow, ...]
    routes: dict[Key, Route]

    def __getitem__(self, metric: str) -> float | None:
        """Return a metric's value, or None if it applies to no episode."""
        return self.summary.metrics[metric].value


def evaluate(
    policy: str | Policy,
    suite: str | Path | Suite | Sequence[Layout] = "test",
    workers: int = 1,
    out: str | Path | None = None,
    seed: int = 0,
    progress: bool = True,
    options: dict[str, Any] | None = None,
    overwrite: bool = False,
    repeats: int | None = None,
    jitter: Jitter | None = None,
    isolated: bool = True,
    limits: ProcessLimits | None = None,
) -> NavigationReport:
    """Drive every goal pair of every layout of a suite, each as often as the suite says, and return the results.

    The policy runs in a process of its own, and each episode in a fresh copy of it: the object that is passed does not
    change. Apart from the measured planning time, the results do not depend on the number of workers.

    Args:
        policy: a name for `make_policy`, or a policy, which is copied in its present state.
        suite: name of a suite, path of a suite's .json file, a `Suite`, or layouts, each with its protocol.
        workers: number of processes, each of which drives one layout at a time; 1 stays in this process.
        out: folder for `run.json`, `episodes.jsonl`, `routes.jsonl`, `summary.json`, and for layouts passed by hand,
            `layouts/`. Episodes are written layout by layout, and an interrupted evaluation resumes. None writes
            nothing.
        seed: random seed of the policy and of the intervals.
        progress: whether to show a progress bar.
        options: arguments for `make_policy`.
        overwrite: replace the results in `out` if they belong to another evaluation or to other code.
        repeats: number of episodes per goal pair; None takes the suite's.
        jitter: displacement of every start; None takes the suite's.
        isolated: False drives the policy in this process, for debugging, with one worker: it then remembers earlier
            episodes, and its errors are not contained.
        limits: limits of time and memory of the policy's process.

    Raises:
        UnknownNameError: the suite or the policy does not exist.
        OptionError: an option is out of range, or the folder holds another evaluation.
        LabgymError: two layouts have the same id, a layout has no protocol, or a worker died.
    """
    _check_at_least("workers", workers, 1)
    _check_at_least("seed", seed, 0)
    # The policy is copied before the layouts are read, so that its code cannot put them into the copy.
    source = _source(policy, dict(options or {}))
    suite, layouts = _resolved(suite)
    suite = suite.repeated(repeats, jitter)
    with _driver(policy, source, limits, workers, isolated) as driver:
        label = source.name if isinstance(policy, str) and not is_class_place(policy) else driver.name
        if driver.exclusive and workers > 1:
            raise OptionError(f"policy {label!r} drives one robot at a time; use workers=1, not {workers}")
        arguments = {"workers": workers, "progress": progress, "isolated": isolated}
        record = provenance([*_module_files(policy), *driver.files()])
        run = _Run(
            source, label, limits, suite, layouts, seed, driver.privileged, driver.observation, record, arguments
        )
        folder = RunFolder(None if out is None else Path(out), run.identity, overwrite)
        done = folder.resume(run.expected)
        if out is not None and suite.split is None:
            for layout in layouts:
                layout.save(Path(out) / "layouts" / f"{layout.id}.json")
        if workers > 1:
            close_shared_process()
        try:
            run.drive(done, folder, workers, progress, None if isolated else driver)
        finally:
            # Also after Ctrl-C or an error: the finished episodes are then in order, the summary is not complete.
            report = run.report(done)
            folder.finish(report.summary, done)
    return report


@dataclass(frozen=True)
class _Run:
    """An evaluation: its arguments, its episodes and its report."""

    source: PolicySource
    label: str
    limits: ProcessLimits | None
    suite: Suite
    layouts: tuple[Layout, ...]
    seed: int
    privileged: bool
    sensors: Sensors
    provenance: EvaluationProvenance
    arguments: dict[str, Any]

    @cached_property
    def expected(self) -> dict[str, tuple[str, tuple[Key, ...]]]:
        """Hash and episodes of each layout by id."""
        return {layout.id: (layout.hash, episode_keys(layout, self.suite)) for layout in self.layouts}

    @property
    def identity(self) -> EvaluationIdentity:
        """Identity of the evaluation stored in its folder."""
        return EvaluationIdentity(
            suite=self.suite,
            policy=self.label,
            options=self.source.options,
            seed=self.seed,
            code=self.provenance.code,
            catalog=canonical_hash(sorted({layout.catalog.digest for layout in self.layouts})),
        )

    def drive(
        self, done: dict[Key, Drive], folder: RunFolder, workers: int, progress: bool, driver: Driver | None
    ) -> None:
        """Drive the remaining episodes and add them to `done`, layout by layout."""
        total = sum(len(keys) for _, keys in self.expected.values())
        jobs = [
            Job(self.source, self.label, layout, self.suite, self.seed, self.limits)
            for layout in self.layouts
            if any(key not in done for key in self.expected[layout.id][1])
        ]
        with tqdm(total=total, initial=len(done), desc=self.label, unit="ep", disable=not progress) as bar:
            for _, drives in run_jobs(jobs, workers, driver):
                done.update({drive.row.key: drive for drive in drives})
                folder.append(drives)
                bar.update(len(drives))

    def report(self, done: dict[Key, Drive]) -> NavigationReport:
        """Return the report on the finished episodes."""
        keys = [key for _, layout_keys in self.expected.values() for key in layout_keys]
        drives = [done[key] for key in keys if key in done]
        rows = tuple(drive.row for drive in drives)
        summary = NavigationSummary(
            suite=self.suite,
            policy=self.label,
            options=self.source.options,
            privileged=self.privileged,
            sensors=self.sensors,
            seed=self.seed,
            layouts={layout: digest for layout, (digest, _) in self.expected.items()},
            episodes=len(rows),
            expected=len(keys),
            errors=sum(row.error is not None for row in rows),
            unreachable=sum(row.shortest_path_length is None for row in rows),
            complete=len(rows) == len(keys),
            metrics=summarise(rows, self.suite.metrics),
            definitions=VERSION,
            arguments=self.arguments,
            provenance=self.provenance,
        )
        return NavigationReport(summary, rows, {drive.row.key: drive.route for drive in drives})


def _resolved(suite: str | Path | Suite | Sequence[Layout]) -> tuple[Suite, tuple[Layout, ...]]:
    if isinstance(suite, str | Path):
        suite = load_suite(suite)
    if isinstance(suite, Suite):
        return suite, suite.load_layouts()
    layouts = tuple(suite)
    ids = [layout.id for layout in layouts]
    repeated = sorted({name for name in ids if ids.count(name) > 1})
    if repeated or not layouts:
        problem = f"two layouts have the id {repeated[0]!r}" if repeated else "no layouts to drive in"
        raise LabgymError(f"{problem}; an evaluation needs at least one layout, and ids must be unique")
    return suite_of(layouts), layouts


def _source(policy: str | Policy, options: dict[str, Any]) -> PolicySource:
    if isinstance(policy, Policy):
        if options:
            raise OptionError(f"options {sorted(options)} need a policy named by a string; a policy object takes none")
        return PolicySource.copied(policy)
    if not isinstance(policy, str):
        got = type(policy).__name__
        raise OptionError(
            f"policy: expected a name or a labgym.policies.Policy, got {got}; derive its class from Policy"
        )
    return PolicySource.named(policy, options)


@contextlib.contextmanager
def _driver(
    policy: str | Policy, source: PolicySource, limits: ProcessLimits | None, workers: int, isolated: bool
) -> Iterator[Policy | PolicyProcess]:
    """Open the policy in a process of its own or, not isolated, in this one, and close it at the end."""
    if isolated:
        try:
            yield shared_process(source, limits)
        finally:
            close_shared_process()
        return
    if workers > 1:
        raise OptionError(f"isolated=False drives in this process; use workers=1, not {workers}")
    driver = policy if isinstance(policy, Policy) else source.make()
    try:
        yield driver
    finally:
        if driver is not policy:
            driver.close()


def _module_files(policy: str | Policy) -> tuple[Path, ...]:
    """Return the file of the policy's module, if it has one."""
    if isinstance(policy, Policy):
        with contextlib.suppress(TypeError, OSError):
            return (Path(inspect.getfile(type(policy))),)
    elif is_class_place(policy):
        file = module_file(policy.partition(":")[0])
        return () if file is None else (file,)
    return ()


def _check_at_least(name: str, value: object, least: int) -> None:
    if isinstance(value, bool) or not isinstance(value, int) or value < least:
        raise OptionError(f"{name} is {value!r}, expected a whole number of at least {least}")
