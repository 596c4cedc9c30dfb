"""The published results of LabNav: for each policy its summary and the outcome of every episode."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, ClassVar

from pydantic import Field

from labgym.artefacts import artefacts
from labgym.documents import Document, Growing, Record
from labgym.envs.conditions.payload import MOST_LEGS
from labgym.envs.labnav.task import leg_score
from labgym.envs.labnav.tasks import task_of
from labgym.errors import DocumentError, OptionError
from labgym.eval.driving.episode_row import Ending, LabNavLegRow, LabNavRow, Length, Share
from labgym.eval.driving.evaluation import sessions_of
from labgym.eval.driving.files import EPISODES, SUMMARY, TIMES, EpisodeTime, read_records
from labgym.eval.labnav.evaluation import Thinking, time_problems
from labgym.eval.labnav.figure import arithmetic, figure
from labgym.eval.labnav.suites import PREFIX, LabNavSuite, load_labnav
from labgym.eval.labnav.summary import LabNavSummary, TaskSummary
from labgym.eval.leaderboard.receipts import SAME, has_alarm, published_rounds
from labgym.policies.process.box import is_rankable
from labgym.runs.provenance import RunProvenance

FOLDER = "leaderboard/labnav"
DIRTY = "-dirty"
"""End of a commit whose checkout had changes."""
DIGITS = 9
"""Decimal places of published scores and times."""


class LegOutcome(Record):
    """The outcome of a drive of a shift.

    Attributes:
        score: its share of the shift's score, times the number of drives. ending: how it ended. time: seconds.
    """

    score: Share
    ending: Ending
    time: Length

    @classmethod
    def of(cls, leg: LabNavLegRow) -> LegOutcome:
        """Return the outcome of a drive."""
        score = leg_score(leg.success, leg.docked, leg.shortest, leg.path_length)
        return cls(score=round(score, DIGITS), ending=leg.ending, time=round(leg.time, DIGITS))


class Outcome(Growing):
    """The outcome of an episode.

    Attributes:
        key: task, floor and number. score: of the episode. ending: how it ended. time: T, seconds.
        legs: in `shift`, of the drives that were begun.
    """

    ADDED: ClassVar[frozenset[str]] = frozenset({"legs"})

    key: Annotated[str, Field(max_length=200)]
    score: Share
    ending: Ending
    time: Length
    legs: Annotated[tuple[LegOutcome, ...], Field(max_length=MOST_LEGS)] = ()

    @classmethod
    def of(cls, row: LabNavRow) -> Outcome:
        """Return the outcome of a row."""
        return cls(
            key=row.key,
            score=round(row.score, DIGITS),
            ending=row.ending,
            time=round(row.time, DIGITS),
            legs=tuple(map(LegOutcome.of, row.legs)),
        )


def commits_of(sessions: Iterable[RunProvenance]) -> tuple[str, ...]:
    """Return the commits of the checkouts in which sessions ran, each once and marked if it had changes."""
    known = (each for each in sessions if each.commit is not None)
    return tuple(dict.fromkeys(f"{each.commit}{DIRTY if each.dirty else ''}" for each in known))


class LabNavResult(Document, Growing):
    """The published result of a policy.

    Attributes:
        summary: of its evaluation. outcomes: of all episodes, in the suite's order.
        commits: of the checkouts in which each task was driven, by its suite; "-dirty" follows a commit with changes.
        thinking: the measured time of the policy, by suite of the task; empty for results from before it was kept.
    """

    SCHEMA: ClassVar[str] = "labgym.labnav-result/1"
    ADDED: ClassVar[frozenset[str]] = frozenset({"thinking"})

    summary: LabNavSummary
    outcomes: Annotated[tuple[Outcome, ...], Field(max_length=100_000)]
    commits: dict[str, tuple[str, ...]] = Field(default_factory=dict)
    thinking: dict[str, Thinking] = Field(default_factory=dict)

    @classmethod
    def of(cls, folder: str | Path) -> LabNavResult:
        """Return the result of an evaluation's folder.

        Raises:
            DocumentError: the folder holds no complete LabNav evaluation, or not the measured times of all episodes.
        """
        folder = Path(folder)
        summary = LabNavSummary.load(folder / SUMMARY)
        missing = [task for task in summary.tasks if task.episodes != task.expected]
        if missing:
            problem = f"holds {missing[0].episodes} of {missing[0].expected} episodes of {missing[0].task}"
            raise DocumentError(folder, "", f"{problem}; run the same labgym eval command again")
        rows = tuple(read_records(folder / EPISODES, LabNavRow).values())
        times = read_records(folder / TIMES, EpisodeTime)
        for problem in time_problems(rows, times, summary.latency):
            raise DocumentError(folder, "", f"{problem}: without it the result is not published; drive it again")
        thinking = {
            part.suite: Thinking.of(
                (times[row.key] for row in rows if (row.task, row.level) == (part.task, part.level)),
                summary.stated_latency,
                summary.latency,
            )
            for part in summary.tasks
        }
        commits = commits_of(sessions_of(folder))
        return cls(
            summary=summary,
            thinking={suite: one for suite, one in thinking.items() if one is not None},
            outcomes=tuple(map(Outcome.of, rows)),
            commits={task.suite: commits for task in summary.tasks} if commits else {},
        )

    def joined(self, other: LabNavResult) -> LabNavResult:
        """Return the result of the tasks of both; where both have a task, that of `other` counts.

        With all eight tasks it has the figure LabNav.

        Raises:
            OptionError: the results are of other policies, options, random seeds or suites, or one has not all episodes
                of its tasks.
        """
        for name in SAME:
            mine, theirs = (getattr(each.summary, name) for each in (self, other))
            if mine != theirs:
                policy = other.summary.policy
                raise OptionError(f"{policy} is published with {name} {mine!r}, and this result has {theirs!r}")
        suite = _suite_of((*self.summary.tasks, *other.summary.tasks))
        tasks = {task.suite: task for task in (*self.summary.tasks, *other.summary.tasks)}
        order = [part.label for part in suite.parts]
        parts = tuple(tasks[label] for label in order if label in tasks)
        outcomes = {**self.by_key, **other.by_key}
        keys = suite.by_key
        whole = len(parts) == len(suite.parts) and suite.figure
        scores: dict[str, list[tuple[str, float]]] = {part.task: [] for part in parts}
        for key in keys:
            if key in outcomes:
                scores[key.partition("-")[0]].append((key.split("/")[-2], outcomes[key].score))
        summary = other.summary.model_copy(
            update={
                "suite": suite.name,
                "hash": suite.hash,
                "tasks": parts,
                "labnav": figure(scores) if whole else None,
                "arithmetic": arithmetic([part.score.value or 0.0 for part in parts]) if whole else None,
            }
        )
        commits, thinking = {**self.commits, **other.commits}, {**self.thinking, **other.thinking}
        return LabNavResult(
            summary=summary,
            outcomes=tuple(outcomes[key] for key in keys if key in outcomes),
            commits={label: commits[label] for label in order if label in commits},
            thinking={label: thinking[label] for label in order if label in thinking},
        )

    @property
    def mark(self) -> str:
        """The mark of a policy that thinks longer than it declares, in the task in which it took longest; else ""."""
        marked = [one for one in self.thinking.values() if one.mark]
        return max(marked, key=lambda one: one.seconds).mark if marked else ""

    @property
    def by_key(self) -> dict[str, Outcome]:
        """The outcomes by the episode's key."""
        return {outcome.key: outcome for outcome in self.outcomes}


def published_results() -> tuple[LabNavResult, ...]:
    """Return the published results, the highest figure first.

    Those that are not ranked come last: not boxed, or with an alarm on fresh floors.

    Raises:
        DocumentError: a file is broken.
    """
    results = [LabNavResult.load(path) for path in sorted((artefacts("eval") / FOLDER).glob("*.json"))]
    rounds = published_rounds()

    def rank(one: LabNavResult) -> tuple[bool, bool, float]:
        unranked = not is_rankable(one.summary.box) or has_alarm(one.summary, rounds)
        return unranked, one.summary.labnav is None, -(one.summary.headline.value or 0.0)

    return tuple(sorted(results, key=rank))


def publish(folder: str | Path, place: Path | None = None) -> Path:
    """Write the result of an evaluation's folder among the published ones, and return its path.

    Tasks that the policy has there stay unless the folder has them, too.

    Args:
        folder: written by `labgym eval --suite labnav`, or of one of its tasks.
        place: another folder to write to.

    Raises:
        DocumentError: the folder holds no complete LabNav evaluation.
        OptionError: the result is not of whole tasks of the suite labnav, or that of the policy is of other options.
    """
    result = LabNavResult.of(folder)
    _suite_of(result.summary.tasks)
    place = artefacts("eval") / FOLDER if place is None else place
    path = place / f"{result.summary.policy}.json"
    if path.is_file():
        result = LabNavResult.load(path).joined(result)
    return result.save(path)


def _suite_of(tasks: Sequence[TaskSummary]) -> LabNavSuite:
    """Return the suite labnav, of which tasks are whole parts.

    Raises:
        OptionError: a task does not belong to it, such as one of floors-val, of another level or of the small suite.
    """
    suite = load_labnav(PREFIX)
    counts = {part.label: len(part.episodes) for part in suite.parts}
    for task in tasks:
        if counts.get(task.suite) != task.episodes:
            raise OptionError(
                f"{task.suite} with {task.episodes} episodes is no part of the suite {PREFIX}: results of "
                f"{', '.join(counts)} are published, of {max(counts.values())} episodes each"
            )
    return suite


TOLERANCE = 1e-6
"""Greatest difference of equal scores and times."""


@dataclass(frozen=True)
class Agreement:
    """How rows agree with the published ones.

    Attributes:
        equal, compared: number of rows. differing: a sentence for each row that differs.
        missing: tasks of rows that could not be compared: not published, or a shift without its drives.
    """

    equal: int
    compared: int
    differing: tuple[str, ...]
    missing: tuple[str, ...] = ()


def agreement(rows: Iterable[LabNavRow], published: Mapping[str, Outcome], seconds: float) -> Agreement:
    """Return how rows agree with the published outcomes of the same episodes.

    A shift may have fewer goals than the published one: its drives are compared, up to the first one that the shorter
    limit cuts off. Its score is of fewer drives and is not compared.

    Args:
        rows: driven with a time limit of `seconds`. published: outcomes by key, driven with a limit at least as long.
    """
    differing = []
    missing: dict[str, None] = {}
    compared = 0
    for row in rows:
        expected, chain = published.get(row.key), task_of(row.task).chain
        if expected is None or (chain and not expected.legs):
            missing[row.task] = None
            continue
        compared += 1
        if not (_equal_legs if chain else _equal)(row, expected, seconds):
            here, there = _words(Outcome.of(row), row.goals), _words(expected, row.goals)
            differing.append(f"{row.policy}, {row.key}: {here}; published: {there}")
    return Agreement(compared - len(differing), compared, tuple(differing), tuple(missing))


def _equal(row: LabNavRow, expected: Outcome, seconds: float) -> bool:
    if _near(row, expected):
        # A robot that waited may count as frozen after the whole time only.
        return row.ending == expected.ending or {row.ending, expected.ending} == {"time", "frozen"}
    cut = expected.time >= seconds - TOLERANCE
    return cut and abs(row.time - seconds) <= TOLERANCE and row.score == 0.0


def _equal_legs(row: LabNavRow, expected: Outcome, seconds: float) -> bool:
    legs = tuple(map(LegOutcome.of, row.legs))
    for leg, other in zip(legs, expected.legs, strict=False):
        if leg.ending != other.ending or not _near(leg, other):
            # The robot is braked after the limit: what follows differs from the published shift.
            return other.time >= seconds - TOLERANCE and leg.time >= seconds - TOLERANCE and leg.score == 0.0
    return len(legs) == min(row.goals, len(expected.legs))


def _near(a: LabNavRow | Outcome | LegOutcome, b: Outcome | LegOutcome) -> bool:
    return abs(a.time - b.time) <= TOLERANCE and abs(a.score - b.score) <= TOLERANCE


def _words(outcome: Outcome, goals: int = 1) -> str:
    """Return an outcome in words, that of a shift by its first drives."""
    parts = outcome.legs[:goals] if outcome.legs else (outcome,)
    return ", ".join(f"{each.ending} after {each.time:g} s, score {each.score:.3f}" for each in parts)
