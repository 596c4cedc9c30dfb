"""The evaluator of LabNav: drives a policy through the episodes of a suite."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from labgym.counts import MAX_SEED, whole_number
from labgym.effects import refuse_idle
from labgym.envs.labnav.episodes import LabNavEpisode
from labgym.errors import DocumentError
from labgym.eval.driving.files import EPISODES, ROUTES, TIMES, parse_lines, record_line
from labgym.eval.driving.runner import Content, EvaluationRun, RunningPolicy, opened, policy_source
from labgym.eval.driving.shard import policy_process, shard_file
from labgym.eval.labnav.drive import drive_floor
from labgym.eval.labnav.foresight import check_foresight, executor_for, in_place, track_of
from labgym.eval.labnav.results import LabNavDrive
from labgym.eval.labnav.row import LabNavRoute, LabNavRow, LabNavTime
from labgym.eval.labnav.suites import LabNavSuite, load_labnav
from labgym.eval.labnav.summary import LabNavSummary, summarise
from labgym.eval.labnav.thinking import Thinking, charged_latency, checked_latency
from labgym.layouts import Layout
from labgym.policies import Policy
from labgym.policies.process import PolicyProcess, PolicySource, ProcessLimits
from labgym.policies.registry import BUILT_IN
from labgym.runs import ExecutorOptions, RunIdentity, Shard, ShardOutput
from labgym.runs.identity import IDENTITY_FILE


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
    source = policy_source(policy, dict(options or {}))
    suite = load_labnav(suite) if isinstance(suite, str) else suite
    with opened(policy, source, executor or ExecutorOptions(), limits, kernels) as running:
        source, driver = running.source, running.driver
        assert isinstance(driver, PolicyProcess)
        if driver.foresees:
            check_foresight(source)
        running = replace(running, executor=executor_for(running.executor, driver.foresees))
        if latency is not None:
            latency = checked_latency(latency, driver.latency)
        elif source.pickled is None and source.name in BUILT_IN:
            latency = driver.latency
        else:
            kept = None if out is None or fresh else kept_latency(Path(out))
            latency = charged_latency(driver, suite, seed) if kept is None else kept
        return _Run(running, suite, seed, latency, driver.latency).carried_out(out, fresh, progress)


class _Run(EvaluationRun[LabNavReport]):
    """An evaluation of tasks of LabNav.

    Args:
        running: the policy. suite: the suite. seed: of the policy. latency: by which its actions come late, seconds.
        declared: latency that it declares.
    """

    kind = "labnav"

    def __init__(self, running: RunningPolicy, suite: LabNavSuite, seed: int, latency: float, declared: float) -> None:
        self._suite, self._latency, self._declared = suite, latency, declared
        layouts = {(part.split, floor): part.layout(floor) for part in suite.parts for floor in part.floors}
        shards = [
            Shard(
                f"{part.name}/{floor}",
                drive_shard,
                (
                    *running.arguments,
                    layouts[part.split, floor],
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
        super().__init__(running, shards, layouts.values(), seed)

    def inputs(self) -> dict[str, Any]:
        """Return name and hash of the suite, and the latency."""
        return {"suite": self._suite.name, "episodes": self._suite.hash, "latency": self._latency}

    def summary(self, report: LabNavReport) -> LabNavSummary:
        """Return the summary of a report."""
        return report.summary

    def report(self, content: Content) -> LabNavReport:
        """Return the report on the content of the files."""
        rows = tuple(parse_lines(EPISODES, content[EPISODES], LabNavRow).values())
        times = tuple(parse_lines(TIMES, content[TIMES], LabNavTime).values())
        thinking = Thinking.of(times, self._declared, self._latency)
        running = self.running
        summary = summarise(
            self._suite,
            rows,
            policy=running.label,
            options=running.source.options,
            track=track_of(running.driver),
            sensors=running.driver.observation,
            seed=self.seed,
            latency=self._latency,
            declared=self._declared if self._latency != self._declared else None,
        )
        return LabNavReport(summary, rows, times, thinking)


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
    shard = f"{suite.partition('/')[0]}/{layout.id}"
    return ShardOutput({shard_file(shard, name): content for name, content in drive_files(drives).items()})


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
