"""The results printed in the LabBuilder paper, for comparison."""

from __future__ import annotations

from functools import cache
from typing import ClassVar

from labgym.artefacts import artefacts
from labgym.documents import Document, Record
from labgym.errors import UnknownNameError


class PaperTable(Record):
    """A printed table: its place in the paper, and its rows by column name; None stands for a dash."""

    source: str
    rows: tuple[dict[str, str | int | float | None], ...]

    def row(self, method: str) -> dict[str, str | int | float | None]:
        """Return a method's row.

        Raises:
            UnknownNameError: the table has no row of that method.
        """
        for row in self.rows:
            if row.get("method") == method:
                return row
        raise UnknownNameError("method", method, (str(row.get("method")) for row in self.rows))


class Paper(Document):
    """Tables 1 to 4 of the paper: protocol statistics, layouts, ablation and navigation."""

    SCHEMA: ClassVar[str] = "labgym.paper/1"

    title: str
    venue: str
    note: str
    protocol_statistics: PaperTable
    layouts: PaperTable
    navigation: PaperTable
    ablation: PaperTable


@cache
def paper() -> Paper:
    """Return the paper's tables, read once."""
    return Paper.load(artefacts("eval") / "paper.json")
