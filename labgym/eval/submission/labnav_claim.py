"""A submission of LabNav and the suite that it claims."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from labgym.errors import DocumentError
from labgym.eval.driving.drive import LabNavDrive
from labgym.eval.driving.episode_row import LabNavRow
from labgym.eval.driving.evaluation import in_one_line
from labgym.eval.driving.files import SUMMARY, TIMES, EpisodeTime
from labgym.eval.driving.runner import catalog_digest
from labgym.eval.labnav.drive import drive_floor
from labgym.eval.labnav.evaluation import LabNavEvaluation, Thinking, time_problems
from labgym.eval.labnav.foresight import track_of
from labgym.eval.labnav.latency import is_accepted, probe
from labgym.eval.labnav.results import DriveTerms
from labgym.eval.labnav.suites import LabNavSuite, load_labnav
from labgym.eval.labnav.summary import LabNavSummary
from labgym.eval.submission.claim import Claim, listed
from labgym.eval.submission.record_checks import RunRecord, box_problems, catalog_problems, stated_problems
from labgym.policies import Policy
from labgym.policies.process import PolicyProcess, PolicySource
from labgym.policies.process.facts import MAX_LATENCY


class LabNavClaim(Claim[LabNavSummary, LabNavRow]):
    """A submission of LabNav.

    Args:
        folder: of the submission. suite: the suite, if not the published one of the submission's name.

    Raises:
        DocumentError, UnknownNameError: the summary cannot be read, or there is no such suite.
    """

    def __init__(self, folder: Path, suite: str | LabNavSuite | None) -> None:
        summary = LabNavSummary.load(folder / SUMMARY)
        if not 0.0 <= summary.latency <= MAX_LATENCY:
            raise DocumentError(folder / SUMMARY, "latency", f"is {summary.latency:g} s, expected 0 to {MAX_LATENCY:g}")
        self._suite = suite if isinstance(suite, LabNavSuite) else load_labnav(suite or summary.suite)
        self._episodes = self._suite.by_key
        self._layouts = {(part.split, floor): part.layout(floor) for part in self._suite.parts for floor in part.floors}
        super().__init__(folder, summary, self._suite.name, list(self._episodes), LabNavRow)
        self._times: dict[str, EpisodeTime] = {record.key: record for _, record in self._records(TIMES, EpisodeTime)}

    def identity_problems(self, record: RunRecord) -> Iterator[str]:
        """Yield a sentence for each input of the run that is not the summary's or the suite's."""
        if record.identity is None:
            return
        summary = self.summary
        expected = {
            "suite": summary.suite,
            "episodes": self._suite.hash,
            "seed": summary.seed,
            "policy": summary.policy,
            "latency": summary.latency,
        }
        yield from stated_problems(record.identity, LabNavEvaluation.KIND, expected)
        yield from box_problems(record.identity, summary.box)
        yield from catalog_problems(record.identity, catalog_digest(self._layouts.values()))

    def suite_problems(self) -> Iterator[str]:
        """Yield a sentence for each way in which the claimed suite differs from that of this installation."""
        summary, suite = self.summary, self._suite
        if summary.hash != suite.hash:
            own = f"those of {suite.name} {suite.hash[:12]!r}"
            yield f"{SUMMARY}: its episodes have the hash {summary.hash[:12]!r}, {own}"
        expected = {part.label: len(part.episodes) for part in suite.parts}
        claimed = {task.suite: task.expected for task in summary.tasks}
        if claimed != expected:
            words = in_one_line(sorted(f"{name[:80]}: {claimed.get(name)}" for name in {**claimed, **expected})[:5])
            yield f"{SUMMARY} does not have the tasks and numbers of episodes of suite {suite.name} ({words})"

    def summary_problems(self, record: RunRecord) -> Iterator[str]:
        """Yield a sentence for each measured time and each figure of the summary that the rows contradict."""
        problems = time_problems(self.rows.values(), self._times, self.summary.latency)
        yield from listed(problems, "problems of times")
        yield from super().summary_problems(record)

    def facts(self) -> Iterator[str]:
        """Yield further facts, and that the policy thinks longer than it declares, if so."""
        yield from super().facts()
        thinking = Thinking.of(self._times.values(), self.summary.stated_latency, self.summary.latency)
        if thinking is not None and thinking.mark:
            yield f"{self.summary.policy[:80]} {thinking.mark}"

    def measured_again(self, driver: PolicyProcess, source: PolicySource, seed: int) -> tuple[bool, str] | None:
        """Return whether the policy's time, measured again, allows its latency; None if it is built in."""
        if source.built_in:
            return None
        frozen, measured = self.summary.latency, probe(driver, source, self._suite, seed)
        if measured is None:
            return True, "the policy gives no action in the first episodes: its time was not measured again"
        latency = measured.latency(driver.latency)
        accepted, words = is_accepted(latency, frozen), f"measured again, the policy takes {measured}: {latency:g} s"
        limit = "within one control step of" if accepted else "more than one control step above"
        return accepted, f"{words} late, {limit} the {frozen:g} s with which it drove"

    def stated(self, driver: PolicyProcess) -> dict[str, tuple[object, object]]:
        """Return properties of the policy, and what the submission says of them."""
        return {
            "track": (track_of(driver), self.summary.track),
            "sensors": (driver.observation, self.summary.sensors),
            "latency": (driver.latency, self.summary.stated_latency),
        }

    def drive(self, driver: PolicyProcess | Policy, key: str, blind: bool = False) -> LabNavDrive:
        """Drive an episode again and return the results; see `Claim.drive`."""
        summary, (part, episode) = self.summary, self._episodes[key]
        terms = DriveTerms.of(part, summary.policy, summary.seed, self._suite.seconds, summary.latency)
        layout = self._layouts[part.split, episode.floor]
        (drive,) = drive_floor(driver, layout, [episode], terms, blind=blind)
        # What the policy knew is no part of a simulation.
        return replace(drive, row=drive.row.model_copy(update={"track": summary.track})) if blind else drive
