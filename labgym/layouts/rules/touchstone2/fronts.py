"""Fronts: the free depth before furniture, so that nothing faces a wall and hoods have their clearance."""

from __future__ import annotations

from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.facility.fronts import blocked_fronts
from labgym.layouts.rules.satisfaction import Instance


def front_instances(arrangement: Arrangement) -> tuple[Instance, ...]:
    """Return one instance for each piece of floor furniture with a clearance in the catalog, movable ones left out.

    The satisfaction is the free share of that depth; a blocked front is a hard violation. The first id is the
    furniture, the others are what blocks it; without others it is a wall.
    """
    rows = arrangement.workplaces
    if not rows:
        return ()
    depths = [arrangement.assets[row].clearance for row in rows]
    instances = []
    for row, depth, blocked in zip(rows, depths, blocked_fronts(arrangement, rows, depths), strict=True):
        own = arrangement.placements[row].id
        if blocked is None:
            instances.append(Instance("front", (own,), depth, depth, 1.0, False))
            continue
        free, blockers = blocked
        share = min(max(free, 0.0) / depth, 1.0)
        note = f"blocked by {', '.join(blockers)}" if blockers else "faces a wall"
        instances.append(Instance("front", (own, *blockers), free, depth, share, True, note))
    return tuple(instances)
