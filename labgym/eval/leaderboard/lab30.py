"""The published results of the suite lab30, of which the paper's tables are."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import ClassVar

from labgym.artefacts import artefacts
from labgym.documents import Document
from labgym.errors import DocumentError
from labgym.eval.driving.evaluation import TransitionEvaluation
from labgym.eval.driving.intervals import Estimate
from labgym.eval.driving.record import NavigationSummary

FOLDER = "leaderboard/lab30"
PLANNING = "planning_ms"


class Lab30Result(Document):
    """The published result of a policy.

    Attributes:
        summary: of its evaluation. planning: milliseconds per action, measured; None without.
    """

    SCHEMA: ClassVar[str] = "labgym.lab30-result/1"

    summary: NavigationSummary
    planning: Estimate | None = None

    @property
    def name(self) -> str:
        """Name of the policy."""
        return self.summary.policy

    @property
    def metrics(self) -> dict[str, Estimate]:
        """Metrics, and the planning time if it was measured."""
        return {**self.summary.metrics} | ({} if self.planning is None else {PLANNING: self.planning})


def published_lab30(order: Sequence[str] = ()) -> tuple[Lab30Result, ...]:
    """Return the published results: of some policies in their order, or all, those with the fewest contacts first.

    Raises:
        DocumentError: a file is broken.
    """
    paths = {path.stem: path for path in sorted((artefacts("eval") / FOLDER).glob("*.json"))}
    results = [Lab30Result.load(paths[name]) for name in order or paths if name in paths]
    return tuple(results if order else sorted(results, key=_rank))


def _rank(result: Lab30Result) -> tuple[float, float]:
    """Return the place of a result: by the share of episodes that succeeded without a contact, then by SPL."""
    free, spl = (result.metrics[name].value or 0.0 for name in ("collision_free", "spl"))
    return -free, -spl


def publish_lab30(folder: str | Path, place: Path | None = None) -> Path:
    """Write the result of an evaluation's folder among the published ones, and return its path.

    Args:
        folder: written by `labgym eval --suite lab30`. place: another folder to write to.

    Raises:
        DocumentError: the folder holds no evaluation, or its files contradict each other.
    """
    evaluation = TransitionEvaluation.read(folder)
    if evaluation.problems:
        raise DocumentError(folder, "", evaluation.problems[0])
    result = Lab30Result(summary=evaluation.summary, planning=evaluation.metrics.get(PLANNING))
    place = artefacts("eval") / FOLDER if place is None else place
    return result.save(place / f"{evaluation.name}.json")
