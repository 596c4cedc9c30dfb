"""The published results of LabNav: for each policy its summary and the outcome of every episode."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, ClassVar

from pydantic import Field

from labgym.artefacts import artefacts
from labgym.documents import Document, Record
from labgym.errors import DocumentError
from labgym.eval.driving.episode_row import Length, Share
from labgym.eval.driving.files import EPISODES, SUMMARY, read_lines
from labgym.eval.labnav.row import LabNavRow
from labgym.eval.labnav.rules import Ending
from labgym.eval.labnav.summary import LabNavSummary

FOLDER = "leaderboard/labnav"
DIGITS = 9
"""Decimal places of published scores and times."""


class Outcome(Record):
    """The outcome of an episode.

    Attributes:
        key: task, floor and number. score: of the episode. ending: how it ended. time: T, seconds.
    """

    key: Annotated[str, Field(max_length=200)]
    score: Share
    ending: Ending
    time: Length

    @classmethod
    def of(cls, row: LabNavRow) -> Outcome:
        """Return the outcome of a row."""
        return cls(key=row.key, score=round(row.score, DIGITS), ending=row.ending, time=round(row.time, DIGITS))


class LabNavResult(Document):
    """The published result of a policy.

    Attributes:
        summary: of its evaluation. outcomes: of all episodes, in the suite's order.
    """

    SCHEMA: ClassVar[str] = "labgym.labnav-result/1"

    summary: LabNavSummary
    outcomes: Annotated[tuple[Outcome, ...], Field(max_length=100_000)]

    @classmethod
    def of(cls, folder: str | Path) -> LabNavResult:
        """Return the result of an evaluation's folder.

        Raises:
            DocumentError: the folder holds no complete LabNav evaluation.
        """
        folder = Path(folder)
        summary = LabNavSummary.load(folder / SUMMARY)
        missing = [task for task in summary.tasks if task.episodes != task.expected]
        if missing:
            problem = f"holds {missing[0].episodes} of {missing[0].expected} episodes of {missing[0].task}"
            raise DocumentError(folder, "", f"{problem}; run the same labgym eval command again")
        return cls(summary=summary, outcomes=tuple(map(Outcome.of, read_rows(folder / EPISODES))))

    @property
    def by_key(self) -> dict[str, Outcome]:
        """The outcomes by the episode's key."""
        return {outcome.key: outcome for outcome in self.outcomes}


def read_rows(path: Path) -> tuple[LabNavRow, ...]:
    """Return the rows of a policy's file.

    Raises:
        DocumentError: it is missing, or a line cannot be read or repeats an episode.
    """
    return tuple(read_lines(path, LabNavRow).checked(path, path.name).values())


def published_results() -> tuple[LabNavResult, ...]:
    """Return the published results, the highest figure first.

    Raises:
        DocumentError: a file is broken.
    """
    results = [LabNavResult.load(path) for path in sorted((artefacts("eval") / FOLDER).glob("*.json"))]
    return tuple(sorted(results, key=lambda one: -_rank(one)))


def publish(folder: str | Path, place: Path | None = None) -> Path:
    """Write the result of an evaluation's folder among the published ones, and return its path.

    Args:
        folder: written by `labgym eval --suite labnav`. place: another folder to write to.

    Raises:
        DocumentError: the folder holds no complete LabNav evaluation.
    """
    result = LabNavResult.of(folder)
    place = artefacts("eval") / FOLDER if place is None else place
    return result.save(place / f"{result.summary.policy}.json")


def _rank(result: LabNavResult) -> float:
    if result.summary.labnav is not None and result.summary.labnav.value is not None:
        return result.summary.labnav.value
    scores: Sequence[float] = [task.score.value or 0.0 for task in result.summary.tasks]
    return sum(scores) / len(scores) if scores else 0.0
