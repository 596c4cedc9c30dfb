"""Tables: cells of text, printed with fixed width, as Markdown or as HTML."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

_NUMBER = re.compile(r"^(-|[-+]?\d[\d.,]*%?( \[[^\]]*\])?)$")
"""A number, optionally with its interval in brackets, or a dash."""


@dataclass(frozen=True)
class Table:
    """A table of text cells.

    Attributes:
        title: what the table shows.
        columns: headings; the first column holds the row names.
        rows: each as long as `columns`.
        notes: how to read the numbers, one sentence each.
    """

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    notes: tuple[str, ...] = ()

    def text(self) -> str:
        """Return the table in columns of fixed width, numbers right-aligned and words left-aligned."""
        columns = list(zip(self.columns, *self.rows, strict=True))
        padded = [_padded(column, right=index in self._numeric) for index, column in enumerate(columns)]
        head, *rows = ("  ".join(cells).rstrip() for cells in zip(*padded, strict=True))
        rule = "  ".join("-" * len(column[0]) for column in padded)
        body = [head, rule, *rows]
        return "\n".join([self.title, "", *body, *(["", *self.notes] if self.notes else [])])

    def markdown(self) -> str:
        """Return the table as GitHub-flavored Markdown with the notes below and without the title.

        HTML in cells and notes is escaped.
        """
        align = ["---:" if index in self._numeric else "---" for index in range(len(self.columns))]
        lines = ["| " + " | ".join(_piped(cells)) + " |" for cells in (self.columns, align, *self.rows)]
        return "\n".join([*lines, *(["", escape(" ".join(self.notes), quote=False)] if self.notes else [])])

    def titled_markdown(self) -> str:
        """Return the title in bold and the table as Markdown below."""
        return f"**{escape(self.title, quote=False)}**\n\n{self.markdown()}"

    @property
    def _numeric(self) -> frozenset[int]:
        """Indices of the columns in which every cell is a number or a dash."""
        cells = zip(*self.rows, strict=True)
        return frozenset(index for index, column in enumerate(cells) if all(map(_NUMBER.match, column)))

    def html(self) -> str:
        """Return a `<table>` with a caption and the notes in a paragraph below; all text is escaped."""
        look = ["" if index in self._numeric else ' class="words"' for index in range(len(self.columns))]
        head = "".join(f'<th scope="col"{k}>{escape(cell)}</th>' for k, cell in zip(look, self.columns, strict=True))
        rows = "".join(_html_row(row, look) for row in self.rows)
        notes = f'<p class="notes">{escape(" ".join(self.notes))}</p>' if self.notes else ""
        return (
            f'<div class="scroll" tabindex="0"><table><caption>{escape(self.title)}</caption>'
            f"<thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div>{notes}"
        )


def number(value: str | float | None, digits: int) -> str:
    """Return a number with fixed digits, a dash for None, a text unchanged."""
    if value is None:
        return "-"
    return value if isinstance(value, str) else f"{value:z.{digits}f}"


def _padded(column: Sequence[str], right: bool) -> list[str]:
    width = max(len(cell) for cell in column)
    return [cell.rjust(width) if right else cell.ljust(width) for cell in column]


def _piped(cells: Sequence[str]) -> list[str]:
    return [escape(" ".join(cell.split()), quote=False).replace("|", "\\|") for cell in cells]


def _html_row(row: Sequence[str], look: Sequence[str]) -> str:
    cells = "".join(f"<td{kind}>{escape(cell)}</td>" for kind, cell in zip(look[1:], row[1:], strict=True))
    return f'<tr><th scope="row"{look[0]}>{escape(row[0])}</th>{cells}</tr>'
