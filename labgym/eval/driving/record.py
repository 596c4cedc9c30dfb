"""`summary.json`: the results of an evaluation, without values that differ between equal runs."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Self

from pydantic import Field

from labgym.documents import Document, Growing
from labgym.eval.driving.episode_row import TransitionRow
from labgym.eval.driving.files import EPISODES, SUMMARY
from labgym.eval.driving.intervals import Estimate
from labgym.eval.driving.navigation_metrics import VERSION, summarise
from labgym.policies.policy import Sensors
from labgym.policies.process.box import BUILT_IN_CODE, LONGEST_LEVEL
from labgym.suites import Suite

COMPARED = ("episodes", "errors", "unreachable", "complete")
"""Figures of a summary that the rows must give, in addition to the metrics."""


class EvaluationSummary(Document):
    """Base of the summaries of all suites; each kind declares the fields itself, as `EpisodeRow` explains.

    Attributes:
        policy: label of the policy. options: its arguments. seed: random seed of the evaluation.
        box: level of the box in which it drove.
    """

    if TYPE_CHECKING:
        policy: str
        box: str
        options: dict[str, Any]
        seed: int

    @abstractmethod
    def recomputed(self, rows: Sequence[Any]) -> EvaluationSummary:
        """Return the summary with every figure computed from rows."""

    @abstractmethod
    def differences(self, recomputed: Any, exactly: bool) -> list[str]:
        """Return the figures in which the summary differs from that of the rows.

        Args:
            exactly: whether the same code computed both, so that intervals are equal too.
        """

    @abstractmethod
    def incomplete(self, rows: Sequence[Any]) -> list[str]:
        """Return a sentence if rows are missing, and one if some do not belong to the suite."""


class NavigationSummary(EvaluationSummary, Growing):
    """`summary.json`: one policy over one suite. It is computed from the rows alone.

    Attributes:
        suite: the whole suite with its version.
        policy: label of the policy. options: its arguments. privileged: whether it received the true map.
        sensors: the policy's observation. box: level of the box in which it drove.
        seed: random seed of the evaluation.
        layouts: hashes by layout id, in the suite's order.
        episodes: number of rows. expected: number of episodes of the suite.
        errors: episodes in which the policy raised an exception. unreachable: episodes without a path (no SPL).
        complete: whether every episode was driven.
        metrics: estimates by name, in the order of `navigation_metrics.METRICS`; planning times are not among them.
        definitions: version of the metrics' definitions.
    """

    SCHEMA: ClassVar[str] = "labgym.navigation-summary/2"
    ADDED: ClassVar[frozenset[str]] = frozenset({"box"})

    suite: Suite
    policy: str
    options: dict[str, Any]
    privileged: bool
    sensors: Sensors | None = None
    box: Annotated[str, Field(max_length=LONGEST_LEVEL)] = BUILT_IN_CODE
    seed: int
    layouts: dict[str, str]
    episodes: int
    expected: int
    errors: int
    unreachable: int
    complete: bool
    metrics: dict[str, Estimate]
    definitions: str = "navigation-v1"

    def recomputed(self, rows: Sequence[TransitionRow]) -> Self:
        """Return the summary with every figure computed from rows."""
        figures = {
            "episodes": len(rows),
            "errors": sum(row.error is not None for row in rows),
            "unreachable": sum(row.shortest_path_length is None for row in rows),
            "complete": len(rows) == self.expected,
            "metrics": summarise(rows, self.suite.metrics),
            "definitions": VERSION,
        }
        return self.model_copy(update=figures)

    def differences(self, recomputed: Self, exactly: bool) -> list[str]:
        """Return the figures and metrics in which the summary differs from that of the rows."""
        names = [name for name in COMPARED if getattr(self, name) != getattr(recomputed, name)]
        metrics = {**recomputed.metrics, **self.metrics}
        return names + [
            name for name in metrics if not _agree(self.metrics.get(name), recomputed.metrics.get(name), exactly)
        ]

    def incomplete(self, rows: Sequence[TransitionRow]) -> list[str]:
        """Return a sentence if rows are missing, and one if some are of other layouts."""
        problems = []
        if not self.complete:
            problems.append(f"{EPISODES} holds {len(rows)} of {self.expected} episodes; the others are left out")
        foreign = {row.layout for row in rows if self.layouts.get(row.layout) != row.layout_hash}
        if foreign:
            names = ", ".join(sorted(foreign)[:5])
            problems.append(f"{EPISODES} has rows of layouts that are not in {SUMMARY}: {names}")
        return problems


def _agree(one: Estimate | None, other: Estimate | None, exactly: bool) -> bool:
    if one is None or other is None:
        return not exactly  # another version has other metrics
    if exactly:
        return one == other
    counts = (one.count, one.nulls) == (other.count, other.nulls)
    if one.value is None or other.value is None:
        return counts and one.value is other.value
    return counts and abs(one.value - other.value) <= 1e-9 * max(1.0, abs(other.value))
