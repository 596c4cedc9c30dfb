"""Tables of results: layout metrics, navigation metrics and the leaderboard."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any, Protocol

from labgym.eval.driving.evaluation import Evaluation
from labgym.eval.driving.intervals import Estimate, estimate_text
from labgym.eval.driving.navigation_metrics import METRICS
from labgym.eval.driving.record import EvaluationSummary, NavigationSummary
from labgym.eval.labnav.evaluation import LabNavEvaluation
from labgym.eval.labnav.summary import summary_table
from labgym.eval.reports.paper import paper
from labgym.eval.scoring.layout_report import COLUMNS, LayoutSummary
from labgym.layouts.rules.rule_sets import PAPER
from labgym.policies.process.box import UNRANKED, is_rankable
from labgym.table import Table, number

LAYOUT_COLUMNS = tuple((name, column.heading, column.digits) for name, column in COLUMNS.items() if column.paper)
"""Layout metrics in the paper's order: field of the report, heading, number of digits."""
OWN_COLUMNS = tuple(
    (name, column.heading, column.digits)
    for name, column in COLUMNS.items()
    if column.heading and not (column.paper or column.judged)
)
"""Further layout metrics of the rule set `touchstone`."""
SEMANTIC_COLUMNS = tuple((name, column.heading, column.digits) for name, column in COLUMNS.items() if column.judged)
"""Scores of a vision-language model, in tables of layouts that one has judged."""


def layout_columns(rules: Sequence[str]) -> tuple[tuple[str, str, int], ...]:
    """Return the columns of a table of layouts that were scored under some rule sets."""
    return LAYOUT_COLUMNS if PAPER.name in rules else (*LAYOUT_COLUMNS, *OWN_COLUMNS)


PLANNING = ("planning_ms", "Planning per step, ms ↓", 2)
"""Name, heading and digits of the planning time, which is measured."""
NAVIGATION_ROWS = (*((name, metric.heading, metric.digits) for name, metric in METRICS.items()), PLANNING)
"""Navigation metrics: name, heading, number of digits."""

LEADERBOARD_COLUMNS = (
    ("collision_free", "Collision-free SR ↑", 3, True),
    ("success", "SR ↑", 3, True),
    ("spl", "SPL ↑", 3, True),
    ("soft_spl", "SoftSPL ↑", 3, False),
    ("min_clearance", "Clearance, m ↑", 3, False),
    ("time_to_goal", "Time, s ↓", 2, False),
    ("planning_ms", "Planning, ms ↓", 2, False),
)
"""Metrics of the leaderboard: name, heading, number of digits, whether the interval is shown."""

_PAPER_KEYS = {"success": "sr", "spl": "spl"}
"""Metrics of the leaderboard that the paper gives, by their names there."""

_PAPER_SENSORS = {"iPlanner": "depth", "NavDP": "rgbd"}


def layout_table(summary: LayoutSummary, name: str = "labgym") -> Table:
    """Return the layout metrics, with the LabBuilder paper's row in the last line.

    Args:
        summary: means over layouts.
        name: name of the first row.
    """
    judged = all(key in summary.metrics and summary.metrics[key].count for key, _, _ in SEMANTIC_COLUMNS)
    columns = layout_columns(summary.rules)
    shown = (*columns, *SEMANTIC_COLUMNS) if judged else columns
    means = {key: summary.mean(key) for key, _, _ in shown}
    printed = paper().layouts.row("LabBuilder")
    absent = [
        f"{heading.split(' ')[0]} {summary.metrics[key].count} of {summary.layouts}"
        for key, heading, _ in shown
        if summary.metrics[key].nulls
    ]
    notes = [f"Means over layouts, rules {', '.join(summary.rules)}, profile {', '.join(summary.profiles)}."]
    if absent:
        notes.append(f"Means over the layouts to which the metric applies: {', '.join(absent)}.")
    if columns is not LAYOUT_COLUMNS:
        notes.append("Step nav and Door nav are pooled over the drives of all layouts.")
    if judged:
        notes.append("Real, Lay and Comp: points of 10 by a vision-language model; the paper's model was another one.")
    notes.append("The paper does not give the thresholds of its chemistry metrics, so its row is not comparable.")
    return Table(
        title=f"Layout metrics, {summary.layouts} layouts",
        columns=("Method", *(heading for _, heading, _ in shown)),
        rows=(_layout_row(name, means, shown), _layout_row("LabBuilder (paper)", printed, shown)),
        notes=tuple(notes),
    )


def navigation_table(policies: Mapping[str, Mapping[str, Estimate]], suite: str) -> Table:
    """Return the navigation metrics with their 95% intervals, one column per policy.

    Args:
        policies: estimates by metric, by policy; the table has the metrics common to all policies.
        suite: name of the suite.
    """
    rows = [row for row in NAVIGATION_ROWS if all(row[0] in metrics for metrics in policies.values())]
    counts = {metrics[rows[0][0]].count + metrics[rows[0][0]].nulls for metrics in policies.values()}
    episodes = f"{counts.pop()} episodes" if len(counts) == 1 else "different numbers of episodes"
    return Table(
        title=f"Navigation, {suite}, {episodes} per policy",
        columns=("Metric", *policies),
        rows=tuple(
            (heading, *(estimate_text(metrics[key], digits) for metrics in policies.values()))
            for key, heading, digits in rows
        ),
        notes=(
            "Brackets: 95% intervals over layouts and repeats.",
            "Time to goal is a mean over successful episodes. Planning time depends on the machine.",
        ),
    )


def evaluation_table(evaluation: Evaluation[Any, Any]) -> Table:
    """Return the table of one evaluation."""
    if isinstance(evaluation, LabNavEvaluation):
        return summary_table(evaluation.summary)
    summary = evaluation.summary
    table = navigation_table({summary.policy: evaluation.metrics}, f"suite {summary.suite.title}")
    return replace(table, notes=(*table.notes, *unranked_notes([summary])))


def unranked_notes(summaries: Iterable[EvaluationSummary]) -> tuple[str, ...]:
    """Return a sentence for each policy whose results are not ranked."""
    return tuple(f"{one.policy} is {UNRANKED}." for one in summaries if not is_rankable(one.box))


class TableRow(Protocol):
    """The results of a policy on a suite: an `Evaluation`, or a published result."""

    @property
    def name(self) -> str:
        """Name of the policy."""
        ...

    @property
    def summary(self) -> NavigationSummary:
        """The summary."""
        ...

    @property
    def metrics(self) -> Mapping[str, Estimate]:
        """Its metrics, and the planning time if it was measured."""
        ...


def leaderboard(evaluations: Sequence[TableRow]) -> Table:
    """Return a table with one row per policy, followed by the rows of the paper's table.

    Args:
        evaluations: evaluations on one suite with touchstone metrics.
    """
    rows = [
        (
            one.name,
            "map" if one.summary.privileged else one.summary.sensors or "-",
            *(
                _shown(one.metrics[key], digits, whole) if key in one.metrics else "-"
                for key, _, digits, whole in LEADERBOARD_COLUMNS
            ),
        )
        for one in evaluations
    ]
    paper_rows = [
        (
            f"{row['method']}, paper",
            sensors,
            *(
                number(row[_PAPER_KEYS[key]], digits) if key in _PAPER_KEYS else "-"
                for key, _, digits, _ in LEADERBOARD_COLUMNS
            ),
        )
        for name, sensors in _PAPER_SENSORS.items()
        for row in paper().navigation.rows
        if str(row["method"]).startswith(name)
    ]
    suite, counts = evaluations[0].summary.suite.title, {one.summary.episodes for one in evaluations}
    episodes = f"{counts.pop()} episodes" if len(counts) == 1 else "different numbers of episodes"
    return Table(
        title=f"Navigation, suite {suite}, {episodes} per policy",
        columns=("Policy", "Input", *(heading for _, heading, _, _ in LEADERBOARD_COLUMNS)),
        rows=(*rows, *paper_rows),
        notes=(
            "Brackets: 95% intervals over layouts and repeats.",
            "Time is the mean time to goal over successful episodes; planning is the time per control step and depends "
            "on the machine.",
            "The paper's rows are from other scenes and models, without and with its navigation optimization; they are "
            "not comparable, and the paper gives no intervals.",
            *unranked_notes(one.summary for one in evaluations),
        ),
    )


def _shown(estimate: Estimate, digits: int, whole: bool) -> str:
    return estimate_text(estimate, digits) if whole else number(estimate.value, digits)


def _layout_row(
    name: str, values: Mapping[str, str | float | None], columns: Sequence[tuple[str, str, int]]
) -> tuple[str, ...]:
    return (name, *(number(values.get(key), digits) for key, _, digits in columns))
