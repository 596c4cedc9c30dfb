"""Square: furniture is parallel to a wall of its room or to the axes of its space; what is fastened is at its wall."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from labgym.geometry import pairwise_distance
from labgym.layouts.placement import FLOOR, WALL
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.bounds import back_gap, wall_gap
from labgym.layouts.rules.earlier import standing
from labgym.layouts.rules.facility.backs import back_distances, back_to_back, one_sided
from labgym.layouts.rules.rule import Breach, FacilityRule
from labgym.layouts.rules.site import Site
from labgym.layouts.rules.thresholds import MOVABLE, WALL_TOLERANCE

SKEW_LIMIT_RAD = math.radians(2.0)
"""Greatest angle of furniture to a wall of its room or the axes of its space, radians."""
ROUND = frozenset({"gas_cylinder"})
"""Subtypes that look alike from all sides."""
PLUMBED = frozenset({"sink", "eyewash", "shower"})
"""Subtypes of fixtures that are fastened where their pipes come out."""
PLUMBED_GAP_M = 0.10
"""Greatest distance of a plumbed fixture's back from its wall, or from low furniture with the pipes, meters (IPC 405.4
and 405.5: fixtures are fastened, and their joints with walls sealed; the distance is ours, for cladding and oblique
walls)."""
SECURED_GAP_M = 0.15
"""Greatest distance of a gas cylinder from the wall or the furniture to which it is chained, meters (OSHA 29 CFR
1910.101(b) and CGA P-1: cylinders are secured against falling; the distance is ours, for bracket and chain)."""


def furniture_rows(arrangement: Arrangement) -> list[int]:
    """Return the rows of what is square to the room: furniture on the floor, and what hangs on walls."""
    return [
        row
        for row, (placement, asset) in enumerate(zip(arrangement.placements, arrangement.assets, strict=True))
        if placement.support == WALL or (placement.support == FLOOR and asset.subtype not in MOVABLE | ROUND)
    ]


def _check(site: Site) -> Iterator[Breach]:
    arrangement = site.arrangement
    rows = furniture_rows(arrangement)
    building = arrangement.building
    angles = arrangement.facts("skew", rows, lambda new: building.skew(arrangement.take(new)).tolist())
    for k in np.flatnonzero(np.array(angles) > SKEW_LIMIT_RAD + 1e-6).tolist():
        own = arrangement.placements[rows[k]].id
        degrees, limit = math.degrees(angles[k]), math.degrees(SKEW_LIMIT_RAD)
        message = (
            f"{own} is turned by {degrees:.1f} degrees from the nearest wall and the axes of its space, over {limit:g}"
        )
        yield Breach((own,), angles[k], SKEW_LIMIT_RAD, message, f"turn it by {degrees:.1f} degrees")
    yield from _sideways(arrangement, [row for k, row in enumerate(rows) if angles[k] <= SKEW_LIMIT_RAD + 1e-6])
    yield from _unfastened(arrangement)
    yield from _unsecured(arrangement)


def _unfastened(arrangement: Arrangement) -> Iterator[Breach]:
    """Yield the plumbed fixtures that stand off every wall."""
    rows = [row for row in arrangement.standing if arrangement.assets[row].subtype in PLUMBED]
    rows = [row for row in rows if one_sided(arrangement, row)]
    for row, gap in zip(rows, back_distances(arrangement, rows), strict=True):
        if gap > PLUMBED_GAP_M + 1e-9 and not back_to_back(arrangement, row, PLUMBED_GAP_M):
            own, distance = arrangement.placements[row].id, None if math.isinf(gap) else gap
            what = "faces no wall" if distance is None else f"is {gap:.2f} m from a wall, over {PLUMBED_GAP_M:g} m"
            message = f"the back of {own}, a plumbed fixture, {what}"
            yield Breach((own,), distance, PLUMBED_GAP_M, message, "fasten it to a wall")


def _unsecured(arrangement: Arrangement) -> Iterator[Breach]:
    """Yield the gas cylinders that stand free."""
    rows = [row for row in arrangement.standing if arrangement.assets[row].subtype in ROUND]
    holders = [row for row in arrangement.standing_fast if arrangement.assets[row].subtype not in ROUND]
    gaps = wall_gap(arrangement, rows).tolist() if rows else []
    for row, gap in zip(rows, gaps, strict=True):
        if gap > SECURED_GAP_M + 1e-9:
            away = pairwise_distance(arrangement.take([row]), arrangement.take(holders)).min(initial=gap)
            if away > SECURED_GAP_M + 1e-9:
                own = arrangement.placements[row].id
                message = (
                    f"{own} stands free, {away:.2f} m from a wall or furniture, over {SECURED_GAP_M:g} m: it can fall"
                )
                yield Breach((own,), float(away), SECURED_GAP_M, message, "chain it to a wall or a bench")


def _sideways(arrangement: Arrangement, rows: list[int]) -> Iterator[Breach]:
    """Yield what hangs at a wall with another side than its back; what is at no wall is out of bounds."""
    hung = [row for row in rows if arrangement.placements[row].support == WALL]
    if not hung:
        return
    sides, backs = wall_gap(arrangement, hung).tolist(), back_gap(arrangement, hung).tolist()
    for row, side, back in zip(hung, sides, backs, strict=True):
        if side <= WALL_TOLERANCE + 1e-9 < back:
            own = arrangement.placements[row].id
            yield Breach((own,), None, WALL_TOLERANCE, f"{own} hangs with a side to the wall", "turn its back to it")


RULES = (
    FacilityRule(
        name="square",
        requires="Furniture and wall items are parallel to the nearest wall or to the axes of their space; sinks, "
        "eyewashes and showers have their back at a wall, and gas cylinders stand at a wall or furniture",
        limit=f"{math.degrees(SKEW_LIMIT_RAD):g} degrees; {PLUMBED_GAP_M:g} m; {SECURED_GAP_M:g} m",
        source="planning practice: modules of benches, service lines and ways run in parallel; IPC 405.4 and 405.5; "
        "OSHA 29 CFR 1910.101(b)",
        count=lambda site: len(furniture_rows(site.arrangement)),
        check=_check,
        looks_at=standing,
    ),
)
