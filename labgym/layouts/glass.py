"""Glass: glassware kept from the edge of the surface that it stands on."""

from __future__ import annotations

from labgym.geometry import BoxArray
from labgym.geometry.overlap import paired_inset
from labgym.layouts.arrangement import Arrangement
from labgym.layouts.model import FLOOR, WALL
from labgym.layouts.satisfaction import Instance
from labgym.layouts.thresholds import Profile


def glass_instances(arrangement: Arrangement, profile: Profile) -> tuple[Instance, ...]:
    """Return one instance for each glass instrument on a bench or in a hood; glass in cabinets does not count.

    The distance runs from the footprint to the nearest edge of the furniture's surface, also where the glass stands on
    another instrument; every edge counts, the one at a hood's sash and the one at a wall.
    """
    standing = []
    for row, asset in enumerate(arrangement.assets):
        if asset.kind != "instrument" or not asset.hazards.glass_container:
            continue
        below = _standing_on(arrangement, row)
        if below is not None:
            standing.append((row, arrangement.surface(below)))
    if not standing:
        return ()
    rows = [row for row, _ in standing]
    margins = paired_inset(arrangement.take(rows), BoxArray.of([surface for _, surface in standing]))
    found = []
    for row, margin in zip(rows, margins, strict=True):
        gap = max(float(margin), 0.0)
        satisfaction = min(1.0, gap / profile.glass)
        ids = (arrangement.placements[row].id,)
        found.append(Instance("glass", ids, gap, 0.0, satisfaction, False, "glass near an edge"))
    return tuple(found)


def _standing_on(arrangement: Arrangement, row: int) -> int | None:
    """Row of what touches the furniture: the glass, or the lowest instrument under it.

    None on the floor and in a cabinet.
    """
    for _ in range(len(arrangement)):
        support = arrangement.placements[row].support
        if support in (FLOOR, WALL):
            return None
        carrier = arrangement.row(support)
        if arrangement.assets[carrier].kind == "facility":
            return None if arrangement.assets[carrier].storage_class is not None else row
        row = carrier
    return None
