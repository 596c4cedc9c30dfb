"""Fronts: the depth in front of furniture that stays clear."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from labgym.geometry import distance
from labgym.geometry.boxes import ROUNDING
from labgym.layouts.placement import FLOOR
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.earlier import standing
from labgym.layouts.rules.rule import Breach, FacilityRule, Instance, Term
from labgym.layouts.rules.thresholds import MOVABLE, Severity
from labgym.layouts.rules.zones import front_zone, standing_in_front

if TYPE_CHECKING:
    from labgym.layouts.rules.site import Site


def blocked_front(arrangement: Arrangement, row: int, depth: float) -> tuple[float, tuple[str, ...]] | None:
    """Return how much of a depth in front of an object is free, meters, and what blocks it; None if all is free."""
    return blocked_fronts(arrangement, [row], [depth])[0]


def blocked_fronts(
    arrangement: Arrangement, rows: Sequence[int], depths: Sequence[float]
) -> list[tuple[float, tuple[str, ...]] | None]:
    """Return `blocked_front` for several objects and depths."""
    boxes = [arrangement.box(row) for row in rows]
    zones = [front_zone(box, depth) for box, depth in zip(boxes, depths, strict=True)]
    building = arrangement.building
    standing = standing_in_front(arrangement, list(zip(rows, zones, strict=True)))
    blocked: list[tuple[float, tuple[str, ...]] | None] = []
    for box, depth, blockers, covered in zip(boxes, depths, standing, building.covers(zones), strict=True):
        if not blockers and covered:
            blocked.append(None)
            continue
        gaps = [distance(box, arrangement.layout.box(blocker)) for blocker in blockers]
        ahead = building.ahead(box)  # inf outside the floor, before which no wall stands
        blocked.append((min([*gaps, ahead if math.isfinite(ahead) else depth]), blockers))
    return blocked


def _cleared(arrangement: Arrangement, rows: list[int]) -> list[tuple[float, tuple[str, ...]] | None]:
    """Return `blocked_front` for several objects and the catalog's clearances."""
    depths = np.array([arrangement.assets[row].clearance for row in rows])
    reach = (np.linalg.norm(arrangement.boxes.half[rows], axis=1) + depths + ROUNDING)[:, None]
    middles = arrangement.boxes.centre[rows]

    def find(new: list[int]) -> list[tuple[float, tuple[str, ...]] | None]:
        return blocked_fronts(arrangement, new, [arrangement.assets[row].clearance for row in new])

    return arrangement.local_facts("front", rows, np.column_stack([middles - reach, middles + reach]), find)


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
    for row, depth, blocked in zip(rows, depths, _cleared(arrangement, rows), strict=True):
        own = arrangement.placements[row].id
        if blocked is None:
            instances.append(Instance("front", (own,), depth, depth, 1.0, False))
            continue
        free, blockers = blocked
        share = min(max(free, 0.0) / depth, 1.0)
        note = f"blocked by {', '.join(blockers)}" if blockers else "faces a wall"
        instances.append(Instance("front", (own, *blockers), free, depth, share, True, note))
    return tuple(instances)


def _blocked(site: Site) -> Iterator[Breach]:
    """Yield the furniture whose clearance in front is blocked; that of movable objects is a warning."""
    arrangement = site.arrangement
    assets = arrangement.assets
    rows = [
        row
        for row, placement in enumerate(arrangement.placements)
        if placement.support == FLOOR and assets[row].clearance > 0.0 and assets[row].subtype != "seat"
    ]
    blocked = _cleared(arrangement, rows)
    for row, front in zip(rows, blocked, strict=True):
        if front is None:
            continue
        placement, asset, (free, blockers) = arrangement.placements[row], assets[row], front
        message = f"{placement.id} needs {asset.clearance:g} m clear in front but "
        if blockers:
            problem, remedy = f"has {free:.2f} m", f"move {', '.join(blockers)}"
        elif free < asset.clearance:
            problem, remedy = f"has {free:.2f} m", "turn it away from the wall"
        else:  # a wall next to the middle of the front, or a piece that stands outside
            problem, remedy = "part of that is in a wall or outside", "move it"
        ids = (placement.id, *blockers)
        severity: Severity = "warning" if asset.subtype in MOVABLE else "error"
        yield Breach(ids, free, asset.clearance, message + problem, remedy, severity=severity)


def _clear(front: Instance) -> tuple[float, str, str]:
    free, own = front.distance or 0.0, front.ids[0]
    message = f"{own} needs {front.limit:g} m clear in front but has {free:.2f} m: {front.note}"
    remedy = f"move {', '.join(front.ids[1:])} away" if front.ids[1:] else f"turn {own} away from the wall"
    return max(front.limit - free, 0.0), message, remedy


FRONTS = Term(
    name="front",
    metric="fronts",
    requires="The catalog's clearance in front of floor furniture is free",
    source="catalog clearance",
    instances=lambda site: front_instances(site.arrangement),
    remedy=_clear,
    lowers="geometry",
    chemical=False,
    looks_at=standing,
)
RULES = (
    FacilityRule(
        name="front_clearance",
        requires="The catalog's clearance in front of floor furniture is free",
        limit="by asset",
        source="catalog clearance",
        count=lambda site: len(site.arrangement.workplaces),
        check=_blocked,
        group="placing",
        scores_warnings=False,
        term=FRONTS.name,
        looks_at=standing,
    ),
)
