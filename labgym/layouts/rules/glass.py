"""Glass: distance of glassware from the edge of its surface."""

from __future__ import annotations

from labgym.geometry import BoxArray
from labgym.geometry.overlap import paired_inset
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.satisfaction import Instance
from labgym.layouts.rules.thresholds import Profile


def glass_instances(arrangement: Arrangement, profile: Profile) -> tuple[Instance, ...]:
    """Return one instance for each glass instrument on a bench, on a rack or in a hood, but not in a cabinet.

    The distance runs from the footprint to the nearest edge of the supporting surface; the edges at a hood's sash and
    along a wall count too.
    """
    rows = [row for row in arrangement.supported if _at_risk(arrangement, row)]
    if not rows:
        return ()
    surfaces = BoxArray.of([arrangement.surface(row) for row in rows])
    instances = []
    for row, margin in zip(rows, paired_inset(arrangement.take(rows), surfaces), strict=True):
        gap = max(float(margin), 0.0)
        ids = (arrangement.placements[row].id,)
        instances.append(Instance("glass", ids, gap, 0.0, min(1.0, gap / profile.glass), False, "glass near an edge"))
    return tuple(instances)


def _at_risk(arrangement: Arrangement, row: int) -> bool:
    asset = arrangement.assets[row]
    if asset.kind != "instrument" or not asset.hazards.glass_container:
        return False
    carrier = arrangement.row(arrangement.placements[row].support)
    return arrangement.assets[carrier].storage_class is None
