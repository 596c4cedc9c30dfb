"""The evaluator: drives a policy through the episodes of a suite."""

from __future__ import annotations

import contextlib
from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar, Generic, TypeVar

from labgym.assets import Catalog
from labgym.counts import MAX_SEED, whole_number
from labgym.documents import Document, canonical_hash, files_digest, json_bytes
from labgym.effects import refuse_idle
from labgym.errors import LabgymError, OptionError
from labgym.eval.driving.assignments import episode_keys
from labgym.eval.driving.drive import Route
from labgym.eval.driving.episode_row import EpisodeRow, Key
from labgym.eval.driving.evaluation import with_planning
from labgym.eval.driving.files import EPISODES, ROUTES, SUMMARY, TIMES, EpisodeRoute, EpisodeTime, parse_lines
from labgym.eval.driving.folders import short_name
from labgym.eval.driving.intervals import Estimate
from labgym.eval.driving.record import NavigationSummary
from labgym.eval.driving.shard import drive_shard, shard_file
from labgym.layouts import Layout
from labgym.policies import Policy
from labgym.policies.fingerprint.policy import PolicyFingerprint, named_fingerprint, object_fingerprint
from labgym.policies.kernels import NATIVE, KernelMode, kernel_facts, kernel_mode
from labgym.policies.process import PolicyProcess, PolicySource, ProcessLimits, close_shared_process, shared_process
from labgym.policies.registry import SERVER, is_class_place, policy_place
from labgym.runs import ExecutorOptions, RunFolder, RunIdentity, Shard, run_shards
from labgym.suites import Jitter, Suite, load_suite, suite_of


@dataclass(frozen=True)
class NavigationReport:
    """The result of an evaluation.

    Attributes:
        summary: metrics with intervals, and the record of the evaluation; `summary.json`.
        rows: episodes in the suite's order; `episodes.jsonl`.
        routes: poses (x, y, yaw) of the robot in meters and radians, by layout id, pair and repeat; `routes.jsonl`.
        times: wall-clock milliseconds of the policy per action, by layout id, pair and repeat; `times.jsonl`.
    """

    summary: NavigationSummary
    rows: tuple[EpisodeRow, ...]
    routes: dict[Key, Route]
    times: dict[Key, float | None]

    @cached_property
    def metrics(self) -> dict[str, Estimate]:
        """Metrics with intervals, the planning time included."""
        return with_planning(self.summary.metrics, self.times)

    def __getitem__(self, metric: str) -> float | None:
        """Return a metric's value, or None if it applies to no episode."""
        return self.metrics[metric].value


def evaluate(
    policy: str | Policy,
    suite: str | Path | Suite | Sequence[Layout] = "test",
    workers: int = 1,
    out: str | Path | None = None,
    seed: int = 0,
    progress: bool = True,
    options: dict[str, Any] | None = None,
    fresh: bool = False,
    executor: ExecutorOptions | None = None,
    repeats: int | None = None,
    jitter: Jitter | None = None,
    isolated: bool = True,
    limits: ProcessLimits | None = None,
    kernels: str | None = None,
    layouts: Sequence[Layout] = (),
) -> NavigationReport:
    """Drive a policy through the episodes of a suite and return the results.

    The policy runs in a separate process, and each episode in a fresh copy of it: the object that is passed does not
    change. Apart from the measured planning times, the results do not depend on the number of workers, on the executor
    or on interruptions.

    Args:
        policy: a name for `make_policy`, or a policy, which is copied in its present state.
        suite: name of a suite, path of a suite's .json file, a `Suite`, or layouts, each with its protocol.
        workers: number of local processes, each of which drives one layout at a time; 1 stays in this process.
        out: folder for `run.json` (the identity of the evaluation), `episodes.jsonl`, `routes.jsonl`, `times.jsonl`,
            `summary.json`, `provenance.jsonl`, and for layouts passed by hand, `layouts/`. Finished layouts are kept,
            and an interrupted evaluation resumes. None writes nothing.
        seed: random seed of the policy.
        progress: whether to show a progress bar.
        options: arguments for `make_policy`.
        fresh: rename an existing folder to NAME.old-1, NAME.old-2, ... and start anew.
        executor: where layouts are driven, instead of `workers` local processes.
        repeats: number of episodes per drive; None takes the suite's.
        jitter: displacement of every start; None takes the suite's.
        isolated: False drives the policy in this process, for debugging, with one worker: it then remembers earlier
            episodes, and its errors are not contained.
        limits: limits of time and memory of the policy's process.
        kernels: "pinned" for equal results on every x86-64 processor with AVX2, "native" for the fastest; None is
            "pinned" where the processor allows it.
        layouts: the layouts of a suite without a published split, in its order.

    Raises:
        UnknownNameError: the suite, the policy or the kernel mode does not exist.
        OptionError: an option is out of range; the folder holds another evaluation; or the policy has no fingerprint,
            which a folder needs (`labgym.policies.fingerprint`).
        LabgymError: two layouts have the same id, a layout has no protocol, or workers died.
    """
    whole_number("seed", seed, 0, MAX_SEED)
    refuse_idle(
        (
            ("workers", executor is not None and workers != 1, "with an executor, which has its own workers"),
            ("limits", limits is not None and not isolated, "with isolated=False: there is no process to limit"),
            ("kernels", kernels is not None and not isolated, "with isolated=False: they are those of this process"),
            ("options", bool(options) and isinstance(policy, Policy), "on a policy object: pass them to its class"),
            ("fresh", fresh and out is None, "without out, the folder to start anew"),
        )
    )
    # The policy is copied before the layouts are read, so that its code cannot put them into the copy.
    source = policy_source(policy, dict(options or {}))
    suite, layouts = _resolved(suite, layouts)
    suite = suite.repeated(repeats, jitter)
    executor = executor or ExecutorOptions(workers=workers)
    with opened(policy, source, executor, limits, kernels, isolated) as running:
        if running.driver.foresees:
            raise OptionError(
                f"policy {running.label!r} foresees the world, which only LabNav hands out: choose labnav-TASK"
            )
        return _Run(running, suite, layouts, seed).carried_out(out, fresh, progress)


Content = dict[str, bytes]
"""Content of the files of an evaluation by name."""
FILES = (EPISODES, ROUTES, TIMES)
Report = TypeVar("Report")


@dataclass(frozen=True)
class RunningPolicy:
    """A policy that is open for an evaluation.

    Attributes:
        policy: as the user passed it. source: for processes. driver: the policy in its process, or in this one.
        label: name of the policy in the rows. limits: of its process. mode: its kernels. executor: where it drives.
    """

    policy: str | Policy
    source: PolicySource
    driver: Policy | PolicyProcess
    label: str
    limits: ProcessLimits | None
    mode: KernelMode
    executor: ExecutorOptions

    @property
    def isolated(self) -> bool:
        """Whether the policy drives in a separate process."""
        return isinstance(self.driver, PolicyProcess)

    @property
    def arguments(self) -> tuple[Any, ...]:
        """The policy, the digest of its files, its limits, kernels and label, as shards take them."""
        policy = self.source if self.isolated else self.driver
        return policy, files_digest(self.driver.files()), self.limits, self.mode.kind, self.label


@contextlib.contextmanager
def opened(
    policy: str | Policy,
    source: PolicySource,
    executor: ExecutorOptions,
    limits: ProcessLimits | None,
    kernels: str | None,
    isolated: bool = True,
) -> Iterator[RunningPolicy]:
    """Open a policy for an evaluation, and close it at the end.

    Args:
        policy, limits, kernels, isolated: as for `evaluate`. source: of the policy. executor: where shards are driven.

    Raises:
        OptionError: the executor does not suit the policy, or it is not isolated and the executor has workers.
    """
    mode, here = kernel_mode(kernels), executor == ExecutorOptions()
    if not isolated and not here:
        raise OptionError(f"isolated=False drives in this process; use workers=1, not {executor.workers}")
    with open_driver(policy, source, limits, mode, isolated) as driver:
        label = short_name(source.name) if isinstance(policy, str) and not is_class_place(policy) else driver.name
        if driver.exclusive and not here:
            raise OptionError(f"policy {label!r} drives one robot at a time; use the local executor with workers=1")
        if executor.kind == "dask":
            source = source.portable(driver.files())
        yield RunningPolicy(policy, source, driver, label, limits, mode if isolated else NATIVE, executor)


class EvaluationRun(ABC, Generic[Report]):
    """An evaluation: its shards, and the report on what they return.

    Args:
        running: the policy. shards: in the order of the suite. layouts: that are driven in. seed: of the policy.
    """

    kind: ClassVar[str]

    def __init__(self, running: RunningPolicy, shards: Sequence[Shard], layouts: Iterable[Layout], seed: int) -> None:
        self.running, self.shards, self.layouts, self.seed = running, tuple(shards), tuple(layouts), seed

    @abstractmethod
    def inputs(self) -> dict[str, Any]:
        """Return what identifies the evaluation besides policy, seed, kernels, limits and catalog."""

    @abstractmethod
    def report(self, content: Content) -> Report:
        """Return the report on rows, routes and times."""

    @abstractmethod
    def summary(self, report: Report) -> Document:
        """Return the summary of a report."""

    def documents(self) -> Content:
        """Return further files of the evaluation."""
        return {}

    def carried_out(self, out: str | Path | None, fresh: bool, progress: bool) -> Report:
        """Drive the shards that the folder does not hold, write the files, and return the report.

        Args:
            out: the folder; None writes nothing. fresh: move an existing folder aside. progress: show a progress bar.
        """
        running, driver = self.running, self.running.driver
        policy = (
            None if out is None else policy_fingerprint(running.policy, running.source, running.label, driver.files())
        )
        if running.executor != ExecutorOptions():
            close_shared_process()
        if out is None or policy is None:
            return self.report(self._drive(None, progress))
        identity = RunIdentity.of(
            self.kind,
            **self.inputs(),
            policy=policy.model_dump(),
            seed=self.seed,
            kernels=running.mode.name,
            limits=None if running.limits is None else running.limits.model_dump(),
            catalog=catalog_digest(self.layouts),
        )
        in_force = driver.kernels if isinstance(driver, PolicyProcess) else kernel_facts()
        with RunFolder.open(out, identity, fresh, in_force) as folder:
            if folder.finished:
                return self.report({name: (folder.path / name).read_bytes() for name in FILES})
            content = self._drive(folder, progress)
            report = self.report(content)
            files = {name: content[name] for name in (EPISODES, ROUTES)}
            files[SUMMARY] = json_bytes(self.summary(report).to_json())
            folder.finish(files | self.documents(), measured={TIMES: content[TIMES]})
            return report

    def _drive(self, folder: RunFolder | None, progress: bool) -> Content:
        """Drive the shards that the folder does not hold; return rows, routes and times in the suite's order."""
        guard, executor = {"catalog": installed_catalog}, self.running.executor
        finished = {
            shard.name: output.files
            for shard, output in run_shards(
                self.shards, folder, executor, self.running.label, "ep", guard, progress=progress
            )
        }
        return {
            name: b"".join(finished[shard.name][shard_file(shard.name, name)] for shard in self.shards)
            for name in FILES
        }


class _Run(EvaluationRun[NavigationReport]):
    """An evaluation of transitions."""

    kind = "eval"

    def __init__(self, running: RunningPolicy, suite: Suite, layouts: tuple[Layout, ...], seed: int) -> None:
        self._suite = suite
        shards = [
            Shard(
                layout.id,
                drive_shard,
                (*running.arguments, layout, suite, seed),
                size=len(episode_keys(layout, suite)),
            )
            for layout in layouts
        ]
        super().__init__(running, shards, layouts, seed)

    def inputs(self) -> dict[str, Any]:
        """Return suite, layouts, and whether the policy is in a separate process."""
        return {
            "suite": self._suite.model_dump(mode="json"),
            "layouts": {layout.id: layout.hash for layout in self.layouts},
            "isolated": self.running.isolated,
        }

    def documents(self) -> Content:
        """Return the layouts, if they are not published."""
        if self._suite.split is not None:
            return {}
        return {f"layouts/{layout.id}.json": json_bytes(layout.to_json()) for layout in self.layouts}

    def summary(self, report: NavigationReport) -> NavigationSummary:
        """Return the summary of a report."""
        return report.summary

    def report(self, content: Content) -> NavigationReport:
        """Return the report on the episodes in the content of the files."""
        rows = tuple(parse_lines(EPISODES, content[EPISODES], EpisodeRow).values())
        expected, running = sum(shard.size for shard in self.shards), self.running
        summary = NavigationSummary(
            suite=self._suite,
            policy=running.label,
            options=running.source.options,
            privileged=running.driver.privileged,
            sensors=running.driver.observation,
            seed=self.seed,
            layouts={layout.id: layout.hash for layout in self.layouts},
            episodes=expected,
            expected=expected,
            errors=0,
            unreachable=0,
            complete=True,
            metrics={},
        )
        routes = parse_lines(ROUTES, content[ROUTES], EpisodeRoute)
        times = parse_lines(TIMES, content[TIMES], EpisodeTime)
        return NavigationReport(
            summary.recomputed(rows),
            rows,
            {key: route.poses for key, route in routes.items()},
            {key: time.planning_ms for key, time in times.items()},
        )


def installed_catalog() -> str:
    """Return the digest of the catalog of this installation."""
    return Catalog.load().digest


def catalog_digest(layouts: Iterable[Layout]) -> str:
    """Return the digest of the catalogs of layouts, as in the identity of an evaluation."""
    return canonical_hash(sorted({layout.catalog.digest for layout in layouts}))


def policy_fingerprint(
    policy: str | Policy, source: PolicySource, label: str, files: Sequence[Path]
) -> PolicyFingerprint:
    """Return the fingerprint of a policy, as in the identity of an evaluation.

    Args:
        policy: the name or the object.
        source: the same with its options.
        label: name of the policy in the rows.
        files: its files, such as weights, as its process states them.
    """
    if isinstance(policy, Policy):
        return object_fingerprint(policy, files)
    place = policy_place(policy)
    server = {"url": policy} if place == SERVER else {}
    return named_fingerprint(label, place, {**server, **source.options}, files)


def _resolved(
    suite: str | Path | Suite | Sequence[Layout], layouts: Sequence[Layout]
) -> tuple[Suite, tuple[Layout, ...]]:
    if isinstance(suite, str | Path):
        suite = load_suite(suite)
    if isinstance(suite, Suite):
        if not layouts:
            return suite, suite.load_layouts()
        suite.check_layouts(layouts)
        return suite, _unique(layouts)
    unique = _unique((*suite, *layouts))
    return suite_of(unique), unique


def _unique(layouts: Sequence[Layout]) -> tuple[Layout, ...]:
    """Return layouts whose ids differ, at least one."""
    ids = [layout.id for layout in layouts]
    repeated = sorted({name for name in ids if ids.count(name) > 1})
    if repeated or not layouts:
        problem = f"two layouts have the id {repeated[0]!r}" if repeated else "no layouts to drive in"
        raise LabgymError(f"{problem}; an evaluation needs at least one layout, and ids must be unique")
    return tuple(layouts)


def policy_source(policy: str | Policy, options: dict[str, Any]) -> PolicySource:
    """Return the source of a policy for its process.

    Raises:
        OptionError: options for an object, or not a policy.
    """
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
def open_driver(
    policy: str | Policy, source: PolicySource, limits: ProcessLimits | None, mode: KernelMode, isolated: bool
) -> Iterator[Policy | PolicyProcess]:
    """Open the policy in a separate process or, not isolated, in this one, and close it at the end."""
    if isolated:
        try:
            yield shared_process(source, limits, mode.environment)
        finally:
            close_shared_process()
        return
    driver = policy if isinstance(policy, Policy) else source.make()
    try:
        yield driver
    finally:
        if driver is not policy:
            driver.close()
