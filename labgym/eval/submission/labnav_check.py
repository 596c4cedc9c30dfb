"""The check of a LabNav submission: record, episodes, rows, routes and summary, and episodes driven again."""

from __future__ import annotations

import secrets
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tqdm import tqdm

from labgym.envs.labnav.episodes import LabNavEpisode, LabNavEpisodes
from labgym.errors import DocumentError, UnknownNameError
from labgym.eval.driving.drive import Route
from labgym.eval.driving.evaluation import in_one_line
from labgym.eval.driving.files import EPISODES, ROUTES, SUMMARY, TIMES, read_lines
from labgym.eval.driving.runner import catalog_digest
from labgym.eval.labnav.drive import drive_floor
from labgym.eval.labnav.evaluation import KIND, summary_differences
from labgym.eval.labnav.foresight import in_place, track_of
from labgym.eval.labnav.results import LabNavDrive
from labgym.eval.labnav.row import LabNavRoute, LabNavRow, LabNavTime
from labgym.eval.labnav.suites import LabNavSuite, load_labnav
from labgym.eval.labnav.summary import LabNavSummary
from labgym.eval.labnav.thinking import Thinking, time_problems
from labgym.eval.submission.labnav_rows import LabNavTerms, labnav_route_problems, labnav_row_problems
from labgym.eval.submission.record_checks import RunRecord, catalog_problems, run_problems, stated_problems
from labgym.eval.submission.second_drive import drawn_again, driven_again
from labgym.eval.submission.submitted_policy import PolicyChoice
from labgym.eval.submission.verdict import Verdict, completeness_problems, listed
from labgym.layouts import Layout
from labgym.policies.kernels import kernel_mode
from labgym.policies.process import PolicyProcess

MAX_BYTES = 1 << 30
"""Largest file of rows or routes that is read; the routes of a whole LabNav have 100 MB."""


@dataclass(frozen=True)
class LabNavSubmission:
    """A submission and the published suite that it claims.

    Attributes:
        summary, rows, routes: of the folder; rows and routes by key. suite: of this installation.
        episodes: of the suite, with their tasks, by key. layouts: floors by split and id.
        times: measured times of the policy, by key.
    """

    summary: LabNavSummary
    rows: dict[str, LabNavRow]
    routes: dict[str, Route]
    suite: LabNavSuite
    episodes: dict[str, tuple[LabNavEpisodes, LabNavEpisode]]
    layouts: dict[tuple[str, str], Layout]
    times: dict[str, LabNavTime]

    def layout(self, key: str) -> Layout:
        """Return the floor of an episode."""
        part, episode = self.episodes[key]
        return self.layouts[part.split, episode.floor]


def check_labnav(
    folder: Path,
    seed: int | None = None,
    suite: str | LabNavSuite | None = None,
    policy: str | None = None,
    options: Mapping[str, Any] | None = None,
    drive: bool = True,
    other_code: bool = False,
    progress: bool = True,
) -> Verdict:
    """Check the folder of a LabNav evaluation; the arguments are those of `check_submission`.

    `suite` may also be a suite that is not published.

    Raises:
        OptionError: `drive` is on, and the policy is not available or the processor cannot run the pinned kernels.
    """
    try:
        summary = LabNavSummary.load(folder / SUMMARY)
        published = suite if isinstance(suite, LabNavSuite) else load_labnav(suite or summary.suite)
        _check_sizes(folder)
    except (DocumentError, UnknownNameError) as error:
        return Verdict((str(error),), ())
    choice = PolicyChoice.of(summary, policy, options) if drive else None
    record = RunRecord.read(folder)
    rows, routes = read_lines(folder / EPISODES, LabNavRow), read_lines(folder / ROUTES, LabNavRoute)
    times = read_lines(folder / TIMES, LabNavTime)
    submission = LabNavSubmission(
        summary=summary,
        rows=rows.records,
        routes={key: route.poses for key, route in routes.records.items()},
        suite=published,
        episodes=published.by_key,
        times=times.records,
        layouts={(part.split, floor): part.layout(floor) for part in published.parts for floor in part.floors},
    )
    problems = [
        *run_problems(record, _identity_problems(record, submission), other_code),
        *listed((*rows.problems, *routes.problems, *times.problems), "problems of files"),
        *_suite_problems(submission),
        *listed(
            completeness_problems(
                submission.episodes, submission.rows, submission.routes, published.name, lambda key: key[:120]
            ),
            "episodes",
        ),
        *listed(_episode_problems(submission), "problems of episodes"),
        *listed(time_problems(submission.rows.values(), submission.times, summary.latency), "problems of times"),
        *_summary_problems(submission),
    ]
    facts = [f"{len(submission.rows)} of {published.count} episodes of suite {published.name} checked"]
    declared = summary.latency if summary.declared is None else summary.declared
    thinking = Thinking.of(submission.times.values(), declared, summary.latency)
    if thinking is not None and thinking.mark:
        facts.append(f"{summary.policy[:80]} {thinking.mark}")
    if choice is None:
        facts.append("no episode was driven again (--no-drive): the policy itself is not verified")
        return Verdict(tuple(problems), tuple(facts))
    seed = secrets.randbelow(2**32) if seed is None else seed
    keys = drawn_again(list(submission.episodes), seed)
    driver = PolicyProcess(choice.source, environment=kernel_mode("pinned").environment)
    try:
        stated = {
            "track": (track_of(driver), summary.track),
            "sensors": (driver.observation, summary.sensors),
            "latency": (driver.latency, declared),
        }
        problems += choice.problems(driver, stated, summary.policy, record)
        problems += listed(_drive_problems(driver, choice, submission, keys, progress), "episodes")
    finally:
        driver.close()
    facts.append(driven_again(len(keys), published.count, choice.name, seed))
    return Verdict(tuple(problems), tuple(facts))


def _check_sizes(folder: Path) -> None:
    for name in (EPISODES, ROUTES):
        path = folder / name
        if path.is_file() and path.stat().st_size > MAX_BYTES:
            raise DocumentError(path, "", f"is larger than {MAX_BYTES} bytes")


def _identity_problems(record: RunRecord, submission: LabNavSubmission) -> Iterator[str]:
    if record.identity is None:
        return
    summary = submission.summary
    expected = {
        "suite": summary.suite,
        "episodes": submission.suite.hash,
        "seed": summary.seed,
        "policy": summary.policy,
        "latency": summary.latency,
    }
    yield from stated_problems(record.identity, KIND, expected)
    yield from catalog_problems(record.identity, catalog_digest(submission.layouts.values()))


def _suite_problems(submission: LabNavSubmission) -> Iterator[str]:
    summary, suite = submission.summary, submission.suite
    if summary.hash != suite.hash:
        yield f"{SUMMARY}: its episodes have the hash {summary.hash[:12]!r}, those of {suite.name} {suite.hash[:12]!r}"
    expected = {part.label: len(part.episodes) for part in suite.parts}
    claimed = {task.suite: task.expected for task in summary.tasks}
    if claimed != expected:
        words = in_one_line(sorted(f"{name[:80]}: {claimed.get(name)}" for name in {**claimed, **expected})[:5])
        yield f"{SUMMARY} does not have the tasks and numbers of episodes of suite {suite.name} ({words})"


def _episode_problems(submission: LabNavSubmission) -> Iterator[str]:
    summary = submission.summary
    terms = LabNavTerms(summary.policy, summary.seed, summary.track, submission.suite.seconds, summary.latency)
    for key, (part, episode) in submission.episodes.items():
        row = submission.rows.get(key)
        if row is None:
            continue
        problems = list(labnav_row_problems(row, part, episode, terms))
        if key in submission.routes:
            problems += labnav_route_problems(row, submission.routes[key], part, episode, submission.layout(key))
        yield from (f"episode {key}: {problem}" for problem in problems)


def _summary_problems(submission: LabNavSubmission) -> Iterator[str]:
    if submission.rows:
        recomputed = submission.summary.recomputed(tuple(submission.rows.values()))
        names = summary_differences(submission.summary, recomputed)
        if names:
            yield f"{SUMMARY} does not match the rows in {in_one_line(name[:80] for name in names[:10])}"


def _drive_problems(
    driver: PolicyProcess, choice: PolicyChoice, submission: LabNavSubmission, keys: Sequence[str], progress: bool
) -> Iterator[str]:
    """Drive episodes again and yield a sentence for each whose row or route differs."""
    summary, suite = submission.summary, submission.suite
    groups: dict[tuple[str, str], list[str]] = {}
    for key in keys:
        groups.setdefault((key.split("/")[0], key.split("/")[-2]), []).append(key)
    policy = in_place(driver, choice.source)
    with tqdm(total=len(keys), desc="drive again", unit="ep", disable=not progress) as bar:
        for group in groups.values():
            part = submission.episodes[group[0]][0]
            for drive in drive_floor(
                policy,
                submission.layout(group[0]),
                [submission.episodes[key][1] for key in group],
                part.task,
                part.level,
                summary.policy,
                part.label,
                summary.seed,
                suite.seconds,
                latency=summary.latency,
            ):
                bar.update()
                yield from _differences(drive, submission)


def _differences(drive: LabNavDrive, submission: LabNavSubmission) -> Iterator[str]:
    key = drive.row.key
    row, route = submission.rows.get(key), submission.routes.get(key)
    if row is None or route is None:
        return  # reported as missing
    fields = [name for name in LabNavRow.model_fields if getattr(row, name) != getattr(drive.row, name)]
    if fields:
        shown = ", ".join(f"{name} {_text(row, name)}, now {_text(drive.row, name)}" for name in fields[:3])
        more = f" and {len(fields) - 3} more" if len(fields) > 3 else ""
        yield f"episode {key} driven again differs: {shown}{more}"
    elif route != drive.route:
        steps = zip(route, drive.route, strict=False)
        step = next((number for number, (a, b) in enumerate(steps) if a != b), min(len(route), len(drive.route)))
        yield f"episode {key} driven again has another route from step {step}"


def _text(row: LabNavRow, name: str) -> str:
    value = getattr(row, name)
    return f"{value:.6g}" if isinstance(value, float) else str(value)[:60]
