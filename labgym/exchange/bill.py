"""Bill of materials: the assets of a layout, grouped, as CSV."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from labgym.assets import Asset
from labgym.exchange.tables import write_table
from labgym.geometry import compose
from labgym.layouts import Layout
from labgym.layouts.placement import FLOOR, WALL, Placement

GROUPS = ("furniture and equipment", "wall equipment", "instruments and accessories", "reagents")
COLUMNS = (
    "group",
    "asset",
    "description",
    "count",
    "to_buy",
    "width_m",
    "depth_m",
    "height_m",
    "mass_kg",
    "cas",
    "storage_class",
    "where",
)


@dataclass(frozen=True)
class BillLine:
    """A line of a bill of materials: placements of one asset and one size.

    Attributes:
        to_buy: number of them that must be bought; None if the layout was generated without an inventory.
        where: id and support of each placement, such as "Beaker_1 on WetBench_1".
    """

    group: str
    asset: Asset
    count: int
    to_buy: int | None
    where: tuple[str, ...]


def bill_of_materials(layout: Layout) -> tuple[BillLine, ...]:
    """Return the bill of materials of a layout, by group and asset; the counts add up to its placements."""
    pieces: dict[tuple[str, str, tuple[float, float, float]], list[Placement]] = {}
    for placement in layout.placements:
        asset = layout.asset(placement.id)
        size = (asset.size.width, asset.size.depth, asset.size.height)
        pieces.setdefault((_group(asset, placement), asset.name, size), []).append(placement)
    inventory = layout.provenance.options.get("inventory")
    left = dict(inventory["existing"]) if inventory else {}
    lines = []
    for group, name, size in sorted(pieces, key=lambda key: (GROUPS.index(key[0]), *key[1:])):
        placements = pieces[group, name, size]
        where = tuple(_where(layout, placement) for placement in placements)
        existing = min(left.get(name, 0), len(placements))
        left[name] = left.get(name, 0) - existing
        to_buy = len(placements) - existing if inventory else None
        lines.append(BillLine(group, layout.asset(placements[0].id), len(placements), to_buy, where))
    return tuple(lines)


def write_bill(layout: Layout, path: str | Path) -> Path:
    """Write the bill of materials of a layout as CSV (UTF-8, lengths in meters) and return the path."""
    return write_table(path, COLUMNS, map(_cells, bill_of_materials(layout)))


def _cells(line: BillLine) -> Iterable[str]:
    asset, size = line.asset, line.asset.size
    chemistry = asset.chemistry
    storage = asset.storage_class or (chemistry.storage_class if chemistry else None)
    lengths = (f"{length:.3f}" for length in (size.width, size.depth, size.height))
    cas = chemistry.cas if chemistry else None
    return (
        line.group,
        asset.name,
        asset.description,
        str(line.count),
        "" if line.to_buy is None else str(line.to_buy),
        *lengths,
        f"{asset.mass:g}",
        cas or "",
        storage or "",
        "; ".join(line.where),
    )


def _group(asset: Asset, placement: Placement) -> str:
    if asset.kind == "reagent":
        return GROUPS[3]
    return {FLOOR: GROUPS[0], WALL: GROUPS[1]}.get(placement.support, GROUPS[2])


def _where(layout: Layout, placement: Placement) -> str:
    if placement.support in (FLOOR, WALL):
        x, y, _ = compose(layout.floor.origin, (*placement.position[:2], 0.0))
        return f"{placement.id} at ({x:.2f}, {y:.2f})"
    return f"{placement.id} on {placement.support}"
