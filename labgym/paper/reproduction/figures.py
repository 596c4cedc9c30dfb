"""The figures of a study: tables of labgym's values with intervals and of the values printed in the paper."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Mapping, Sequence
from typing import ClassVar, Literal

from labgym.documents import Document, Growing, Record
from labgym.eval.driving.intervals import Estimate, bounded_mean, positive_mean
from labgym.table import Table, number

Scale = Literal["share", "points", "amount"]
"""Of a metric: in [0, 1], in [0, 10], or not negative without an upper bound. It decides the kind of interval."""
Value = int | float | None
DECIMALS = 6
"""Decimals to which figures are rounded, so that they do not depend on the last bit of a mathematics library."""
FEWEST_PROTOCOLS = 5
"""Number of protocols below which a figure has no interval: it would span almost all values."""
FITTED = "(fitted)"
"""Mark of a figure that was fitted to the paper's."""
CSV_COLUMNS = ("table", "row", "origin", "detail", "metric", "value", "low", "high", "cases", "fitted")


class FigureCell(Growing):
    """A figure.

    Attributes:
        value: None if the metric does not apply.
        low, high: ends of its 95% interval, if it has one.
        cases: number of cases behind it; None for values printed in the paper and for plain counts.
        fitted: whether what made it was fitted to the paper's figure, so that their agreement shows nothing.
    """

    ADDED: ClassVar[frozenset[str]] = frozenset({"fitted"})

    value: float | None
    low: float | None = None
    high: float | None = None
    cases: int | None = None
    fitted: bool = False

    def text(self, digits: int) -> str:
        """Return the value, with its interval in brackets if it has one, and its mark; a dash for None."""
        return self.number(digits) + self.interval(digits) + (f" {FITTED}" if self.fitted else "")

    def number(self, digits: int) -> str:
        """Return the value, a dash for None."""
        return number(self.value, digits)

    def interval(self, digits: int) -> str:
        """Return the interval in brackets after a space, an empty text without one."""
        if self.low is None or self.high is None:
            return ""
        return f" [{number(self.low, digits)}, {number(self.high, digits)}]"


class FigureColumn(Record):
    """A metric of a table: its key in the cells, its heading and its number of digits."""

    key: str
    heading: str
    digits: int = 3


class FigureLine(Record):
    """A line of a table.

    Attributes:
        name: for example of a method.
        origin: whether labgym measured it or the paper prints it.
        detail: how it was made, for example the proposer.
        cells: figures by the key of their column; an absent one is a dash.
    """

    name: str
    origin: Literal["labgym", "paper"] = "labgym"
    detail: str = ""
    cells: dict[str, FigureCell]


class FigureTable(Record):
    """A table of figures.

    Attributes:
        key: short name, unique in the study.
        title: what it shows. first: heading of the column of names. second: of the column of details.
        columns, lines: its content.
        notes: how to read it, one sentence each.
    """

    key: str
    title: str
    first: str = "Method"
    second: str = "Made by"
    columns: tuple[FigureColumn, ...]
    lines: tuple[FigureLine, ...]
    notes: tuple[str, ...] = ()

    def table(self) -> Table:
        """Return the table as text cells; lines of the paper say so."""
        details = any(line.detail for line in self.lines)
        return Table(
            title=self.title,
            columns=(self.first, *((self.second,) if details else ()), *(column.heading for column in self.columns)),
            rows=tuple(
                (
                    f"{line.name} (paper)" if line.origin == "paper" else line.name,
                    *((line.detail or "-",) if details else ()),
                    *(self.cell(line, column).text(column.digits) for column in self.columns),
                )
                for line in self.lines
            ),
            notes=self.notes,
        )

    @staticmethod
    def cell(line: FigureLine, column: FigureColumn) -> FigureCell:
        """Return the figure of a line in a column."""
        return line.cells.get(column.key, FigureCell(value=None))


class PublishedFigures(Document):
    """The figures of a study, `figures.json`.

    Attributes:
        study: name of the command. title: what it reproduces. source: the table of the paper, empty if it has none.
        summary: the main findings, one sentence each.
        facts: how the figures were made: metrics, proposers, seeds, code.
        tables: the figures.
    """

    SCHEMA: ClassVar[str] = "labgym.reproduction/1"

    study: str
    title: str
    source: str
    summary: tuple[str, ...] = ()
    facts: dict[str, str]
    tables: tuple[FigureTable, ...]

    def csv(self) -> str:
        """Return all tables as one CSV file with a line for each figure."""
        stream = io.StringIO()
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(CSV_COLUMNS)
        for table in self.tables:
            for line in table.lines:
                for column in table.columns:
                    cell = table.cell(line, column)
                    values = (cell.value, cell.low, cell.high, cell.cases, "fitted" if cell.fitted else None)
                    cells = ("" if value is None else value for value in values)
                    writer.writerow((table.key, line.name, line.origin, line.detail, column.key, *cells))
        return stream.getvalue()


def mean_cell(values: Sequence[Value], clusters: Sequence[str], scale: Scale) -> FigureCell:
    """Return the mean of a metric with its 95% interval.

    Args:
        values: (n,); None if the metric does not apply to a case, which is left out.
        clusters: n names of protocols; cases of one protocol are not independent.
        scale: kind of the metric.
    """
    floats = [None if value is None else float(value) for value in values]
    if scale == "amount":
        estimate = positive_mean(floats, clusters)
    else:
        estimate = bounded_mean(floats, clusters, 0.0, 1.0 if scale == "share" else 10.0)
    return estimate_cell(estimate, clusters)


def estimate_cell(estimate: Estimate, clusters: Sequence[str]) -> FigureCell:
    """Return an estimate as a figure, without its interval if it is of fewer than `FEWEST_PROTOCOLS` protocols."""
    if len(set(clusters)) < FEWEST_PROTOCOLS:
        estimate = estimate.model_copy(update={"low": None, "high": None})
    value, low, high = (
        None if x is None else round(x, DECIMALS) for x in (estimate.value, estimate.low, estimate.high)
    )
    return FigureCell(value=value, low=low, high=high, cases=estimate.count)


def plain_cells(values: Mapping[str, float | None]) -> dict[str, FigureCell]:
    """Return figures without intervals, rounded."""
    return {key: FigureCell(value=None if value is None else round(value, DECIMALS)) for key, value in values.items()}


def paper_line(
    row: Mapping[str, str | int | float | None], columns: Iterable[FigureColumn], first: str = "method"
) -> FigureLine:
    """Return a row of a table of the paper, with the columns that it prints.

    Args:
        row: the row, by column.
        columns: columns of our table.
        first: key of the name in the row.
    """
    cells = {}
    for column in columns:
        value = row.get(column.key)
        if isinstance(value, int | float):
            cells[column.key] = FigureCell(value=float(value))
    return FigureLine(name=str(row[first]), origin="paper", cells=cells)
