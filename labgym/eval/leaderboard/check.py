"""Comparison of rows that a run drove with the published ones."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from labgym.eval.labnav.row import LabNavRow
from labgym.eval.leaderboard.labnav import Outcome

TOLERANCE = 1e-6
"""Greatest difference of equal scores and times."""
COMPARED_WHOLE = ("aisle", "moved", "people", "odometry", "dock", "glass", "carry")
"""Tasks whose drives in the small suite are the published ones; a shift there has fewer goals."""


@dataclass(frozen=True)
class Agreement:
    """How rows agree with the published ones.

    Attributes:
        equal, compared: number of rows. differing: a sentence for each row that differs.
    """

    equal: int
    compared: int
    differing: tuple[str, ...]


def agreement(rows: Iterable[LabNavRow], published: Mapping[str, Outcome], seconds: float) -> Agreement:
    """Return how rows agree with the published outcomes of the same episodes.

    Args:
        rows: driven with a time limit of `seconds`. published: outcomes by key, driven with a limit at least as long.
    """
    differing = []
    compared = 0
    for row in rows:
        expected = published.get(row.key)
        if expected is None or row.task not in COMPARED_WHOLE:
            continue
        compared += 1
        if not _equal(row, expected, seconds):
            differing.append(
                f"{row.policy}, {row.key}: {row.ending} after {row.time:g} s, score {row.score:.3f}; "
                f"published: {expected.ending} after {expected.time:g} s, score {expected.score:.3f}"
            )
    return Agreement(compared - len(differing), compared, tuple(differing))


def _equal(row: LabNavRow, expected: Outcome, seconds: float) -> bool:
    if expected.time > seconds + TOLERANCE:
        return abs(row.time - seconds) <= TOLERANCE and row.score == 0.0
    if abs(row.time - expected.time) > TOLERANCE or abs(row.score - expected.score) > TOLERANCE:
        return False
    # A robot that waited may count as frozen after the whole time only.
    return row.ending == expected.ending or {row.ending, expected.ending} == {"time", "frozen"}
