"""`summary.json`: the results of an evaluation, without values that differ between equal runs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar, Self

from labgym.documents import Document
from labgym.eval.driving.episode_row import EpisodeRow
from labgym.eval.driving.intervals import Estimate
from labgym.eval.driving.navigation_metrics import VERSION, summarise
from labgym.policies.policy import Sensors
from labgym.suites import Suite


class NavigationSummary(Document):
    """`summary.json`: one policy over one suite. It is computed from the rows alone.

    Attributes:
        suite: the whole suite with its version.
        policy: label of the policy. options: its arguments. privileged: whether it received the true map.
        sensors: the policy's observation.
        seed: random seed of the evaluation.
        layouts: hashes by layout id, in the suite's order.
        episodes: number of rows. expected: number of episodes of the suite.
        errors: episodes in which the policy raised an exception. unreachable: episodes without a path (no SPL).
        complete: whether every episode was driven.
        metrics: estimates by name, in the order of `navigation_metrics.METRICS`; planning times are not among them.
        definitions: version of the metrics' definitions.
    """

    SCHEMA: ClassVar[str] = "labgym.navigation-summary/2"

    suite: Suite
    policy: str
    options: dict[str, Any]
    privileged: bool
    sensors: Sensors | None = None
    seed: int
    layouts: dict[str, str]
    episodes: int
    expected: int
    errors: int
    unreachable: int
    complete: bool
    metrics: dict[str, Estimate]
    definitions: str = "navigation-v1"

    def recomputed(self, rows: Sequence[EpisodeRow]) -> Self:
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
