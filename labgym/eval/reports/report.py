"""Parts that pages share: the environment of their templates, pictures, sections on layouts, and table files."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import dataclass
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
        id: id of the layout. picture: its plan, relative to the page; "" without.
        metrics: names and printed values.
        violations: one sentence each; None if the layout was not scored.
        episodes: table of the episodes in the layout.
    """

    id: str
    title: str
    subtitle: str
    picture: str = ""
    metrics: tuple[tuple[str, str], ...] = ()
    violations: tuple[str, ...] | None = None
    episodes: Table | None = None


def write_tables(tables: Sequence[Table], folder: Path) -> tuple[Path, Path]:
    """Write tables as text and Markdown, tables.txt and tables.md, and return the paths."""
    return (
        write_text(folder / "tables.txt", "\n\n\n".join(table.text() for table in tables) + "\n"),
        write_text(folder / "tables.md", "\n\n".join(table.titled_markdown() for table in tables) + "\n"),
    )
