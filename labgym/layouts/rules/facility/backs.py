"""Backs: furniture that is used from one side stands with its back against a wall or other low furniture."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from labgym.geometry import BoxArray, OrientedBox, pairwise_distance
from labgym.geometry.boxes import ROUNDING
from labgym.layouts.placement import FLOOR
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.earlier import standing
from labgym.layouts.rules.rule import Breach, FacilityRule
from labgym.layouts.rules.thresholds import BACK_GAP, MOVABLE, ONE_SIDED

if TYPE_CHECKING:
    from labgym.layouts.rules.site import Site

TALL = 1.5
"""Furniture of this height and more stands against a wall and not back to back, meters."""


def back_distances(arrangement: Arrangement, rows: Sequence[int]) -> list[float]:
    """Return the distance between each back and the nearest wall along it, meters; its farther end counts.

    It is infinite if no wall runs past both ends of a back.
    """

    def find(new: list[int]) -> list[float]:
        backs = np.array([arrangement.box(row).corners()[:2] for row in new])
        gaps: list[float] = np.abs(arrangement.building.gaps(backs)).max(axis=2).min(axis=0).tolist()
        return gaps

    return arrangement.facts("back", rows, find)


def one_sided(arrangement: Arrangement, row: int) -> bool:
    """Whether an object is floor furniture that is used from one side, so that its back belongs against a wall."""
    asset = arrangement.assets[row]
    return (
        arrangement.placements[row].support == FLOOR
        and asset.clearance > 0.0
        and asset.size.depth < ONE_SIDED
        and asset.subtype not in MOVABLE
    )


def _check(site: Site) -> Iterator[Breach]:
    arrangement = site.arrangement
    rows = [row for row in arrangement.standing if one_sided(arrangement, row)]
    for row, gap in zip(rows, back_distances(arrangement, rows), strict=True):
        placement = arrangement.placements[row]
        if gap > BACK_GAP and not back_to_back(arrangement, row, BACK_GAP):
            distance = None if math.isinf(gap) else gap
            what = "faces no wall" if distance is None else f"is {gap:.2f} m from a wall, over {BACK_GAP:g} m"
            message = f"the back of {placement.id} {what}"
            yield Breach((placement.id,), distance, BACK_GAP, message, "move it to a wall")


def _back_neighbors(arrangement: Arrangement) -> NDArray[np.intp]:
    """Rows of the low furniture against which other low furniture may stand."""
    rows = [
        row
        for row, (placement, asset) in enumerate(zip(arrangement.placements, arrangement.assets, strict=True))
        if placement.support == FLOOR
        and asset.clearance > 0.0
        and asset.size.height < TALL
        and asset.subtype not in MOVABLE
    ]
    return np.array(rows, dtype=np.intp)


def back_to_back(arrangement: Arrangement, row: int, gap: float) -> bool:
    """Whether low furniture stands with its back at most `gap` meters from the back or side of other low furniture."""
    if arrangement.assets[row].size.height >= TALL:
        return False
    neighbors = _back_neighbors(arrangement)
    box = arrangement.box(row)
    (ax, ay), (bx, by) = box.corners()[:2]
    ends = BoxArray.of([OrientedBox(x, y, 0.0, 0.0, 0.0) for x, y in ((ax, ay), (bx, by))])
    low, high = (corners[neighbors, :2] for corners in arrangement.bounds)
    reach = gap + ROUNDING
    near = [((low <= end + reach) & (high >= end - reach)).all(axis=1) for end in ends.centre]
    boxes = [arrangement.box(int(other)) for other in neighbors[near[0] | near[1]] if other != row]
    others = [other for other in boxes if _shows_back(other, box)]
    if not others:
        return False
    return bool((pairwise_distance(ends, BoxArray.of(others)) <= gap).any(axis=1).all())


def _shows_back(other: OrientedBox, box: OrientedBox) -> bool:
    """Whether a neighbor is not used from the side on which a box stands; islands are used from their long sides."""
    dx, dy = box.x - other.x, box.y - other.y
    toward = other.front[0] * dx + other.front[1] * dy
    return toward <= 0.0 and (other.depth < ONE_SIDED or abs(toward) < other.depth / 2.0)


RULES = (
    FacilityRule(
        name="back_to_wall",
        requires="Furniture that is used from one side stands with its back against a wall or other low furniture",
        limit=f"{BACK_GAP:g} m",
        source="planning practice: supply lines, anchoring",
        count=lambda site: sum(one_sided(site.arrangement, row) for row in site.arrangement.standing),
        check=_check,
        group="placing",
        looks_at=standing,
    ),
)
