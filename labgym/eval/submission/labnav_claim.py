"""A submission of LabNav and the suite that it claims."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from labgym.errors import DocumentError
from labgym.eval.driving.drive import Route
from labgym.eval.driving.evaluation import in_one_line
from labgym.eval.driving.files import EPISODES, ROUTES, SUMMARY, TIMES, read_lines
from labgym.eval.driving.runner import catalog_digest
from labgym.eval.labnav.drive import drive_floor
from labgym.eval.labnav.evaluation import KIND, summary_differences
from labgym.eval.labnav.foresight import track_of
from labgym.eval.labnav.results import LabNavDrive
from labgym.eval.labnav.row import LabNavRoute, LabNavRow, LabNavTime
from labgym.eval.labnav.suites import LabNavSuite, load_labnav
from labgym.eval.labnav.summary import LabNavSummary
from labgym.eval.labnav.thinking import Thinking, time_problems
from labgym.eval.submission.claim import Claim
from labgym.eval.submission.labnav_rows import LabNavTerms, labnav_route_problems, labnav_row_problems
from labgym.eval.submission.record_checks import RunRecord, catalog_problems, stated_problems
from labgym.eval.submission.verdict import listed
from labgym.layouts import Layout
from labgym.policies import Policy
from labgym.policies.process import PolicyProcess

MAX_BYTES = 1 << 30
"""Largest file of rows or routes that is read; the routes of a whole LabNav have 100 MB."""


class LabNavClaim(Claim[str]):
    """A submission of LabNav.

    Args:
        folder: of the submission. suite: the suite, if not the published one of the submission's name.

    Raises:
        DocumentError, UnknownNameError: the summary cannot be read, a file is too large, or there is no such suite.
    """

    summary: LabNavSummary

    def __init__(self, folder: Path, suite: str | LabNavSuite | None) -> None:
        self.summary = LabNavSummary.load(folder / SUMMARY)
        self._suite = suite if isinstance(suite, LabNavSuite) else load_labnav(suite or self.summary.suite)
        _check_sizes(folder)
        rows, routes = read_lines(folder / EPISODES, LabNavRow), read_lines(folder / ROUTES, LabNavRoute)
        times = read_lines(folder / TIMES, LabNavTime)
        self.rows: dict[str, LabNavRow] = rows.records
        self._routes: dict[str, Route] = {key: route.poses for key, route in routes.records.items()}
        self._times = times.records
        self.file_problems = (*rows.problems, *routes.problems, *times.problems)
        self.suite_name, self._episodes = self._suite.name, self._suite.by_key
        self.keys = list(self._episodes)
        self._layouts = {(part.split, floor): part.layout(floor) for part in self._suite.parts for floor in part.floors}

    @property
    def routes(self) -> Mapping[str, Route]:
        """The routes by key."""
        return self._routes

    @property
    def declared(self) -> float:
        """Latency that the policy declares by the submission, seconds."""
        summary = self.summary
        return summary.latency if summary.declared is None else summary.declared

    def route(self, key: str) -> Route:
        """Return the poses of a route."""
        return self._routes[key]

    def name_of(self, key: str) -> str:
        """Return the name of an episode."""
        return key[:120]

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
        yield from stated_problems(record.identity, KIND, expected)
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

    def episode_problems(self) -> Iterator[str]:
        """Yield a sentence for each contradiction in a row, and between a row and its route."""
        summary = self.summary
        terms = LabNavTerms(summary.policy, summary.seed, summary.track, self._suite.seconds, summary.latency)
        for key, (part, episode) in self._episodes.items():
            row = self.rows.get(key)
            if row is None:
                continue
            problems = list(labnav_row_problems(row, part, episode, terms))
            if key in self.routes:
                problems += labnav_route_problems(row, self.routes[key], part, episode, self._layout(key))
            yield from (f"episode {key}: {problem}" for problem in problems)

    def summary_problems(self, record: RunRecord) -> Iterator[str]:  # noqa: ARG002
        """Yield a sentence for each measured time and each figure of the summary that the rows contradict."""
        rows = tuple(self.rows.values())
        yield from listed(time_problems(rows, self._times, self.summary.latency), "problems of times")
        names = summary_differences(self.summary, self.summary.recomputed(rows)) if rows else []
        if names:
            yield f"{SUMMARY} does not match the rows in {in_one_line(name[:80] for name in names[:10])}"

    def facts(self) -> Iterator[str]:
        """Yield that the policy thinks longer than it declares, if so."""
        thinking = Thinking.of(self._times.values(), self.declared, self.summary.latency)
        if thinking is not None and thinking.mark:
            yield f"{self.summary.policy[:80]} {thinking.mark}"

    def stated(self, driver: PolicyProcess) -> dict[str, tuple[object, object]]:
        """Return properties of the policy, and what the submission says of them."""
        return {
            "track": (track_of(driver), self.summary.track),
            "sensors": (driver.observation, self.summary.sensors),
            "latency": (driver.latency, self.declared),
        }

    def driven(self, driver: PolicyProcess | Policy, keys: Sequence[str]) -> Iterator[tuple[str, LabNavDrive]]:
        """Drive episodes again and yield each with its key."""
        summary = self.summary
        groups: dict[tuple[str, str], list[str]] = {}
        for key in keys:
            groups.setdefault((key.split("/")[0], key.split("/")[-2]), []).append(key)
        for group in groups.values():
            part = self._episodes[group[0]][0]
            drives = drive_floor(
                driver,
                self._layout(group[0]),
                [self._episodes[key][1] for key in group],
                part.task,
                part.level,
                summary.policy,
                part.label,
                summary.seed,
                self._suite.seconds,
                latency=summary.latency,
            )
            yield from zip(group, drives, strict=True)

    def _layout(self, key: str) -> Layout:
        """Return the floor of an episode."""
        part, episode = self._episodes[key]
        return self._layouts[part.split, episode.floor]


def _check_sizes(folder: Path) -> None:
    for name in (EPISODES, ROUTES):
        path = folder / name
        if path.is_file() and path.stat().st_size > MAX_BYTES:
            raise DocumentError(path, "", f"is larger than {MAX_BYTES} bytes")
