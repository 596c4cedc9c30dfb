"""Glass: distance of glassware from the edge of its surface."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from labgym.assets import Asset
from labgym.geometry import BoxArray
from labgym.geometry.overlap import paired_inset
from labgym.layouts.placement import FLOOR, WALL
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.bounds import fallen
from labgym.layouts.rules.rule import Instance, Term
from labgym.layouts.rules.thresholds import Profile

if TYPE_CHECKING:
    from labgym.layouts.rules.site import Site


def glass_instances(arrangement: Arrangement, profile: Profile) -> tuple[Instance, ...]:
    """Return one instance for each glass instrument on a bench, on a rack or in a hood, but not in a cabinet.

    The distance runs from the footprint to the nearest edge of the supporting surface; the edges at a hood's sash and
    along a wall count too. A piece of an assembled apparatus counts with the footprint of its stand.
    """
    fragile = [row for row in arrangement.supported if _fragile(arrangement.assets[row])]
    gaps = arrangement.facts("glass", fragile, lambda new: _margins(arrangement, new), carried=True)
    instances = []
    for row, gap in zip(fragile, gaps, strict=True):
        if gap is None:
            continue
        ids = (arrangement.placements[row].id,)
        instances.append(Instance("glass", ids, gap, 0.0, min(1.0, gap / profile.glass), False, "glass near an edge"))
    return tuple(instances)


def all_glass_instances(arrangement: Arrangement, profile: Profile) -> tuple[Instance, ...]:
    """Return the instances of `glass_instances`, and one that scores 0 for each glass instrument on the floor.

    Glass on an object that lies on the floor, such as a beaker on a fallen hotplate, is on the floor too.
    """
    rows = [row for row, asset in enumerate(arrangement.assets) if _fragile(asset)]

    def find(new: list[int]) -> list[bool]:
        return [fallen(arrangement, row) for row in new]

    on_low = arrangement.facts("fallen", rows, find, carried=True)
    low = {arrangement.placements[row].id for row, is_low in zip(rows, on_low, strict=True) if is_low}
    standing = tuple(one for one in glass_instances(arrangement, profile) if one.ids[0] not in low)
    on_floor = (
        Instance("glass", (placement.id,), 0.0, 0.0, 0.0, False, "glass on the floor")
        for placement in arrangement.placements
        if placement.id in low
    )
    return (*standing, *on_floor)


def _standing(arrangement: Arrangement, row: int) -> int:
    """Return the row of what stands on the surface: of the stand for a piece of an apparatus on one."""
    stand = arrangement.layout.apparatus(arrangement.placements[row].id)
    if stand is None or arrangement.placements[arrangement.row(stand)].support in (FLOOR, WALL):
        return row
    return arrangement.row(stand)


def _fragile(asset: Asset) -> bool:
    return asset.kind == "instrument" and asset.hazards.glass_container


def _fragile_and_carriers(site: Site, row: int) -> object:
    asset = site.arrangement.assets[row]
    return site.arrangement.placements[row] if asset.surfaces or _fragile(asset) else None


def _margins(arrangement: Arrangement, rows: list[int]) -> list[float | None]:
    """Return the distance of glassware from the edge of the surface, meters; None of what is in a cabinet."""
    standing = [_standing(arrangement, row) for row in rows]
    surfaces = BoxArray.of([arrangement.surface(row) for row in standing])
    margins = paired_inset(arrangement.take(standing), surfaces).tolist()
    carriers = [arrangement.row(arrangement.placements[row].support) for row in standing]
    return [
        max(margin, 0.0) if arrangement.assets[carrier].storage_class is None else None
        for margin, carrier in zip(margins, carriers, strict=True)
    ]


GLASS_ON_SURFACES = Term(
    name="glass",
    metric="glass",
    requires="Glassware stands away from the edges of its surface",
    source="Prudent Practices; profile `glass`",
    instances=lambda site: glass_instances(site.arrangement, site.profile),
    looks_at=_fragile_and_carriers,
)
GLASS = replace(
    GLASS_ON_SURFACES,
    requires="Glassware stands on furniture, away from the edges of its surface",
    instances=lambda site: all_glass_instances(site.arrangement, site.profile),
)
