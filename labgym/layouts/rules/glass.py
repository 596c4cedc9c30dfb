"""Glass: glassware kept from the edge of the surface that it stands on."""

from __future__ import annotations

from labgym.geometry import BoxArray
from labgym.geometry.overlap import paired_inset
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.satisfaction import Instance
from labgym.layouts.rules.thresholds import Profile


def glass_instances(arrangement: Arrangement, profile: Profile) -> tuple[Instance, ...]:
    """Return one instance for each glass instrument on a bench, a rack or in a hood; glass in cabinets does not count.

    The distance runs from the footprint to the nearest edge of the surface that carries it; every edge counts, also
    the one at a hood's sash and the one along a wall.
    """
    rows = [row for row in arrangement.supported if _at_risk(arrangement, row)]
    if not rows:
        return ()
    surfaces = BoxArray.of([arrangement.surface(row) for row in rows])
    found = []
    for row, margin in zip(rows, paired_inset(arrangement.take(rows), surfaces), strict=True):
        gap = max(float(margin), 0.0)
        ids = (arrangement.placements[row].id,)
        found.append(Instance("glass", ids, gap, 0.0, min(1.0, gap / profile.glass), False, "glass near an edge"))
    return tuple(found)


def _at_risk(arrangement: Arrangement, row: int) -> bool:
    asset = arrangement.assets[row]
    if asset.kind != "instrument" or not asset.hazards.glass_container:
        return False
    carrier = arrangement.row(arrangement.placements[row].support)
    return arrangement.assets[carrier].storage_class is None
