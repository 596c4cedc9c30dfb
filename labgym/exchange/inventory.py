"""Inventories: the equipment and reagents that exist, read from CSV."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, ClassVar

from pydantic import Field

from labgym.assets import Catalog
from labgym.assets.search import Match
from labgym.documents import Document, Record
from labgym.errors import DocumentError
from labgym.exchange.tables import MAX_CELL, MAX_ROWS, CsvTable, Remark, cell, read_table

MAX_COUNT = 10_000
WHOLE = re.compile(r"([0-9]{1,6})(?:\.0)?")
"""A whole number, also as programs write it in a column with empty cells: 2.0, but not 1.000, which may mean 1000."""
PACKS = re.compile(r"([0-9]{1,6}) ?[x×] ?(?=[0-9])", re.IGNORECASE)
"""Number of containers before their size: 2 x 500 mL."""
MEASURED = re.compile(r"([0-9][0-9.,]{0,15}) ?([A-Za-zµμÄÖÜäöü個个台瓶件]{1,16})\.?")
"""A number with a unit."""
UNITS = frozenset({
    "kg", "g", "mg", "µg", "μg", "ug", "t", "lb", "lbs", "oz", "l", "ml", "µl", "μl", "ul", "cl", "dl", "gal",
    "gallon", "gallons", "liter", "liters", "litre", "litres", "milliliter", "gram", "grams", "gramm", "kilogram",
    "mol", "mmol", "m", "cm", "mm", "m3", "cm3",
})  # fmt: skip
"""Units of amounts."""
PIECES = frozenset({
    "", "pc", "pcs", "pce", "piece", "pieces", "ea", "each", "unit", "units", "item", "items", "set", "sets", "bottle",
    "bottles", "pack", "packs", "box", "boxes", "can", "cans", "vial", "vials", "st", "stk", "stück", "flasche",
    "flaschen", "packung", "pièce", "pièces", "bouteille", "bouteilles", "unidad", "unidades", "botella", "botellas",
    "个", "個", "台", "瓶", "件",
})  # fmt: skip
"""Units of counts."""
COLUMNS: Mapping[str, tuple[str, ...]] = {
    "asset": (
        "asset", "name", "item", "item name", "product", "product name", "chemical", "chemical name", "substance",
        "reagent", "compound", "equipment", "equipment name", "instrument", "device", "resource", "resource name",
        "article", "material", "description", "bezeichnung", "artikel", "gerät", "stoff", "chemikalie", "produkt",
        "désignation", "produit", "nom", "appareil", "nombre", "producto", "artículo", "equipo", "名称", "品名", "试剂",
        "设备", "物品",
    ),
    "count": (
        "count", "quantity", "qty", "number", "no of items", "number of items", "pieces", "pcs", "stock", "in stock",
        "on hand", "anzahl", "menge", "stück", "bestand", "quantité", "cantidad", "数量", "件数",
    ),
    "amount": (
        "amount", "volume", "mass", "weight", "size", "pack size", "package size", "container size", "inhalt",
        "packungsgröße", "gebinde", "volumen", "masse", "gewicht", "contenance", "poids", "volumen", "peso", "规格",
        "容量",
    ),
    "unit": ("unit", "units", "uom", "einheit", "unité", "unidad", "单位"),
    "cas": ("cas", "cas number", "cas no", "cas nr", "cas nummer", "n cas", "cas号"),
    "note": ("note", "notes", "comment", "comments", "remark", "remarks", "bemerkung", "remarque", "nota", "备注"),
}  # fmt: skip
"""Headers by meaning, without case, punctuation and units in parentheses."""
HEADER_ROWS = 10
"""Number of rows in which the header is looked for: a title may precede it."""
MOST_LISTED = 20
"""Greatest number of rows that are listed."""

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
    """Read an inventory from a CSV file with a header among its first ten rows.

    `COLUMNS` lists the headers. Assets are named by a name, synonym or CAS number of the catalog. A count is a number
    of pieces, 1 if it is missing; an amount such as "500 mL" is one container, "2 x 500 mL" are two, and a number in a
    column of amounts, or with a unit such as mL in the column of units, is an amount, too. Amounts become part of the
    note. Rows that name no asset, or have neither a count nor an amount, are left out. The separator is a comma, a
    semicolon or a tab. A bill of materials of `labgym compile --format bom` is an inventory, too.

    Args:
        catalog: the catalog that defines the names; by default `Catalog.load()`.
        remark: receives a sentence about each name that is taken for a misspelling, and about rows that are left out.

    Raises:
        DocumentError: the file is missing, larger than 1 MB, not UTF-8 or not CSV, has no column of assets or more than
            5000 rows, or no row can be imported; names the rows.
    """
    catalog = Catalog.load() if catalog is None else catalog
    table = _headed(read_table(path))
    columns = {role: _columns(table, role) for role in COLUMNS}
    items, problems = [], []
    for number, row in table.rows:
        texts = {role: next((text for c in found if (text := cell(row, c))), "") for role, found in columns.items()}
        names = [cell(row, column) for column in (*columns["asset"], *columns["cas"])]
        match = _match(names, catalog)
        quantity = _quantity(texts, columns, match is not None and catalog.get(match.name).kind == "reagent", table)
        if match is None or quantity is None:
            problems.append(f"row {number} {_problem(texts, match, catalog)}")
            continue
        if match.how == "fuzzy" and remark is not None:
            remark(f"{path}: row {number}: {texts['asset'][:MAX_CELL]!r} is taken for {match.name}")
        count, amount = quantity
        note = "; ".join(text for text in (amount, texts["note"]) if text)
        items.append(InventoryItem(asset=match.name, count=count, note=note[:MAX_CELL]))
    if problems:
        more = f"; and {len(problems) - MOST_LISTED} more" if len(problems) > MOST_LISTED else ""
        listed = "; ".join(problems[:MOST_LISTED]) + more
        if not items:
            raise DocumentError(path, "", f"no row can be imported: {listed}")
        if remark is not None:
            remark(f"{path}: {len(items)} rows are imported, {len(problems)} are not: {listed}")
    return Inventory(items=tuple(items))


def _meaning(header: str) -> str:
    """Return a header without units in parentheses and punctuation."""
    return " ".join("".join(c if c.isalnum() else " " for c in _plain(header)).split()).casefold()


def _plain(header: str) -> str:
    for bracket in "([":
        header = header.partition(bracket)[0] or header
    return header


def _columns(table: CsvTable, role: str) -> list[int]:
    """Return the columns of a role, in the order of `COLUMNS`."""
    meanings = [_meaning(text) for text in table.header]
    return [meanings.index(name) for name in COLUMNS[role] if name in meanings]


def _headed(table: CsvTable) -> CsvTable:
    """Return a table whose header is the first row with a column of assets.

    Raises:
        DocumentError: there is no such column in the first ten rows.
    """
    candidates = [table]
    for index, (_, row) in enumerate(table.rows[: HEADER_ROWS - 1]):
        header = tuple(text.strip().casefold() for text in row)
        candidates.append(replace(table, header=header, rows=table.rows[index + 1 :]))
    for candidate in candidates:
        if _columns(candidate, "asset"):
            return candidate
    raise DocumentError(
        table.path, "", "no column of assets in the header row: call it asset, name or item, and that of pieces count"
    )


def _match(names: Sequence[str], catalog: Catalog) -> Match | None:
    """Return the asset of a row by its names, or the parts of them before a comma or parenthesis."""
    parts = [part for name in names for part in (name[:MAX_CELL], *(name.partition(end)[0] for end in (", ", " (")))]
    return next((match for part in dict.fromkeys(parts) if part and (match := catalog.match(part))), None)


def _quantity(
    texts: Mapping[str, str], columns: Mapping[str, list[int]], reagent: bool, table: CsvTable
) -> tuple[int, str] | None:
    """Return the number of pieces and the amount of each as a text; None if they cannot be read."""
    unit = texts["unit"].casefold().strip(" .")
    amount = " ".join(part for part in (texts["amount"], texts["unit"] if texts["amount"] else "") if part)
    if not texts["count"]:
        if WHOLE.fullmatch(texts["amount"]) and unit in PIECES and not (reagent or _in_units(table, columns["amount"])):
            return _counted(texts["amount"], "")
        return (1, amount) if not amount or any(c.isdecimal() for c in amount) else None
    measured = (not texts["amount"] and unit not in PIECES) or _in_units(table, columns["count"])
    return (1, f"{texts['count']} {texts['unit']}".strip()) if measured else _counted(texts["count"], amount)


def _in_units(table: CsvTable, columns: list[int]) -> bool:
    """Return whether the header of a column names a unit of amounts, such as "Quantity (mL)"."""
    inside = table.header[columns[0]].replace("[", "(").partition("(")[2].strip(" )].") if columns else ""
    return inside in UNITS


def _counted(text: str, amount: str) -> tuple[int, str] | None:
    """Return the number of pieces and the amount of each from the text of a count; None if it is neither."""
    whole, packs = WHOLE.fullmatch(text), PACKS.match(text)
    if packs is not None:
        whole, amount = WHOLE.fullmatch(packs[1]), text[packs.end() :]
    elif whole is None:
        measured = MEASURED.fullmatch(text)
        if measured is not None and measured[2].casefold() in UNITS:
            return 1, text
        if measured is not None and measured[2].casefold() in PIECES:
            whole = WHOLE.fullmatch(measured[1])
    return (int(whole[1]), amount) if whole is not None and int(whole[1]) <= MAX_COUNT else None


def _problem(texts: Mapping[str, str], match: Match | None, catalog: Catalog) -> str:
    """Return why a row is not imported, with the assets that it may mean."""
    name = texts["asset"][:40]
    if match is not None:
        text = (texts["count"] or texts["amount"])[:40]
        return f"{name!r} (count {text!r} must be a whole number from 0 to {MAX_COUNT}, or an amount such as 500 mL)"
    if not name:
        return "'' (the asset is empty)"
    near = ", ".join(catalog.nearest(name, 3))
    return f"{name!r} (no such asset; perhaps {near})" if near else f"{name!r} (no such asset)"
