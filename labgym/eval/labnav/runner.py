"""The evaluator of LabNav: drives a policy through the episodes of a suite."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from labgym.envs.labnav.episodes import LabNavEpisode
from labgym.errors import DocumentError
from labgym.eval.driving.episode_row import LabNavRow
from labgym.eval.driving.files import drive_files
from labgym.eval.driving.runner import EvaluationRun, RunningPolicy, ShardPolicy, shard_file
from labgym.eval.labnav.drive import drive_floor
from labgym.eval.labnav.evaluation import LabNavEvaluation
from labgym.eval.labnav.foresight import in_place, track_of
from labgym.eval.labnav.latency import Probe, checked_latency, probe
from labgym.eval.labnav.results import DriveTerms
from labgym.eval.labnav.suites import LabNavSuite
from labgym.eval.labnav.summary import LabNavSummary, summarise
from labgym.layouts import Layout
from labgym.policies.process import PolicyProcess, PolicySource
from labgym.runs import RunIdentity, Shard, ShardOutput
from labgym.runs.identity import IDENTITY_FILE

LATENCY, PROBE = "latency", "probe"
"""Inputs of a run in `run.json`: its latency, and the measured time of the policy."""


@dataclass(frozen=True)
class FrozenLatency:
    """The latency of a run, fixed before it drives.

    Attributes:
        seconds: by which the policy's actions come late. declared: latency that it declares.
        probe: its measured time; None if it is built in, or gave no action.
    """

    seconds: float
    declared: float
    probe: Probe | None = None


class LabNavRun(EvaluationRun[LabNavEvaluation]):
    """An evaluation of tasks of LabNav.

    Args:
        running: the policy. suite: the suite. seed: of the policy. latency: of its actions.
    """

    evaluation = LabNavEvaluation

    def __init__(self, running: RunningPolicy, suite: LabNavSuite, seed: int, latency: FrozenLatency) -> None:
        self._suite, self._latency = suite, latency
        layouts = {(part.split, floor): part.layout(floor) for part in suite.parts for floor in part.floors}
        shards = [
            Shard(
                f"{part.name}/{floor}",
                drive_shard,
                (
                    running.shard_policy,
                    layouts[part.split, floor],
                    episodes,
                    DriveTerms.of(part, running.label, seed, suite.seconds, latency.seconds),
                ),
                size=len(episodes),
            )
            for part in suite.parts
            for floor, episodes in part.floors.items()
        ]
        super().__init__(running, shards, layouts.values(), seed)

    def inputs(self) -> dict[str, Any]:
        """Return name and hash of the suite, the latency, and what was measured for it."""
        latency = self._latency
        measured = {} if latency.probe is None else {PROBE: latency.probe.model_dump(mode="json")}
        return {
            "suite": self._suite.name,
            "episodes": self._suite.hash,
            LATENCY: latency.seconds,
            **measured,
        }

    def summary(self, rows: tuple[LabNavRow, ...]) -> LabNavSummary:
        """Return the summary of rows."""
        running = self.running
        return summarise(
            self._suite,
            rows,
            policy=running.label,
            options=running.source.options,
            track=track_of(running.driver),
            sensors=running.driver.observation,
            seed=self.seed,
            latency=self._latency.seconds,
            declared=self._latency.declared if self._latency.seconds != self._latency.declared else None,
            box=running.box,
        )


def latency_of(
    running: RunningPolicy, suite: LabNavSuite, seed: int, least: float | None, out: Path | None
) -> FrozenLatency:
    """Return the latency with which a policy drives.

    It is what a built-in policy declares. Another one has the latency of the run in the folder, or is measured first.

    Args:
        running: the policy. suite: the suite. seed: of the evaluation.
        least: latency that the user passes, seconds, if it is longer; None for none.
        out: folder of the evaluation that resumes; None for a new one.

    Raises:
        OptionError: `least` is less than the policy declares, or above the limit.
    """
    driver, source = running.driver, running.source
    assert isinstance(driver, PolicyProcess)
    declared = driver.latency
    least = declared if least is None else checked_latency(least, declared)
    if source.built_in:
        return FrozenLatency(least, declared)
    kept = None if out is None else _kept_latency(out, declared)
    if kept is not None:
        return kept if least <= kept.seconds else replace(kept, seconds=least)
    measured = probe(driver, source, suite, seed)
    return FrozenLatency(least if measured is None else measured.latency(least), declared, measured)


def _kept_latency(folder: Path, declared: float) -> FrozenLatency | None:
    """Return the latency with which the run in a folder drives; None without such a run."""
    if not (folder / IDENTITY_FILE).is_file():
        return None
    try:
        inputs = RunIdentity.load(folder / IDENTITY_FILE).inputs
        measured = Probe.model_validate(inputs[PROBE]) if PROBE in inputs else None
    except (DocumentError, ValidationError):
        return None
    latency = inputs.get(LATENCY)
    return FrozenLatency(latency, declared, measured) if isinstance(latency, float) else None


def drive_shard(
    policy: ShardPolicy, layout: Layout, episodes: tuple[LabNavEpisode, ...], terms: DriveTerms
) -> ShardOutput:
    """Drive the episodes of one floor and return rows, routes and times.

    Args:
        policy: the policy. layout, episodes, terms: as for `drive_floor`.

    Raises:
        LabgymError: as `labgym.eval.evaluator.drive_shard`.
    """
    assert isinstance(policy.policy, PolicySource)
    driver = in_place(policy.driver(), policy.policy)
    drives = drive_floor(driver, layout, episodes, terms)
    shard = f"{terms.suite.partition('/')[0]}/{layout.id}"
    return ShardOutput({shard_file(shard, name): content for name, content in drive_files(drives).items()})
