"""The evaluator of LabNav: drives a policy through the episodes of a suite."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from labgym.counts import MAX_SEED, whole_number
from labgym.documents import files_digest, json_bytes
from labgym.effects import refuse_idle
from labgym.envs.labnav.episodes import LabNavEpisode
from labgym.errors import DocumentError, OptionError
from labgym.eval.driving.files import EPISODES, ROUTES, SUMMARY, TIMES, parse_lines, record_line
from labgym.eval.driving.folders import short_name
from labgym.eval.driving.runner import (
    catalog_digest,
    installed_catalog,
    open_driver,
    policy_fingerprint,
    policy_source,
)
from labgym.eval.driving.shard import policy_process
from labgym.eval.labnav.drive import drive_floor
from labgym.eval.labnav.foresight import check_foresight, executor_for, in_place, track_of
from labgym.eval.labnav.results import LabNavDrive
from labgym.eval.labnav.row import LabNavRoute, LabNavRow, LabNavTime
from labgym.eval.labnav.suites import LabNavSuite, load_labnav
from labgym.eval.labnav.summary import LabNavSummary, summarise
from labgym.eval.labnav.thinking import Thinking, charged_latency, checked_latency
from labgym.layouts import Layout
from labgym.policies import Policy
from labgym.policies.kernels import kernel_mode
from labgym.policies.process import PolicyProcess, PolicySource, ProcessLimits, close_shared_process
from labgym.policies.registry import BUILT_IN, is_class_place
from labgym.runs import ExecutorOptions, RunFolder, RunIdentity, Shard, ShardOutput, run_shards
from labgym.runs.folder import SHARDS
from labgym.runs.identity import IDENTITY_FILE

FILES = (EPISODES, ROUTES, TIMES)


@dataclass(frozen=True)
class LabNavReport:
    """The result of an evaluation.

    Attributes:
        summary: `summary.json`. rows: `episodes.jsonl`, in the suite's order.
        times: of each episode, measured. thinking: of all; None if nothing was measured.
    """

    summary: LabNavSummary
    rows: tuple[LabNavRow, ...]
    times: tuple[LabNavTime, ...]
    thinking: Thinking | None


def evaluate_labnav(
    policy: str | Policy,
    suite: str | LabNavSuite,
    out: str | Path | None = None,
    seed: int = 0,
    progress: bool = True,
    options: dict[str, Any] | None = None,
    fresh: bool = False,
    executor: ExecutorOptions | None = None,
    limits: ProcessLimits | None = None,
    kernels: str | None = None,
    latency: float | None = None,
) -> LabNavReport:
    """Drive a policy through the episodes of a LabNav suite and return the results.

    The policy runs in a separate process, and each episode in a fresh copy of it; a built-in policy that foresees the
    world runs in the worker that drives, never in this process. Apart from the measured times, the results do not
    depend on the executor or on interruptions.

    Args:
        policy: a name for `make_policy`, or a policy, which is copied in its present state.
        suite: name of a suite, such as "labnav-aisle" or "labnav-mini", or a suite.
        out: folder for `run.json`, `episodes.jsonl`, `routes.jsonl`, `times.jsonl`, `summary.json` and
            `provenance.jsonl`. Finished floors are kept, and an interrupted evaluation resumes. None writes nothing.
        seed: random seed of the policy.
        progress: whether to show a progress bar.
        options: arguments for `make_policy`.
        fresh: rename an existing folder and start anew.
        executor: where floors are driven; by default in this process, or in one worker for a policy that foresees.
        limits: limits of time and memory of the policy's process.
        kernels: as for `labgym.eval.driving.runner.evaluate`.
        latency: by which actions come late, seconds; at least what the policy declares. By default that is what a
            built-in policy declares; another one is measured first (`charged_latency`), and the folder keeps the
            result.

    Raises:
        UnknownNameError: the suite, the policy or the kernel mode does not exist.
        OptionError: an option is out of range, or the folder holds another evaluation.
        LabgymError: workers died.
    """
    whole_number("seed", seed, 0, MAX_SEED)
    refuse_idle(
        (
            ("options", bool(options) and isinstance(policy, Policy), "on a policy object: pass them to its class"),
            ("fresh", fresh and out is None, "without out, the folder to start anew"),
        )
    )
    mode, executor = kernel_mode(kernels), executor or ExecutorOptions()
    source = policy_source(policy, dict(options or {}))
    suite = load_labnav(suite) if isinstance(suite, str) else suite
    here = executor == ExecutorOptions()
    with open_driver(policy, source, limits, mode, isolated=True) as driver:
        assert isinstance(driver, PolicyProcess)
        label = short_name(source.name) if isinstance(policy, str) and not is_class_place(policy) else driver.name
        if driver.exclusive and not here:
            raise OptionError(f"policy {label!r} drives one robot at a time; use the local executor with workers=1")
        if driver.foresees:
            check_foresight(source)
        executor = executor_for(executor, driver.foresees)
        here = executor == ExecutorOptions()
        if executor.kind == "dask":
            source = source.portable(driver.files())
        if latency is not None:
            latency = checked_latency(latency, driver.latency)
        elif source.pickled is None and source.name in BUILT_IN:
            latency = driver.latency
        else:
            kept = None if out is None or fresh else kept_latency(Path(out))
            latency = charged_latency(driver, suite, seed) if kept is None else kept
        run = _Run(source, driver, label, suite, seed, limits, mode.kind, latency)
        fingerprint = None if out is None else policy_fingerprint(policy, source, label, driver.files())
        if not here:
            close_shared_process()
        if out is None or fingerprint is None:
            return run.report(run.drive(None, executor, progress))
        identity = RunIdentity.of(
            "labnav",
            suite=suite.name,
            episodes=suite.hash,
            policy=fingerprint.model_dump(),
            seed=seed,
            latency=latency,
            kernels=mode.name,
            limits=None if limits is None else asdict(limits),
            catalog=catalog_digest(run.layouts.values()),
        )
        with RunFolder.open(out, identity, fresh, driver.kernels) as folder:
            if folder.finished:
                return run.report({name: (folder.path / name).read_bytes() for name in FILES})
            content = run.drive(folder, executor, progress)
            report = run.report(content)
            files = {name: content[name] for name in (EPISODES, ROUTES)}
            files[SUMMARY] = json_bytes(report.summary.to_json())
            folder.finish(files, measured={TIMES: content[TIMES]})
            return report


class _Run:
    """An evaluation: its arguments, its shards and its report."""

    def __init__(
        self,
        source: PolicySource,
        driver: PolicyProcess,
        label: str,
        suite: LabNavSuite,
        seed: int,
        limits: ProcessLimits | None,
        kernels: str,
        latency: float,
    ) -> None:
        self._suite, self._label, self._latency, self._declared = suite, label, latency, driver.latency
        self.layouts = {(part.split, floor): part.layout(floor) for part in suite.parts for floor in part.floors}
        policy = source, files_digest(driver.files()), limits, kernels, label
        self._shards = [
            Shard(
                f"{part.name}/{floor}",
                drive_shard,
                (
                    *policy,
                    self.layouts[part.split, floor],
                    episodes,
                    part.task,
                    part.level,
                    part.label,
                    seed,
                    suite.seconds,
                    latency,
                ),
                size=len(episodes),
            )
            for part in suite.parts
            for floor, episodes in part.floors.items()
        ]
        self._fields = {
            "policy": label,
            "options": source.options,
            "track": track_of(driver),
            "sensors": driver.observation,
            "seed": seed,
            "latency": latency,
            "declared": driver.latency if latency != driver.latency else None,
        }

    def drive(self, folder: RunFolder | None, executor: ExecutorOptions, progress: bool) -> dict[str, bytes]:
        """Drive the floors that the folder does not hold; return rows, routes and times in the suite's order."""
        guard = {"catalog": installed_catalog}
        finished = {
            shard.name: output.files
            for shard, output in run_shards(self._shards, folder, executor, self._label, "ep", guard, progress=progress)
        }
        return {
            name: b"".join(finished[shard.name][f"{SHARDS}/{shard.name}/{name}"] for shard in self._shards)
            for name in FILES
        }

    def report(self, content: dict[str, bytes]) -> LabNavReport:
        """Return the report on the content of the files."""
        rows = tuple(parse_lines(EPISODES, content[EPISODES], LabNavRow).values())
        times = tuple(parse_lines(TIMES, content[TIMES], LabNavTime).values())
        thinking = Thinking.of(times, self._declared, self._latency)
        return LabNavReport(summarise(self._suite, rows, **self._fields), rows, times, thinking)


def kept_latency(folder: Path) -> float | None:
    """Return the latency with which the run in a folder drives, seconds; None without such a run."""
    if not (folder / IDENTITY_FILE).is_file():
        return None
    try:
        latency = RunIdentity.load(folder / IDENTITY_FILE).inputs.get("latency")
    except DocumentError:
        return None
    return latency if isinstance(latency, float) else None


def drive_shard(
    policy: PolicySource,
    files: str,
    limits: ProcessLimits | None,
    kernels: str,
    label: str,
    layout: Layout,
    episodes: tuple[LabNavEpisode, ...],
    task: str,
    level: int,
    suite: str,
    seed: int,
    seconds: float,
    latency: float,
) -> ShardOutput:
    """Drive the episodes of one floor and return rows, routes and times.

    Args:
        policy, files, limits, kernels, label: as for `labgym.eval.driving.shard.drive_shard`.
        layout, episodes, task, level, suite, seed, seconds, latency: as for `drive_floor`.
    """
    driver = in_place(policy_process(policy, files, limits, kernels), policy)
    drives = drive_floor(driver, layout, episodes, task, level, label, suite, seed, seconds, latency=latency)
    folder = f"{SHARDS}/{suite.partition('/')[0]}/{layout.id}"
    return ShardOutput({f"{folder}/{name}": content for name, content in drive_files(drives).items()})


def drive_files(drives: Iterable[LabNavDrive]) -> dict[str, bytes]:
    """Return the content of rows, routes and times of episodes, by the file's name."""
    drives = tuple(drives)
    routes = (LabNavRoute(key=one.row.key, poses=one.route) for one in drives)
    times = (
        LabNavTime(key=one.row.key, planning_ms=one.planning_ms, high_ms=one.high_ms, slow=one.slow) for one in drives
    )
    return {
        EPISODES: b"".join(record_line(one.row) for one in drives),
        ROUTES: b"".join(map(record_line, routes)),
        TIMES: b"".join(map(record_line, times)),
    }
