"""Comparison of rows that a run drove with the published ones."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from labgym.envs.labnav.tasks import task_of
from labgym.eval.driving.episode_row import LabNavRow
from labgym.eval.leaderboard.labnav import LegOutcome, Outcome

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
