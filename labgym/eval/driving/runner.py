"""The evaluator: drives a policy through the episodes of a suite."""

from __future__ import annotations

import contextlib
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from labgym.assets import Catalog
from labgym.counts import MAX_SEED, whole_number
from labgym.documents import canonical_hash, files_digest, json_bytes
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
from labgym.policies.policy import Driver, Sensors
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
    mode = kernel_mode(kernels)
    executor = executor or ExecutorOptions(workers=workers)
    # The policy is copied before the layouts are read, so that its code cannot put them into the copy.
    source = policy_source(policy, dict(options or {}))
    suite, layouts = _resolved(suite, layouts)
    suite = suite.repeated(repeats, jitter)
    here = executor == ExecutorOptions()
    if not isolated and not here:
        raise OptionError(f"isolated=False drives in this process; use workers=1, not {executor.workers}")
    with open_driver(policy, source, limits, mode, isolated) as driver:
        label = short_name(source.name) if isinstance(policy, str) and not is_class_place(policy) else driver.name
        if driver.exclusive and not here:
            raise OptionError(f"policy {label!r} drives one robot at a time; use the local executor with workers=1")
        if driver.foresees:
            raise OptionError(f"policy {label!r} foresees the world, which only LabNav hands out: choose labnav-TASK")
        if executor.kind == "dask":
            source = source.portable(driver.files())
        run = _Run(
            driver if not isolated else source,
            files_digest(driver.files()),
            label,
            limits,
            mode if isolated else NATIVE,
            suite,
            layouts,
            seed,
            driver.privileged,
            driver.observation,
            source.options,
            {layout.id: episode_keys(layout, suite) for layout in layouts},
        )
        fingerprint = None if out is None else policy_fingerprint(policy, source, label, driver.files())
        if not here:
            close_shared_process()
        if out is None or fingerprint is None:
            return run.report(run.drive(None, executor, progress))
        in_force = driver.kernels if isinstance(driver, PolicyProcess) else kernel_facts()
        with RunFolder.open(out, run.identity(fingerprint), fresh, in_force) as folder:
            return run.report(run.drive_into(folder, executor, progress))


Content = dict[str, bytes]
"""Content of the files of an evaluation by name."""


@dataclass(frozen=True)
class _Run:
    """An evaluation: its arguments, its episodes and its report."""

    policy: PolicySource | Driver
    files: str
    label: str
    limits: ProcessLimits | None
    kernels: KernelMode
    suite: Suite
    layouts: tuple[Layout, ...]
    seed: int
    privileged: bool
    sensors: Sensors
    options: dict[str, Any]
    episodes: dict[str, tuple[Key, ...]]

    def identity(self, policy: PolicyFingerprint) -> RunIdentity:
        """Return the identity of the evaluation in a folder."""
        return RunIdentity.of(
            "eval",
            suite=self.suite.model_dump(mode="json"),
            layouts={layout.id: layout.hash for layout in self.layouts},
            policy=policy.model_dump(),
            seed=self.seed,
            isolated=isinstance(self.policy, PolicySource),
            kernels=self.kernels.name,
            limits=None if self.limits is None else asdict(self.limits),
            catalog=catalog_digest(self.layouts),
        )

    def drive(self, folder: RunFolder | None, executor: ExecutorOptions, progress: bool) -> Content:
        """Drive the episodes that the folder does not hold and return rows, routes and times in the suite's order."""
        shards = [
            Shard(
                layout.id,
                drive_shard,
                (self.policy, self.files, self.limits, self.kernels.kind, self.label, layout, self.suite, self.seed),
                size=len(self.episodes[layout.id]),
            )
            for layout in self.layouts
        ]
        guard = {"catalog": installed_catalog}
        finished = {
            shard.name: output.files
            for shard, output in run_shards(shards, folder, executor, self.label, "ep", guard, progress=progress)
        }
        return {
            name: b"".join(finished[layout.id][shard_file(layout.id, name)] for layout in self.layouts)
            for name in (EPISODES, ROUTES, TIMES)
        }

    def drive_into(self, folder: RunFolder, executor: ExecutorOptions, progress: bool) -> Content:
        """Return rows, routes and times of a folder; first drive what it does not hold, and write the summary."""
        if folder.finished:
            return {name: (folder.path / name).read_bytes() for name in (EPISODES, ROUTES, TIMES)}
        content = self.drive(folder, executor, progress)
        files = {name: content[name] for name in (EPISODES, ROUTES)}
        files[SUMMARY] = json_bytes(self.report(content).summary.to_json())
        if self.suite.split is None:
            files |= {f"layouts/{layout.id}.json": json_bytes(layout.to_json()) for layout in self.layouts}
        folder.finish(files, measured={TIMES: content[TIMES]})
        return content

    def report(self, content: Content) -> NavigationReport:
        """Return the report on the episodes in the content of the files."""
        rows = tuple(parse_lines(EPISODES, content[EPISODES], EpisodeRow).values())
        expected = sum(map(len, self.episodes.values()))
        summary = NavigationSummary(
            suite=self.suite,
            policy=self.label,
            options=self.options,
            privileged=self.privileged,
            sensors=self.sensors,
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
