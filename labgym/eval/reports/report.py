"""The report: a self-contained HTML page with embedded pictures, without scripts or external resources."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from labgym.documents import write_text
from labgym.table import Table

if TYPE_CHECKING:
    from jinja2 import Environment

PACKAGE = "labgym.eval.reports"


@cache
def page_environment(*packages: str) -> Environment:
    """Return the environment of pages, which escapes all text.

    Args:
        packages: that have templates, looked up before those of the reports.
    """
    from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined

    return Environment(
        loader=ChoiceLoader([PackageLoader(package) for package in (*packages, PACKAGE)]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )


@dataclass(frozen=True)
class Tile:
    """A headline number."""

    label: str
    value: str


@dataclass(frozen=True)
class Picture:
    """A PNG picture embedded in the page."""

    caption: str
    png: bytes

    @property
    def data_uri(self) -> str:
        """The picture as a `data:` URI."""
        return "data:image/png;base64," + base64.b64encode(self.png).decode("ascii")


@dataclass(frozen=True)
class Card:
    """The section on one layout.

    Attributes:
        id: id of the layout.
        metrics: names and printed values.
        violations: one sentence each; None if the layout was not scored.
        episodes: table of the episodes in the layout.
    """

    id: str
    title: str
    subtitle: str
    picture: Picture | None = None
    metrics: tuple[tuple[str, str], ...] = ()
    violations: tuple[str, ...] | None = None
    episodes: Table | None = None


@dataclass(frozen=True)
class Report:
    """The contents of the page, in order.

    Attributes:
        problems: contradictions in the results, one sentence each; shown at the top.
    """

    title: str
    subtitle: str
    tiles: tuple[Tile, ...] = ()
    tables: tuple[Table, ...] = ()
    views: tuple[Picture, ...] = ()
    cards: tuple[Card, ...] = ()
    provenance: tuple[tuple[str, str], ...] = field(default=())
    problems: tuple[str, ...] = ()


def render_report(report: Report) -> str:
    """Return the page as HTML; all text is escaped."""
    return page_environment().get_template("report.html.j2").render(report=report)


def write_tables(tables: Sequence[Table], folder: Path) -> tuple[Path, Path]:
    """Write tables as text and Markdown, tables.txt and tables.md, and return the paths."""
    return (
        write_text(folder / "tables.txt", "\n\n\n".join(table.text() for table in tables) + "\n"),
        write_text(folder / "tables.md", "\n\n".join(table.titled_markdown() for table in tables) + "\n"),
    )


def write_report(report: Report, path: str | Path) -> Path:
    """Write the page atomically and return its path."""
    return write_text(path, render_report(report))
