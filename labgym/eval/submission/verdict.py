"""The outcome of a check of a submission."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import islice

MOST = 20
"""Largest number of problems of one kind that are listed."""


@dataclass(frozen=True)
class Verdict:
    """The outcome of a check.

    Attributes:
        problems: a line for each failed check; empty if the submission passes.
        facts: a line for each check that was made or left out.
    """

    problems: tuple[str, ...]
    facts: tuple[str, ...]

    @property
    def passed(self) -> bool:
        """Whether there is no problem."""
        return not self.problems


def listed(problems: Iterable[str], kind: str) -> list[str]:
    """Return the first problems, and a line if there are more."""
    first = list(islice(problems, MOST + 1))
    return first if len(first) <= MOST else [*first[:MOST], f"more {kind} like these are not listed"]
