"""The evaluator of LabNav: drives a policy through the episodes of a suite."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from labgym.envs.labnav.episodes import LabNavEpisode
from labgym.errors import DocumentError
from labgym.eval.driving.episode_row import LabNavRow
from labgym.eval.driving.files import drive_files
from labgym.eval.driving.runner import EvaluationRun, RunningPolicy, ShardPolicy, shard_file
from labgym.eval.labnav.drive import drive_floor
from labgym.eval.labnav.evaluation import LabNavEvaluation, charged_latency
from labgym.eval.labnav.foresight import in_place, track_of
from labgym.eval.labnav.results import DriveTerms
from labgym.eval.labnav.suites import LabNavSuite
from labgym.eval.labnav.summary import LabNavSummary, summarise
from labgym.layouts import Layout
from labgym.policies.process import PolicyProcess, PolicySource
from labgym.runs import RunIdentity, Shard, ShardOutput
from labgym.runs.identity import IDENTITY_FILE


class LabNavRun(EvaluationRun[LabNavEvaluation]):
    """An evaluation of tasks of LabNav.

    Args:
        running: the policy. suite: the suite. seed: of the policy. latency: by which its actions come late, seconds.
        declared: latency that it declares.
    """

    evaluation = LabNavEvaluation

    def __init__(self, running: RunningPolicy, suite: LabNavSuite, seed: int, latency: float, declared: float) -> None:
        self._suite, self._latency, self._declared = suite, latency, declared
        layouts = {(part.split, floor): part.layout(floor) for part in suite.parts for floor in part.floors}
        shards = [
            Shard(
                f"{part.name}/{floor}",
                drive_shard,
                (
                    running.shard_policy,
                    layouts[part.split, floor],
                    episodes,
                    DriveTerms.of(part, running.label, seed, suite.seconds, latency),
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
            latency=self._latency,
            declared=self._declared if self._latency != self._declared else None,
            box=running.box,
        )


def latency_of(driver: PolicyProcess, source: PolicySource, suite: LabNavSuite, seed: int, out: Path | None) -> float:
    """Return the latency with which a policy drives if the user passes none, seconds.

    It is what a built-in policy declares. Another one has the latency of the run in the folder, or is measured first.

    Args:
        driver: the policy in its process. source: of the policy. suite: the suite. seed: of the evaluation.
        out: folder of the evaluation that resumes; None for a new one.
    """
    if source.built_in:
        return driver.latency
    kept = None if out is None else _kept_latency(out)
    return charged_latency(driver, suite, seed) if kept is None else kept


def _kept_latency(folder: Path) -> float | None:
    """Return the latency with which the run in a folder drives, seconds; None without such a run."""
    if not (folder / IDENTITY_FILE).is_file():
        return None
    try:
        latency = RunIdentity.load(folder / IDENTITY_FILE).inputs.get("latency")
    except DocumentError:
        return None
    return latency if isinstance(latency, float) else None


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
