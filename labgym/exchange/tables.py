"""Tables in CSV files with a header row: those from outside, bounded in size, and those for spreadsheets."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

from labgym.assets import Catalog
from labgym.documents import read_bytes, write_text
from labgym.errors import DocumentError, UnknownNameError

MAX_BYTES = 1024 * 1024
MAX_ROWS = 5000
MAX_CELL = 200
Remark = Callable[[str], None]
FORMULA = ("=", "+", "-", "@", "\t", "\r")
"""First characters of a text that spreadsheets would execute as a formula."""
NUMBER = re.compile(r"-[0-9.]{1,40}")


@dataclass(frozen=True)
class CsvTable:
    """A table of a CSV file.

    Attributes:
        header: names of the columns, in lower case. rows: each with its number in the file, empty rows left out.
    """

    path: Path
    header: tuple[str, ...]
    rows: tuple[tuple[int, tuple[str, ...]], ...]

    def column(self, names: Iterable[str]) -> int | None:
        """Return the index of the first of some columns that exists, None if none does."""
        return next((self.header.index(name) for name in names if name in self.header), None)

    def required(self, names: tuple[str, ...]) -> int:
        """Return the index of the first of some columns that exists.

        Raises:
            DocumentError: none of them exists.
        """
        index = self.column(names)
        if index is None:
            raise DocumentError(self.path, "", f"no column {' or '.join(map(repr, names))} in the header row")
        return index


def read_table(path: str | Path) -> CsvTable:
    """Read a CSV file (comma, semicolon or tab; UTF-8) with a header row.

    Raises:
        DocumentError: the file is missing, larger than 1 MB, not UTF-8 or not CSV, or has more than 5000 rows.
    """
    path = Path(path)
    rows = _rows(path)
    header = tuple(cell.strip().casefold() for cell in rows[0]) if rows else ()
    body = tuple(
        (number, tuple(row)) for number, row in enumerate(rows[1:], start=2) if any(cell.strip() for cell in row)
    )
    return CsvTable(path, header, body)


def write_table(path: str | Path, header: Iterable[str], rows: Iterable[Iterable[str]]) -> Path:
    """Write a table as CSV (UTF-8, commas) and return the path. No cell is a formula to spreadsheets."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(header)
    writer.writerows([_safe(text) for text in row] for row in rows)
    return write_text(path, stream.getvalue())


def _safe(text: str) -> str:
    return f"'{text}" if text.startswith(FORMULA) and not NUMBER.fullmatch(text) else text


def cell(row: tuple[str, ...], column: int | None) -> str:
    """Return the text of a cell, empty if the row has no such column."""
    return row[column].strip() if column is not None and column < len(row) else ""


def asset_name(text: str, catalog: Catalog, path: str | Path, where: str, remark: Remark | None = None) -> str:
    """Return the catalog's name for a cell.

    Args:
        remark: receives a sentence if the name is taken for a misspelling.

    Raises:
        DocumentError: the cell is empty, or names no asset; names the row.
    """
    if not text:
        raise DocumentError(path, where, "the asset is empty")
    try:
        match = catalog.require(text[:MAX_CELL])
    except UnknownNameError as error:
        raise DocumentError(path, where, str(error)) from None
    if match.how == "fuzzy" and remark is not None:
        remark(f"{path}: {where}: {text[:MAX_CELL]!r} is taken for {match.name}")
    return match.name


def _rows(path: Path) -> list[list[str]]:
    text = _text(path)
    first = text.partition("\n")[0]
    separator = max(",;\t", key=first.count)
    rows: list[list[str]] = []
    try:
        for row in csv.reader(io.StringIO(text, newline=""), delimiter=separator, strict=True):
            rows.append(row)
            if len(rows) > MAX_ROWS + 1:
                raise DocumentError(path, "", f"more than {MAX_ROWS} rows; split it into several files")
    except csv.Error as error:
        raise DocumentError(path, f"row {len(rows) + 1}", f"not valid CSV ({error})") from None
    return rows


def _text(path: Path) -> str:
    raw = read_bytes(path, MAX_BYTES)
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise DocumentError(path, "", "not UTF-8 text; save the table as CSV UTF-8") from None
