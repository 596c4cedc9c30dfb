"""Fronts: the depth in front of furniture that stays clear."""

from __future__ import annotations

from collections.abc import Sequence

from labgym.geometry import distance
from labgym.layouts.placement import FLOOR
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.facility.issue import FacilityIssue, issue
from labgym.layouts.rules.thresholds import MOVABLE, Severity
from labgym.layouts.rules.zones import front_zone, standing_in_front


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
    for box, blockers, covered in zip(boxes, standing, building.covers(zones), strict=True):
        if not blockers and covered:
            blocked.append(None)
            continue
        gaps = [distance(box, arrangement.layout.box(blocker)) for blocker in blockers]
        blocked.append((min([*gaps, building.ahead(box)]), blockers))
    return blocked


def front_issues(arrangement: Arrangement) -> list[FacilityIssue]:
    """Return an issue for each piece of furniture whose clearance in front is blocked; a warning for movable ones."""
    issues = []
    assets = arrangement.assets
    rows = [
        row
        for row, placement in enumerate(arrangement.placements)
        if placement.support == FLOOR and assets[row].clearance > 0.0 and assets[row].subtype != "seat"
    ]
    blocked = blocked_fronts(arrangement, rows, [assets[row].clearance for row in rows])
    for row, front in zip(rows, blocked, strict=True):
        if front is None:
            continue
        placement, asset, (free, blockers) = arrangement.placements[row], assets[row], front
        message = f"{placement.id} needs {asset.clearance:g} m clear in front but "
        if blockers:
            message += f"has {free:.2f} m: move {', '.join(blockers)}"
        elif free < asset.clearance:
            message += f"has {free:.2f} m: turn it away from the wall"
        else:  # a wall next to the middle of the front, or a piece that stands outside
            message += "part of that is in a wall or outside: move it"
        ids = (placement.id, *blockers)
        severity: Severity = "warning" if asset.subtype in MOVABLE else "error"
        source = "catalog clearance"
        issues.append(issue("front_clearance", ids, free, asset.clearance, message, source, severity))
    return issues
