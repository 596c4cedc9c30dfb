"""Planning practice, as advice: exits open outward, hoods off the traffic, islands in line, even aisles."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import combinations

import numpy as np

from labgym.geometry import OrientedBox, distance
from labgym.layouts.placement import FLOOR
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.earlier import nothing, standing
from labgym.layouts.rules.rule import Breach, FacilityRule
from labgym.layouts.rules.site import Site
from labgym.layouts.rules.thresholds import BACK_GAP, ONE_SIDED
from labgym.layouts.rules.zones import front_zone

HOOD_TRAFFIC_M = 1.0
"""Least distance of a hood's sash from a way between two doors, meters (BS 7258-2, CEN/TS 14175-5)."""
ALIGNED_M = 0.05
"""Islands are in line if their middles differ by at most this across the line, meters."""
EVEN_AISLES_M = 0.10
"""Greatest difference of the widths of two aisles between islands of a room, meters."""
PARALLEL_RAD = math.radians(2.0)


def _exits(site: Site) -> list[tuple[str, bool]]:
    """Return the label of each door that leads out, and whether it opens inward."""
    return [
        (way.label, way.opens_into(way.spaces[0]))
        for way in site.arrangement.layout.floor.doorways
        if way.exit and way.opening.kind == "door"
    ]


def _inward(site: Site) -> Iterator[Breach]:
    for label, inward in _exits(site):
        if inward:
            yield Breach((), None, 0.0, f"{label} opens inward, against people who leave", "let it open outward")


def _hoods(site: Site, row: int) -> object:
    return site.arrangement.placements[row] if site.arrangement.assets[row].fume_hood else None


def _crossed(site: Site) -> Iterator[Breach]:
    arrangement = site.arrangement
    for row in arrangement.hoods:
        own = [one.pose for one in arrangement.building.entrances if one.space == arrangement.spaces[row]]
        face = front_zone(arrangement.box(row), 0.0)
        for (ax, ay, _), (bx, by, _) in combinations(own, 2):
            length, yaw = math.dist((ax, ay), (bx, by)), math.atan2(by - ay, bx - ax)
            gap = distance(face, OrientedBox((ax + bx) / 2.0, (ay + by) / 2.0, length, 0.0, yaw))
            if gap < HOOD_TRAFFIC_M - 1e-9:
                hood = arrangement.placements[row].id
                message = (
                    f"the sash of {hood} is {gap:.2f} m from the way between two doors, under {HOOD_TRAFFIC_M:g} m"
                )
                yield Breach((hood,), gap, HOOD_TRAFFIC_M, message, f"move it {HOOD_TRAFFIC_M - gap:.2f} m away")
                break


def islands(site: Site) -> dict[int, list[int]]:
    """Return the rows of the islands of each space with two and more: benches that stand free and have two sides."""
    own: dict[int, list[int]] = {}
    for row, (placement, asset) in enumerate(zip(site.arrangement.placements, site.arrangement.assets, strict=True)):
        if placement.support != FLOOR or asset.subtype != "workbench" or asset.size.depth < ONE_SIDED:
            continue
        if _wall_gap(site.arrangement, row) > BACK_GAP:
            own.setdefault(site.arrangement.spaces[row], []).append(row)
    return {space: rows for space, rows in own.items() if len(rows) > 1}


def _wall_gap(arrangement: Arrangement, row: int) -> float:
    """Return the distance of the nearest corner of an object from a wall, meters."""

    def find(new: list[int]) -> list[float]:
        return [float(arrangement.building.gaps(arrangement.corners[one]).min()) for one in new]

    return arrangement.facts("corner", [row], find)[0]


def _apart(site: Site, first: int, second: int) -> tuple[float, float]:
    """Return how far apart the middles of two islands are along the two axes of the first, meters."""
    box, other = site.arrangement.box(first), site.arrangement.box(second)
    if abs(math.remainder(box.yaw - other.yaw, math.pi / 2.0)) > PARALLEL_RAD:
        return math.inf, math.inf
    x, y = box.to_local(other.x, other.y)
    return abs(x), abs(y)


def _unaligned(site: Site) -> Iterator[Breach]:
    for rows in islands(site).values():
        for row in rows:
            offset = min(min(_apart(site, row, other)) for other in rows if other != row)
            if offset > ALIGNED_M + 1e-9:
                own = site.arrangement.placements[row].id
                value = offset if math.isfinite(offset) else None
                what = "is parallel to no other island" if value is None else f"is {offset:.2f} m out of line"
                message = f"{own} {what}, over {ALIGNED_M:g} m"
                yield Breach((own,), value, ALIGNED_M, message, "move it in line with the other islands of its room")


def aisles(site: Site, rows: list[int]) -> list[tuple[float, int, int]]:
    """Return the aisles between islands: width in meters, and the rows of the two that face each other next to it."""
    found = []
    for first, second in combinations(rows, 2):
        (dx, dy), box, other = _apart(site, first, second), site.arrangement.box(first), site.arrangement.box(second)
        turned = abs(math.remainder(box.yaw - other.yaw, math.pi)) > math.pi / 4.0
        width, depth = (other.depth, other.width) if turned else (other.width, other.depth)
        beside, before = dx - (box.width + width) / 2.0, dy - (box.depth + depth) / 2.0
        if before > 0.0 > beside:
            found.append((before, first, second))
    nearest = {row: min((aisle for aisle in found if row in aisle[1:]), default=None) for row in rows}
    return [aisle for aisle in found if aisle in nearest.values()]


def _uneven(site: Site) -> Iterator[Breach]:
    for rows in islands(site).values():
        own = aisles(site, rows)
        if len(own) < 2:
            continue
        middle = float(np.median([width for width, _, _ in own]))
        for width, first, second in own:
            if abs(width - middle) > EVEN_AISLES_M + 1e-9:
                ids = tuple(site.arrangement.placements[row].id for row in (first, second))
                message = f"the aisle between {ids[0]} and {ids[1]} is {width:.2f} m wide, the others {middle:.2f} m"
                yield Breach(ids, width, middle, message, f"move one of them by {abs(width - middle):.2f} m")


RULES = (
    FacilityRule(
        name="exit_swing",
        requires="Doors that lead out open outward",
        limit="each exit",
        source="NFPA 101, 7.2.1.4.2; IBC 1010.1.2.1",
        severity="warning",
        count=lambda site: len(_exits(site)),
        check=_inward,
        looks_at=nothing,
    ),
    FacilityRule(
        name="hood_traffic",
        requires="The sash of a hood is off the straight ways between doors of its room",
        limit=f"{HOOD_TRAFFIC_M:g} m",
        source="BS 7258-2; CEN/TS 14175-5; NFPA 45",
        severity="warning",
        count=lambda site: len(site.arrangement.hoods),
        check=_crossed,
        looks_at=_hoods,
    ),
    FacilityRule(
        name="islands_in_line",
        requires="Islands of a room stand in rows or columns",
        limit=f"{ALIGNED_M:g} m out of line",
        source="planning practice: service lines and ways run straight",
        severity="warning",
        count=lambda site: sum(map(len, islands(site).values())),
        check=_unaligned,
        looks_at=standing,
    ),
    FacilityRule(
        name="even_aisles",
        requires="Aisles between the islands of a room have one width",
        limit=f"{EVEN_AISLES_M:g} m",
        source="planning practice: modules of equal width",
        severity="warning",
        count=lambda site: sum(len(aisles(site, rows)) for rows in islands(site).values()),
        check=_uneven,
        looks_at=standing,
    ),
)
