"""Inventories: the equipment and reagents that exist, read from CSV."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, ClassVar

from pydantic import Field

from labgym.assets import Catalog
from labgym.documents import Document, Record
from labgym.errors import DocumentError
from labgym.exchange.tables import MAX_CELL, MAX_ROWS, Remark, asset_names, cell, read_table

MAX_COUNT = 10_000
WHOLE = re.compile(r"([0-9]{1,6})(?:\.0)?")
"""A whole number, also as programs write it in a column with empty cells: 2.0, but not 1.000, which may mean 1000."""
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


def read_inventory(path: str | Path, catalog: Catalog | None = None, remark: Remark | None = None) -> Inventory:
    """Read an inventory from a CSV file with a header row.

    The columns are `asset` (or `name`, `item`: a name or synonym of the catalog), `count` (or `quantity`, `number`;
    1 if the column or the cell is empty) and `note`; other columns are ignored. The separator is a comma, a semicolon
    or a tab. A bill of materials of `labgym compile --format bom` is an inventory, too.

    Args:
        catalog: the catalog that defines the names; by default `Catalog.load()`.
        remark: receives a sentence about each name that is taken for a misspelling.

    Raises:
        DocumentError: the file is missing, larger than 1 MB, not UTF-8 or not CSV, has no column of assets or more than
            5000 rows, or rows have an unknown asset or an invalid count; names them.
    """
    catalog = Catalog.load() if catalog is None else catalog
    table = read_table(path)
    asset = table.required(ASSET_COLUMNS)
    count, note = table.column(COUNT_COLUMNS), table.column(NOTE_COLUMNS)
    items = []
    for (number, row), name in zip(table.rows, asset_names(table, asset, catalog, remark), strict=True):
        amount = _count(cell(row, count), path, f"row {number}")
        items.append(InventoryItem(asset=name, count=amount, note=cell(row, note)[:MAX_CELL]))
    return Inventory(items=tuple(items))


def _count(text: str, path: str | Path, where: str) -> int:
    if not text:
        return 1
    whole = WHOLE.fullmatch(text)
    if whole is None or int(whole[1]) > MAX_COUNT:
        raise DocumentError(path, where, f"count {text[:40]!r} must be a whole number from 0 to {MAX_COUNT}")
    return int(whole[1])
