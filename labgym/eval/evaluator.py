"""The evaluator: drives a policy through the episodes of a suite."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from labgym.counts import MAX_SEED, whole_number
from labgym.documents import json_bytes
from labgym.errors import LabgymError, OptionError, refuse_idle
from labgym.eval.driving.assignments import episode_keys
from labgym.eval.driving.drive import drive_layout
from labgym.eval.driving.episode_row import TransitionRow
from labgym.eval.driving.evaluation import Evaluation, TransitionEvaluation
from labgym.eval.driving.files import drive_files
from labgym.eval.driving.record import NavigationSummary
from labgym.eval.driving.runner import (
    Content,
    EvaluationRun,
    RunningPolicy,
    ShardPolicy,
    hidden_places,
    opened,
    policy_source,
    shard_file,
)
from labgym.eval.labnav.evaluation import LabNavEvaluation, is_labnav_run
from labgym.eval.labnav.foresight import check_foresight, executor_for
from labgym.eval.labnav.runner import LabNavRun, latency_of
from labgym.eval.labnav.suites import LabNavSuite, is_labnav, resolve_labnav
from labgym.layouts import Layout
from labgym.policies import Policy
from labgym.policies.process import ProcessLimits
from labgym.runs import ExecutorOptions, Shard, ShardOutput
from labgym.suites import Jitter, Suite, load_suite, suite_of

AnySuite = Suite | LabNavSuite
LABNAV_EPISODES = "with a suite of LabNav, which has fixed episodes"


def evaluate(
    policy: str | Policy,
    suite: str | Path | AnySuite | Sequence[Layout] = "test",
    *,
    layouts: Sequence[Layout] = (),
    seed: int = 0,
    repeats: int | None = None,
    jitter: Jitter | None = None,
    latency: float | None = None,
    out: str | Path | None = None,
    fresh: bool = False,
    progress: bool = True,
    options: dict[str, Any] | None = None,
    workers: int = 1,
    executor: ExecutorOptions | None = None,
    isolated: bool = True,
    limits: ProcessLimits | None = None,
    kernels: str | None = None,
) -> Evaluation[Any, Any]:
    """Drive a policy through the episodes of a suite and return the results.

    The policy runs in a separate process, and each episode in a fresh copy of it: the object that is passed does not
    change. A built-in policy that foresees the world runs in the worker that drives, never in this process. Apart from
    the measured times, the results do not depend on the number of workers, on the executor or on interruptions.

    Args:
        policy: a name for `make_policy`, or a policy, which is copied in its present state.
        suite: name of a suite, such as "lab30" or "labnav-aisle", path of a suite's .json file or of a file or folder
            of `labgym labnav`, a suite, or layouts, each with its protocol.
        layouts: the layouts of a suite without a published split, in its order.
        seed: random seed of the policy.
        repeats: number of episodes per drive; None takes the suite's. LabNav has none.
        jitter: displacement of every start; None takes the suite's. LabNav has none.
        latency: in LabNav, by which actions come late at least, seconds; not less than the policy declares. A policy
            that is not built in is measured first (`labgym.eval.labnav.latency`), and the folder keeps the result.
        out: folder for `run.json` (the identity of the evaluation), `episodes.jsonl`, `routes.jsonl`, `times.jsonl`,
            `actions.jsonl`, `summary.json`, `provenance.jsonl`, and for layouts passed by hand, `layouts/`. Finished
            layouts are kept, and an interrupted evaluation resumes. None writes nothing.
        fresh: rename an existing folder to NAME.old-1, NAME.old-2, ... and start anew.
        progress: whether to show a progress bar.
        options: arguments for `make_policy`.
        workers: number of local processes, each of which drives one layout at a time; 1 stays in this process.
        executor: where layouts are driven, instead of `workers` local processes.
        isolated: False drives the policy in this process, for debugging, with one worker: it then remembers earlier
            episodes, and its errors are not contained. LabNav is always isolated.
        limits: limits of time and memory of the policy's process.
        kernels: "pinned" for equal results on every x86-64 processor with AVX2, "native" for the fastest; None is
            "pinned" where the processor allows it.

    Returns:
        a `TransitionEvaluation` or, of a suite of LabNav, a `LabNavEvaluation`.

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
    source = replace(source, hidden=() if out is None else hidden_places(out))
    chosen, driven = resolved_suite(suite, layouts)
    labnav = isinstance(chosen, LabNavSuite)
    refuse_idle(
        (
            ("repeats", labnav and repeats is not None, LABNAV_EPISODES),
            ("jitter", labnav and jitter is not None, LABNAV_EPISODES),
            ("isolated", labnav and not isolated, "with a suite of LabNav, whose policies are in a separate process"),
            ("latency", not labnav and latency is not None, "with this suite, which does not delay actions"),
        )
    )
    executor = executor or ExecutorOptions(workers=workers)
    with opened(policy, source, executor, limits, kernels, isolated) as running:
        run: EvaluationRun[Any]
        if isinstance(chosen, LabNavSuite):
            resumed = None if out is None or fresh else Path(out)
            run = _labnav_run(running, chosen, seed, latency, resumed)
        else:
            if running.driver.foresees:
                raise OptionError(
                    f"policy {running.label!r} foresees the world, which only LabNav hands out: choose labnav-TASK"
                )
            run = TransitionRun(running, chosen.repeated(repeats, jitter), driven, seed)
        evaluation: Evaluation[Any, Any] = run.carried_out(out, fresh, progress)
        return evaluation


def read_evaluation(folder: str | Path) -> TransitionEvaluation | LabNavEvaluation:
    """Return the evaluation in a folder.

    Raises:
        DocumentError: it is not finished, or its summary cannot be read.
    """
    return LabNavEvaluation.read(folder) if is_labnav_run(folder) else TransitionEvaluation.read(folder)


def resolved_suite(
    suite: str | Path | AnySuite | Sequence[Layout], layouts: Sequence[Layout] = ()
) -> tuple[AnySuite, tuple[Layout, ...]]:
    """Return a suite, and the layouts of one of transitions.

    Raises:
        UnknownNameError, DocumentError: the suite does not exist or is broken.
        OptionError: the layouts are not those of the suite.
        LabgymError: there is no layout, or two have the same id.
    """
    if isinstance(suite, LabNavSuite):
        return suite, ()
    if isinstance(suite, str | Path):
        if is_labnav(str(suite)):
            return resolve_labnav(str(suite), layouts), ()
        suite = load_suite(suite)
    if isinstance(suite, Suite):
        if not layouts:
            return suite, suite.load_layouts()
        suite.check_layouts(layouts)
        return suite, _unique(layouts)
    unique = _unique((*suite, *layouts))
    return suite_of(unique), unique


def _labnav_run(
    running: RunningPolicy, suite: LabNavSuite, seed: int, latency: float | None, out: Path | None
) -> LabNavRun:
    """Return the run of a suite of LabNav; `latency` as the user passed it, `out` the folder that it may resume."""
    foresees = running.driver.foresees
    if foresees:
        check_foresight(running.source)
    running = replace(running, executor=executor_for(running.executor, foresees))
    return LabNavRun(running, suite, seed, latency_of(running, suite, seed, latency, out))


def _unique(layouts: Sequence[Layout]) -> tuple[Layout, ...]:
    """Return layouts whose ids differ, at least one."""
    ids = [layout.id for layout in layouts]
    repeated = sorted({name for name in ids if ids.count(name) > 1})
    if repeated or not layouts:
        problem = f"two layouts have the id {repeated[0]!r}" if repeated else "no layouts to drive in"
        raise LabgymError(f"{problem}; an evaluation needs at least one layout, and ids must be unique")
    return tuple(layouts)


class TransitionRun(EvaluationRun[TransitionEvaluation]):
    """An evaluation on transitions.

    Args:
        running: the policy. suite: the rules. layouts: in their order. seed: of the policy.
    """

    evaluation = TransitionEvaluation

    def __init__(self, running: RunningPolicy, suite: Suite, layouts: tuple[Layout, ...], seed: int) -> None:
        self._suite = suite
        shards = [
            Shard(
                layout.id,
                drive_shard,
                (running.shard_policy, layout, suite, seed),
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

    def summary(self, rows: tuple[TransitionRow, ...]) -> NavigationSummary:
        """Return the summary of rows."""
        expected, running = sum(shard.size for shard in self.shards), self.running
        summary = NavigationSummary(
            suite=self._suite,
            policy=running.label,
            options=running.source.options,
            privileged=running.driver.privileged,
            sensors=running.driver.observation,
            box=running.box,
            seed=self.seed,
            layouts={layout.id: layout.hash for layout in self.layouts},
            episodes=expected,
            expected=expected,
            errors=0,
            unreachable=0,
            complete=True,
            metrics={},
        )
        return summary.recomputed(rows)


def drive_shard(policy: ShardPolicy, layout: Layout, suite: Suite, seed: int) -> ShardOutput:
    """Drive all episodes of a layout and return rows, routes and times, below `shards/LAYOUT/`.

    Args:
        policy: the policy. layout: the layout; its protocol gives the goal pairs. suite: the rules.
        seed: random seed of the evaluation.

    Raises:
        LabgymError: the policy's files are others here, or were changed; or this processor cannot run the kernels.
    """
    drives = drive_layout(policy.driver(), layout, suite, policy.label, seed)
    return ShardOutput({shard_file(layout.id, name): content for name, content in drive_files(drives).items()})
