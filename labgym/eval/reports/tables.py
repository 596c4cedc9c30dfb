"""Tables of results: one content, written as fixed-width text, Markdown or HTML."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape

from labgym.eval.driving.bootstrap import Estimate
from labgym.eval.driving.record import NavigationSummary
from labgym.eval.reports.paper import paper
from labgym.eval.scoring.layout_report import LayoutSummary

_FIGURE = re.compile(r"^(-|[-+]?\d[\d.,]*%?( \[[^\]]*\])?)$")
"""A number, perhaps with its interval in brackets, or the dash that stands for none."""

LAYOUT_COLUMNS = (
    ("obj", "Obj", 1),
    ("ob", "OB ↓", 2),
    ("cn", "CN ↓", 2),
    ("asset", "Asset ↑", 3),
    ("step_nav", "Step nav ↑", 3),
    ("prot_nav", "Prot nav ↑", 3),
    ("flam", "Flam ↑", 3),
    ("store", "Store ↑", 3),
    ("incomp", "Incomp ↑", 3),
    ("glass", "Glass ↑", 3),
)
"""Layout metrics in the paper's order: key, heading, digits."""

NAVIGATION_ROWS = (
    ("success", "SR ↑", 3),
    ("spl", "SPL ↑", 3),
    ("soft_spl", "SoftSPL ↑", 3),
    ("collision_free", "Collision-free SR ↑", 3),
    ("contacts_per_metre", "Contacts per metre ↓", 3),
    ("min_clearance", "Minimum clearance, m ↑", 3),
    ("time_to_goal", "Time to goal, s ↓", 2),
    ("final_distance", "Distance left, m ↓", 2),
    ("planning_ms", "Planning a step, ms ↓", 2),
)
"""Navigation metrics: name in `labgym.eval.driving.navigation_metrics`, heading, digits."""

NAVDP_ROWS = (
    ("navdp_success", "SR by NavDP's rules ↑", 3),
    ("navdp_spl", "SPL by NavDP's rules ↑", 3),
    ("navdp_time", "Time by NavDP's rules, s ↓", 2),
)
"""Those of suites with the NavDP benchmark's rules, which have them in place of the headline's."""

LEADERBOARD_COLUMNS = (
    ("success", "SR ↑", 3, True),
    ("spl", "SPL ↑", 3, True),
    ("collision_free", "Collision-free ↑", 3, False),
    ("soft_spl", "SoftSPL ↑", 3, False),
    ("min_clearance", "Clearance, m ↑", 3, False),
    ("time_to_goal", "Time, s ↓", 2, False),
    ("planning_ms", "Planning, ms ↓", 2, False),
)
"""Metrics to compare policies by: name, heading, digits, whether its interval is shown."""

_PAPER_SENSORS = {"iPlanner": "depth", "NavDP": "rgbd"}


@dataclass(frozen=True)
class Table:
    """Cells that are ready to print.

    Attributes:
        title: what the table shows.
        columns: headings; the first is the heading of the row names.
        rows: each as long as `columns`.
        notes: what a reader must know to read the figures, one sentence each.
    """

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    notes: tuple[str, ...] = ()

    def text(self) -> str:
        """Return the table in columns of fixed width, figures right-aligned and words left-aligned."""
        columns = list(zip(self.columns, *self.rows, strict=True))
        padded = [_padded(column, right=index in self._figures) for index, column in enumerate(columns)]
        head, *rows = ("  ".join(cells).rstrip() for cells in zip(*padded, strict=True))
        rule = "  ".join("-" * len(column[0]) for column in padded)
        body = [head, rule, *rows]
        return "\n".join([self.title, "", *body, *(["", *self.notes] if self.notes else [])])

    def markdown(self) -> str:
        """Return the table as GitHub-flavoured Markdown, notes as a paragraph below; the title is left out."""
        align = ["---:" if index in self._figures else "---" for index in range(len(self.columns))]
        lines = ["| " + " | ".join(_piped(cells)) + " |" for cells in (self.columns, align, *self.rows)]
        return "\n".join([*lines, *(["", " ".join(self.notes)] if self.notes else [])])

    @property
    def _figures(self) -> frozenset[int]:
        """Columns whose every cell is a figure or a dash."""
        cells = zip(*self.rows, strict=True)
        return frozenset(index for index, column in enumerate(cells) if all(map(_FIGURE.match, column)))

    def html(self) -> str:
        """Return a `<table>` with a caption, everything escaped; notes follow as a paragraph."""
        look = ["" if index in self._figures else ' class="words"' for index in range(len(self.columns))]
        head = "".join(f'<th scope="col"{k}>{escape(cell)}</th>' for k, cell in zip(look, self.columns, strict=True))
        rows = "".join(_html_row(row, look) for row in self.rows)
        notes = f'<p class="notes">{escape(" ".join(self.notes))}</p>' if self.notes else ""
        return (
            f'<div class="scroll"><table><caption>{escape(self.title)}</caption>'
            f"<thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div>{notes}"
        )


def figure(value: str | float | None, digits: int) -> str:
    """Return a number with fixed digits, a dash where there is none, a text as it is."""
    if value is None:
        return "-"
    return value if isinstance(value, str) else f"{value:.{digits}f}"


def layout_table(summary: LayoutSummary, name: str = "labgym") -> Table:
    """Return the layout metrics, the paper's LabBuilder row below ours.

    Args:
        summary: means over layouts.
        name: what to call our row.
    """
    ours = {key: summary.mean(key) for key, _, _ in LAYOUT_COLUMNS}
    theirs = paper().layouts.row("LabBuilder")
    absent = [
        f"{heading.split(' ')[0]} {summary.metrics[key].count} of {summary.layouts}"
        for key, heading, _ in LAYOUT_COLUMNS
        if summary.metrics[key].nulls
    ]
    notes = [f"Means over layouts, {', '.join(summary.versions)}, profile {', '.join(summary.profiles)}."]
    if absent:
        notes.append(
            f"Where a metric does not apply to every layout, the mean is over those where it does: {', '.join(absent)}."
        )
    notes.append("The paper prints no thresholds for its chemistry metrics, so its row is for orientation.")
    return Table(
        title=f"Layout metrics, {summary.layouts} layouts",
        columns=("Method", *(heading for _, heading, _ in LAYOUT_COLUMNS)),
        rows=(_layout_row(name, ours), _layout_row("LabBuilder (paper)", theirs)),
        notes=tuple(notes),
    )


def navigation_table(policies: Mapping[str, Mapping[str, Estimate]], suite: str) -> Table:
    """Return the navigation metrics, a column for each policy, figures with their 95% intervals.

    Args:
        policies: estimates by metric, by policy; the table has the metrics that all of them have.
        suite: what was driven.
    """
    rows = [row for row in (*NAVDP_ROWS, *NAVIGATION_ROWS) if all(row[0] in metrics for metrics in policies.values())]
    counts = {metrics[rows[0][0]].count + metrics[rows[0][0]].nulls for metrics in policies.values()}
    episodes = f"{counts.pop()} episodes" if len(counts) == 1 else "different numbers of episodes"
    return Table(
        title=f"Navigation, {suite}, {episodes} a policy",
        columns=("Metric", *policies),
        rows=tuple(
            (heading, *(interval(metrics[key], digits) for metrics in policies.values()))
            for key, heading, digits in rows
        ),
        notes=(
            "In brackets: 95% bootstrap intervals over layouts.",
            "Time to goal is over successful episodes; planning time depends on the machine.",
        ),
    )


def leaderboard(summaries: Sequence[NavigationSummary]) -> Table:
    """Return policies below each other, those of the paper's table at the end.

    Args:
        summaries: of one suite with the headline's metrics, a row each.
    """
    ours = [
        (
            summary.policy,
            "map" if summary.privileged else summary.sensors or "-",
            *(_shown(summary.metrics[key], digits, whole) for key, _, digits, whole in LEADERBOARD_COLUMNS),
        )
        for summary in summaries
    ]
    rest = ("-",) * (len(LEADERBOARD_COLUMNS) - 2)
    theirs = [
        (f"{row['method']}, paper", sensors, figure(row["sr"], 3), figure(row["spl"], 3), *rest)
        for name, sensors in _PAPER_SENSORS.items()
        for row in paper().navigation.rows
        if str(row["method"]).startswith(name)
    ]
    first = summaries[0]
    return Table(
        title=f"Navigation, suite {first.suite.label}, {first.episodes} episodes a policy",
        columns=("Policy", "Sees", *(heading for _, heading, _, _ in LEADERBOARD_COLUMNS)),
        rows=(*ours, *theirs),
        notes=(
            "In brackets: 95% bootstrap intervals over layouts.",
            "Time is to the goal, over successful episodes; planning is for one control step, on this machine.",
            "The paper's rows are of its own scenes and models, before and after its refinement for navigation, for "
            "orientation; it gives no intervals.",
        ),
    )


def interval(estimate: Estimate, digits: int) -> str:
    """Return an estimate with its interval in brackets, where it has one."""
    value = figure(estimate.value, digits)
    if estimate.low is None or estimate.high is None:
        return value
    return f"{value} [{estimate.low:.{digits}f}, {estimate.high:.{digits}f}]"


def _shown(estimate: Estimate, digits: int, whole: bool) -> str:
    return interval(estimate, digits) if whole else figure(estimate.value, digits)


def _layout_row(name: str, values: Mapping[str, str | float | None]) -> tuple[str, ...]:
    return (name, *(figure(values[key], digits) for key, _, digits in LAYOUT_COLUMNS))


def _padded(column: Sequence[str], right: bool) -> list[str]:
    width = max(len(cell) for cell in column)
    return [cell.rjust(width) if right else cell.ljust(width) for cell in column]


def _piped(cells: Sequence[str]) -> list[str]:
    return [cell.replace("|", "\\|") for cell in cells]


def _html_row(row: Sequence[str], look: Sequence[str]) -> str:
    cells = "".join(f"<td{kind}>{escape(cell)}</td>" for kind, cell in zip(look[1:], row[1:], strict=True))
    return f'<tr><th scope="row"{look[0]}>{escape(row[0])}</th>{cells}</tr>'
