"""Tables of results: one content, written as fixed-width text, Markdown or HTML."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape

from labgym.eval.paper import paper
from labgym.eval.report_model import LayoutSummary

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
        """Return the table in columns of fixed width, first column left-aligned, figures right-aligned."""
        widths = [max(len(row[i]) for row in (self.columns, *self.rows)) for i in range(len(self.columns))]
        rule = "  ".join("-" * width for width in widths)
        body = [_aligned(self.columns, widths), rule, *(_aligned(row, widths) for row in self.rows)]
        return "\n".join([self.title, "", *body, *(["", *self.notes] if self.notes else [])])

    def markdown(self) -> str:
        """Return the table as GitHub-flavoured Markdown, notes as a paragraph below; the title is left out."""
        align = ["---", *("---:" for _ in self.columns[1:])]
        lines = ["| " + " | ".join(_piped(cells)) + " |" for cells in (self.columns, align, *self.rows)]
        return "\n".join([*lines, *(["", " ".join(self.notes)] if self.notes else [])])

    def html(self) -> str:
        """Return a `<table>` with a caption, everything escaped; notes follow as a paragraph."""
        head = "".join(f'<th scope="col">{escape(cell)}</th>' for cell in self.columns)
        rows = "".join(_html_row(row) for row in self.rows)
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


def _layout_row(name: str, values: Mapping[str, str | float | None]) -> tuple[str, ...]:
    return (name, *(figure(values[key], digits) for key, _, digits in LAYOUT_COLUMNS))


def _aligned(row: Sequence[str], widths: Sequence[int]) -> str:
    cells = [row[0].ljust(widths[0]), *(cell.rjust(width) for cell, width in zip(row[1:], widths[1:], strict=True))]
    return "  ".join(cells).rstrip()


def _piped(cells: Sequence[str]) -> list[str]:
    return [cell.replace("|", "\\|") for cell in cells]


def _html_row(row: Sequence[str]) -> str:
    cells = "".join(f"<td>{escape(cell)}</td>" for cell in row[1:])
    return f'<tr><th scope="row">{escape(row[0])}</th>{cells}</tr>'
