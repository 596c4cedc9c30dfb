"""Fixed pieces: objects that stay where they are when a laboratory is generated around them, read from files."""

from __future__ import annotations

import math
import re
from pathlib import Path

from pydantic import ValidationError

from labgym.assets import Catalog
from labgym.documents import document_error
from labgym.errors import DocumentError, OptionError
from labgym.exchange.tables import CsvTable, Remark, asset_name, cell, read_table
from labgym.layouts import Layout, Placement
from labgym.layouts.floor.fields import IDENTIFIER
from labgym.layouts.placement import FLOOR, WALL

ASSETS, IDS = ("asset", "name", "item"), ("id",)
SIZES = ("width", "depth", "height")
SAME_YAW = 0.02
"""Largest difference between the two angles of a row, radians."""
FARTHEST = 100.0
"""Largest coordinate of a piece, meters."""


def read_fixed(
    path: str | Path, catalog: Catalog | None = None, unit: str | None = None, remark: Remark | None = None
) -> tuple[Placement, ...]:
    """Read fixed pieces from a layout, a CSV table or a DXF drawing.

    A layout gives the placements on the floor and on walls that it marks as fixed, or all of them if it marks none. A
    table has the columns `asset`, `x`, `y`, and optionally `id`, `z`, `yaw` (radians) or `yaw_deg` (degrees), `width`,
    `depth` and `height`. A drawing gives its blocks that name an asset, by the attribute ASSET or by their own name.

    Args:
        catalog: defines the names; by default `Catalog.load()`.
        unit: of a drawing: in, ft, mm, cm, dm or m; by default its $INSUNITS.
        remark: receives a sentence about each name of a table that is taken for a misspelling.

    Raises:
        OptionError: the path has another suffix.
        DocumentError: the file is missing or invalid, or has no piece; names the row.
        MissingDependencyError: a drawing, and the extra `cad` is not installed.
    """
    path, catalog = Path(path), Catalog.load() if catalog is None else catalog
    suffix = path.suffix.lower()
    if suffix == ".json":
        pieces = _of_layout(Layout.load(path, catalog))
    elif suffix == ".csv":
        pieces = _of_table(read_table(path), catalog, remark)
    elif suffix == ".dxf":
        from labgym.exchange.dxf.reading import read_furniture

        pieces = read_furniture(path, catalog, unit)
    else:
        raise OptionError(f"fixed pieces {path.name!r} must end in .json (a layout), .csv or .dxf")
    if not pieces:
        raise DocumentError(path, "", "no fixed piece: name at least one object on the floor or on a wall")
    return tuple(piece.model_copy(update={"fixed": True}) for piece in pieces)


def _of_layout(layout: Layout) -> list[Placement]:
    standing = [placement for placement in layout.placements if placement.support in (FLOOR, WALL)]
    return [placement for placement in standing if placement.fixed] or standing


def _of_table(table: CsvTable, catalog: Catalog, remark: Remark | None) -> list[Placement]:
    asset, x, y = (table.required(names) for names in (ASSETS, ("x",), ("y",)))
    ids, counts, pieces = table.column(IDS), dict[str, int](), list[Placement]()
    for number, row in table.rows:
        where = f"row {number}"
        entry = catalog.get(asset_name(cell(row, asset), catalog, table.path, where, remark))
        if entry.placing not in ("floor", "wall"):
            raise DocumentError(table.path, where, f"{entry.name} stands on furniture; only furniture can be fixed")
        counts[entry.name] = counts.get(entry.name, 0) + 1
        name = cell(row, ids) or f"{entry.name}_fixed_{counts[entry.name]}"
        if not re.match(IDENTIFIER, name):
            raise DocumentError(table.path, where, f"id {name[:40]!r} must be letters, digits, '_', '.' or '-'")
        if any(piece.id == name for piece in pieces):
            raise DocumentError(table.path, where, f"the id {name!r} occurs twice: rename one")
        height = _number(table, row, "z", where)
        z = (entry.mount_height if entry.placing == "wall" else 0.0) if height is None else height
        try:
            pieces.append(
                Placement(
                    id=name,
                    asset=entry.name,
                    position=(_coordinate(table, row, x, where), _coordinate(table, row, y, where), z),
                    yaw=_yaw(table, row, where),
                    support=FLOOR if entry.placing == "floor" else WALL,
                    size=_size(table, row, where, entry.size.model_dump()),
                )
            )
        except ValidationError as error:
            raise document_error(f"{table.path}: {where}", error) from None
    return pieces


def _yaw(table: CsvTable, row: tuple[str, ...], where: str) -> float:
    degrees, radians = _number(table, row, "yaw_deg", where), _number(table, row, "yaw", where)
    if degrees is None:
        return radians or 0.0
    if radians is not None and abs(math.remainder(radians - math.radians(degrees), 2.0 * math.pi)) > SAME_YAW:
        raise DocumentError(
            table.path, where, f"yaw {radians:g} rad and yaw_deg {degrees:g} differ: leave one of them empty"
        )
    return math.radians(degrees)


def _size(table: CsvTable, row: tuple[str, ...], where: str, usual: dict[str, float]) -> dict[str, float] | None:
    """The size of a piece if the row gives one of its sides."""
    sides = {name: _number(table, row, name, where) for name in SIZES}
    given = {name: value for name, value in sides.items() if value is not None}
    return {**usual, **given} if given else None


def _coordinate(table: CsvTable, row: tuple[str, ...], column: int, where: str) -> float:
    value = _number(table, row, table.header[column], where)
    if value is None:
        raise DocumentError(table.path, where, f"{table.header[column]} is empty: give meters in the floor's frame")
    if abs(value) > FARTHEST:
        problem = f"{table.header[column]} {value:g} must be {-FARTHEST:g} to {FARTHEST:g} m"
        raise DocumentError(table.path, where, f"{problem}: give meters in the floor's frame")
    return value


def _number(table: CsvTable, row: tuple[str, ...], name: str, where: str) -> float | None:
    text = cell(row, table.column((name,)))
    if not text:
        return None
    try:
        value = float(text[:40].replace(",", "."))
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise DocumentError(table.path, where, f"{name} {text[:40]!r} is not a number")
    return value
