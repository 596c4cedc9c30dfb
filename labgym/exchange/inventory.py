"""Inventories: the equipment and reagents that exist, read from CSV, and what a protocol requires in addition."""

from __future__ import annotations

import csv
import io
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, ClassVar

from pydantic import Field

from labgym.assets import Catalog
from labgym.documents import Document, Record, read_bytes
from labgym.errors import DocumentError, UnknownNameError
from labgym.protocols import Protocol

MAX_BYTES = 1024 * 1024
MAX_ROWS = 5000
MAX_COUNT = 10_000
MAX_CELL = 200
ASSET_COLUMNS, COUNT_COLUMNS, NOTE_COLUMNS = ("asset", "name", "item"), ("count", "quantity", "number"), ("note",)

Count = Annotated[int, Field(ge=0, le=MAX_COUNT)]


class InventoryItem(Record):
    """An asset that exists.

    Attributes:
        asset: name in the catalog.
        note: free text, such as a location or an inventory number.
    """

    asset: Annotated[str, Field(max_length=64)]
    count: Count = 1
    note: Annotated[str, Field(max_length=MAX_CELL)] = ""


class Inventory(Document):
    """The equipment and reagents that exist, one entry per asset.

    `read_inventory` makes one from CSV.
    """

    SCHEMA: ClassVar[str] = "labgym.inventory/1"

    items: Annotated[tuple[InventoryItem, ...], Field(max_length=MAX_ROWS)] = ()

    @property
    def counts(self) -> Mapping[str, int]:
        """Number of pieces by asset name; rows of one asset are added."""
        counts: Counter[str] = Counter()
        for item in self.items:
            counts[item.asset] += item.count
        return dict(counts)


@dataclass(frozen=True)
class Lack:
    """An asset of which more pieces are required than exist."""

    asset: str
    required: int
    existing: int
    reason: str

    @property
    def message(self) -> str:
        """The lack in one line, with the smallest change that removes it."""
        more = self.required - self.existing
        return f"{self.asset}: {self.reason} {self.required}, the inventory has {self.existing}: add {more}"


def read_inventory(path: str | Path, catalog: Catalog | None = None) -> Inventory:
    """Read an inventory from a CSV file with a header row.

    The columns are `asset` (or `name`, `item`: a name or synonym of the catalog), `count` (or `quantity`, `number`;
    1 if the column or the cell is empty) and `note`; other columns are ignored. The separator is a comma, a semicolon
    or a tab. A bill of materials of `labgym compile --format bom` is an inventory, too.

    Args:
        catalog: the catalog that defines the names; by default `Catalog.load()`.

    Raises:
        DocumentError: the file is missing, larger than 1 MB, not UTF-8 or not CSV, has no column of assets or more than
            5000 rows, or a row has an unknown asset or an invalid count; names the row.
    """
    catalog = Catalog.load() if catalog is None else catalog
    rows = _rows(Path(path))
    header = [cell.strip().casefold() for cell in rows[0]] if rows else []
    asset, count, note = (_column(header, names) for names in (ASSET_COLUMNS, COUNT_COLUMNS, NOTE_COLUMNS))
    if asset is None:
        raise DocumentError(path, "", f"no column {' or '.join(map(repr, ASSET_COLUMNS))} in the header row")
    items = []
    for number, row in enumerate(rows[1:], start=2):
        if any(cell.strip() for cell in row):
            where = f"row {number}"
            name = _asset(_cell(row, asset), catalog, path, where)
            amount = _count(_cell(row, count), path, where)
            items.append(InventoryItem(asset=name, count=amount, note=_cell(row, note)[:MAX_CELL]))
    return Inventory(items=tuple(items))


def lacking(protocols: Iterable[Protocol], inventory: Inventory, catalog: Catalog) -> tuple[Lack, ...]:
    """Return the assets that protocols require and an inventory lacks, in the order of the protocols.

    Protocols share equipment, so the largest number counts. Reagents count only if the inventory lists any reagent.

    Raises:
        UnknownNameError: a protocol names an asset that is not in the catalog.
    """
    listed = any(catalog.get(item.asset).kind == "reagent" for item in inventory.items)
    required: dict[str, tuple[int, str]] = {}
    for protocol in protocols:
        names = Counter(catalog.find(name).name for name in protocol.required_assets())
        for name, number in names.items():
            if catalog.get(name).kind == "reagent" and not listed:
                continue
            if number > required.get(name, (0, ""))[0]:
                required[name] = (number, f"protocol {protocol.id} requires")
    return _lacks(required, inventory)


def to_acquire(placed: Iterable[str], inventory: Inventory) -> tuple[Lack, ...]:
    """Return the assets of which a layout places more pieces than exist.

    Args:
        placed: the asset of each placement.
    """
    counts = Counter(placed)
    return _lacks({name: (number, "the layout places") for name, number in counts.items()}, inventory)


def _lacks(required: Mapping[str, tuple[int, str]], inventory: Inventory) -> tuple[Lack, ...]:
    existing = inventory.counts
    return tuple(
        Lack(name, number, existing.get(name, 0), reason)
        for name, (number, reason) in required.items()
        if number > existing.get(name, 0)
    )


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


def _column(header: list[str], names: Iterable[str]) -> int | None:
    return next((header.index(name) for name in names if name in header), None)


def _cell(row: list[str], column: int | None) -> str:
    return row[column].strip() if column is not None and column < len(row) else ""


def _asset(text: str, catalog: Catalog, path: str | Path, where: str) -> str:
    if not text:
        raise DocumentError(path, where, "the asset is empty")
    try:
        return catalog.find(text[:MAX_CELL]).name
    except UnknownNameError as error:
        raise DocumentError(path, where, str(error)) from None


def _count(text: str, path: str | Path, where: str) -> int:
    if not text:
        return 1
    if not (text.isascii() and text.isdigit() and len(text) <= 6 and int(text) <= MAX_COUNT):
        raise DocumentError(path, where, f"count {text[:40]!r} must be a whole number from 0 to {MAX_COUNT}")
    return int(text)
