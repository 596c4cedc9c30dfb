"""Glass: distance of glassware from the edge of its surface."""

from __future__ import annotations

from labgym.geometry import BoxArray
from labgym.geometry.overlap import paired_inset
from labgym.layouts.placement import FLOOR, WALL
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.satisfaction import Instance
from labgym.layouts.rules.thresholds import Profile


def glass_instances(arrangement: Arrangement, profile: Profile) -> tuple[Instance, ...]:
    """Return one instance for each glass instrument on a bench, on a rack or in a hood, but not in a cabinet.

    The distance runs from the footprint to the nearest edge of the supporting surface; the edges at a hood's sash and
    along a wall count too. A piece of an assembled apparatus counts with the footprint of its stand.
    """
    rows = [row for row in arrangement.supported if _at_risk(arrangement, row)]
    if not rows:
        return ()
    standing = [_standing(arrangement, row) for row in rows]
    surfaces = BoxArray.of([arrangement.surface(row) for row in standing])
    instances = []
    for row, margin in zip(rows, paired_inset(arrangement.take(standing), surfaces), strict=True):
        gap = max(float(margin), 0.0)
        ids = (arrangement.placements[row].id,)
        instances.append(Instance("glass", ids, gap, 0.0, min(1.0, gap / profile.glass), False, "glass near an edge"))
    return tuple(instances)


def _standing(arrangement: Arrangement, row: int) -> int:
    """Return the row of what stands on the surface: of the stand for a piece of an apparatus on one."""
    stand = arrangement.layout.apparatus(arrangement.placements[row].id)
    if stand is None or arrangement.placements[arrangement.row(stand)].support in (FLOOR, WALL):
        return row
    return arrangement.row(stand)


def _at_risk(arrangement: Arrangement, row: int) -> bool:
    asset = arrangement.assets[row]
    if asset.kind != "instrument" or not asset.hazards.glass_container:
        return False
    carrier = arrangement.row(arrangement.placements[_standing(arrangement, row)].support)
    return arrangement.assets[carrier].storage_class is None
