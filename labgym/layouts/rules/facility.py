"""Facility rules besides the metrics: exits, ways out, doors, fronts, hoods, emergency equipment.

A broken rule is an issue. Errors are what the generator and the optimizer never leave behind; warnings are advice.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np

from labgym.documents import Record
from labgym.geometry import BoxArray, OrientedBox, distance, pairwise_distance, penetration
from labgym.layouts.model import FLOOR, WALL, Layout, Room
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.building import Building, OneRoom
from labgym.layouts.rules.egress import narrow_ways
from labgym.layouts.rules.supplies import SOURCES, unsupplied
from labgym.layouts.rules.thresholds import (
    BACK_GAP,
    CORROSIVE_HEIGHT,
    EGRESS_WIDTH,
    MOVABLE,
    ONE_SIDED,
    ROOM_TOLERANCE,
    SHOWER_RADIUS,
    Profile,
    Severity,
)
from labgym.layouts.rules.zones import HEADROOM, front_zone, standing_in, standing_in_front
from labgym.navigation import PLANNING_RADIUS, goal_pose, occupancy
from labgym.navigation.grid_search import distance_field

EXIT_WIDTH = 0.914
"""Clear width of a laboratory's exit door, meters (California Building Code, 24 CCR: 36 in)."""

HOOD_DOOR = 3.0
"""Distance between a hood and a doorway, meters (NFPA 45 and ANSI/AIHA Z9.5: 10 ft, as university guides cite them)."""

HOOD_DOOR_LEAST = 1.0
"""Least distance between a hood and a doorway, meters (BS 7258-2 guidance: 1.0 to 1.5 m)."""

HOOD_OPPOSITE = 3.0
"""No desk within this distance in front of a hood, meters (NFPA 45: not opposite desks)."""

SHOWER_WALK = 16.8
"""Walk from a hood to a safety shower: 10 s at walking pace, 55 ft (ANSI/ISEA Z358.1-2014), meters."""

TALL = 1.5
"""Furniture of this height and more stands against a wall and not back to back, meters."""


class FacilityIssue(Record):
    """A facility rule that a layout breaks.

    Attributes:
        rule: short name.
        severity: `error` (the generator and the optimizer never leave it behind) or `warning`.
        value, limit: meters or a count; value None if there is nothing to measure.
        source: the standard or guide that the rule comes from.
    """

    rule: str
    ids: tuple[str, ...]
    value: float | None
    limit: float
    message: str
    source: str
    severity: Severity = "warning"


def facility_issues(arrangement: Arrangement, profile: Profile) -> tuple[FacilityIssue, ...]:
    """Return every facility rule that a layout breaks."""
    return (
        *building_exit_issues(arrangement.building, profile),
        *placing_issues(arrangement),
        *egress_issues(arrangement),
        *equipment_issues(arrangement),
    )


def equipment_issues(arrangement: Arrangement) -> list[FacilityIssue]:
    """Return the issues of hoods, emergency showers and corrosives: all of them warnings."""
    return [*_hoods(arrangement), *_showers(arrangement), *_corrosives(arrangement)]


def exit_issues(room: Room, profile: Profile) -> list[FacilityIssue]:
    """Return what is wrong with the number and width of a room's doors."""
    return building_exit_issues(OneRoom(room), profile)


def building_exit_issues(building: Building, profile: Profile) -> list[FacilityIssue]:
    """Return what is wrong with the number and width of a building's doors."""
    issues = []
    for label, width in dict.fromkeys((entrance.label, entrance.width) for entrance in building.entrances):
        if width < EXIT_WIDTH - 0.005:
            message = f"{label} is {width:.2f} m wide; an exit needs {EXIT_WIDTH:.2f} m: widen it"
            issues.append(_issue("exit_width", (), width, EXIT_WIDTH, message, "24 CCR (California Building Code)"))
    for place in building.workplaces:
        doors = sum(entrance.space == place.space for entrance in building.entrances)
        if not doors:
            message = f"no exit for {place.area:.0f} m²{place.where}: add a door"
            issues.append(_issue("no_exit", (), 0.0, 1.0, message, "OSHA 29 CFR 1910.36(b)", "error"))
        elif place.area > profile.second_exit_area and doors < 2:
            source = profile.second_exit_source
            message = (
                f"only one exit for {place.area:.0f} m²{place.where}; above {profile.second_exit_area} m² two are "
                f"required ({source}): add a door"
            )
            issues.append(_issue("second_exit", (), float(doors), 2.0, message, source, profile.second_exit))
    return issues


def placing_issues(arrangement: Arrangement) -> list[FacilityIssue]:
    """Return the issues of placing.

    They are blocked door areas, keep-outs and fronts, furniture off walls, a crowded shower, and furniture beyond the
    reach of a service.
    """
    return [
        *_door_areas(arrangement),
        *_keep_outs(arrangement),
        *_backs(arrangement),
        *_fronts(arrangement),
        *_shower_spaces(arrangement),
        *supply_issues(arrangement),
    ]


def supply_issues(arrangement: Arrangement) -> list[FacilityIssue]:
    """Return an issue for each piece beyond the reach of water, gas or exhaust; an error where the floor requires it.

    Floors without service points of a kind are not judged for it.
    """
    issues = []
    for piece in unsupplied(arrangement):
        source = SOURCES[piece.kind]
        severity: Severity = "error" if piece.required else "warning"
        if math.isinf(piece.beyond):
            message = f"{piece.id} needs {piece.kind}, but {piece.space!r} has no such point: add one"
            issues.append(_issue("supply", (piece.id,), None, 0.0, message, source, severity))
        else:
            gap = piece.beyond
            message = f"{piece.id} is {gap:.2f} m beyond the reach of {piece.kind}: move it, or add a point near it"
            issues.append(_issue("supply", (piece.id,), gap, 0.0, message, source, severity))
    return issues


def egress_issues(arrangement: Arrangement) -> list[FacilityIssue]:
    """Return an error for each door that no way of the required width joins with every place of work."""
    issues = []
    for way in narrow_ways(arrangement):
        first, count = way.destinations[0], len(way.destinations) - 1
        where = first + (f" and {count} more" if count else "")
        message = (
            f"the widest way from {way.entrance} to {where} is {way.width:.2f} m; "
            f"{EGRESS_WIDTH:.2f} m is required: widen the passage"
        )
        source = "OSHA 29 CFR 1910.36(g); NFPA 101"
        issues.append(_issue("egress", way.destinations, way.width, EGRESS_WIDTH, message, source, "error"))
    return issues


def hoods(arrangement: Arrangement) -> list[int]:
    """Return the rows of the fume hoods."""
    return [row for row, asset in enumerate(arrangement.assets) if asset.fume_hood]


def box_of(arrangement: Arrangement, row: int) -> OrientedBox:
    """Return an object's bounding box."""
    return arrangement.layout.box(arrangement.placements[row].id)


def shower_walks(arrangement: Arrangement) -> dict[str, float]:
    """Return the walk from the front of each hood to the nearest safety shower, meters; inf if there is no way.

    Measured over the free floor for a disc of the planning radius on a 5 cm grid, which overstates by up to 8%. People
    open interior doors.
    """
    walks = {arrangement.placements[row].id: math.inf for row in hoods(arrangement)}
    showers = _emergency_showers(arrangement)
    if not walks or not showers:
        return walks
    grid = occupancy(with_open_doors(arrangement.layout)).dilated(PLANNING_RADIUS)
    field = distance_field(grid, *(goal_pose(box_of(arrangement, shower))[:2] for shower in showers))
    for hood in walks:
        x, y, _ = goal_pose(arrangement.layout.box(hood))
        if grid.free(x, y):
            walks[hood] = float(field[grid.cell_of(x, y)])
    return walks


def with_open_doors(layout: Layout) -> Layout:
    """Return a layout in which passages take the place of closed interior doors."""
    if layout.floor.is_rectangle:
        return layout
    inner = [(way.wall, way.opening) for way in layout.floor.doorways if not way.exit and way.opening.kind == "door"]
    closed = {(wall, opening) for wall, opening in inner if opening.state == "closed"}
    if not closed:
        return layout
    passage = {"kind": "passage"}
    walls = tuple(
        wall.model_copy(
            update={
                "openings": tuple(
                    opening.model_copy(update=passage) if (index, opening) in closed else opening
                    for opening in wall.openings
                )
            }
        )
        for index, wall in enumerate(layout.floor.walls)
    )
    return layout.replace(floor=layout.floor.model_copy(update={"walls": walls}))


def blocked_front(arrangement: Arrangement, row: int, depth: float) -> tuple[float, tuple[str, ...]] | None:
    """Return how much of a depth in front of an object is free, meters, and what blocks it; None if all is free."""
    return blocked_fronts(arrangement, [row], [depth])[0]


def blocked_fronts(
    arrangement: Arrangement, rows: Sequence[int], depths: Sequence[float]
) -> list[tuple[float, tuple[str, ...]] | None]:
    """Return `blocked_front` for several objects and depths."""
    boxes = [box_of(arrangement, row) for row in rows]
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


def back_distance(arrangement: Arrangement, row: int) -> float:
    """Return the distance between an object's back and the nearest wall along it, meters; its farther end counts.

    It is infinite if no wall runs past both ends of the back.
    """
    gaps = arrangement.building.gaps(box_of(arrangement, row).corners()[:2])
    return float(np.abs(gaps).max(axis=1).min())


def one_sided(arrangement: Arrangement, row: int) -> bool:
    """Whether an object is floor furniture that is used from one side, so that its back belongs against a wall."""
    asset = arrangement.assets[row]
    return (
        arrangement.placements[row].support == FLOOR
        and asset.clearance > 0.0
        and asset.size.depth < ONE_SIDED
        and asset.subtype not in MOVABLE
    )


def _door_areas(arrangement: Arrangement) -> list[FacilityIssue]:
    issues = []
    for entrance in arrangement.building.entrances:
        zone = entrance.area
        blockers = standing_in(arrangement, zone, loose=True, space=entrance.space)
        if blockers:
            message = (
                f"{', '.join(blockers)} in the {zone.width:.2f} x {zone.depth:.2f} m area inside {entrance.label}: "
                "move it out"
            )
            source = "OSHA 29 CFR 1910.36 and .37"
            issues.append(_issue("door_area", blockers, None, zone.depth, message, source, "error"))
    return issues


def _keep_outs(arrangement: Arrangement) -> list[FacilityIssue]:
    issues = []
    for area in arrangement.layout.floor.keep_outs:
        blockers = standing_in(arrangement, area.box, loose=True)
        if blockers:
            reason = f" ({area.reason})" if area.reason else ""
            message = f"{', '.join(blockers)} in the keep-out {area.id!r}{reason}: move it out"
            issues.append(_issue("keep_out", blockers, None, 0.0, message, "the floor's keep-outs", "error"))
    return issues


def _backs(arrangement: Arrangement) -> list[FacilityIssue]:
    issues = []
    for row, placement in enumerate(arrangement.placements):
        if not one_sided(arrangement, row):
            continue
        gap = back_distance(arrangement, row)
        if gap > BACK_GAP and not _back_to_back(arrangement, row):
            distance = None if math.isinf(gap) else gap
            what = "faces no wall" if distance is None else f"is {gap:.2f} m from a wall, over {BACK_GAP:g} m"
            message = f"the back of {placement.id} {what}: move it to a wall"
            source = "planning practice: supply lines, anchoring"
            issues.append(_issue("back_to_wall", (placement.id,), distance, BACK_GAP, message, source, "error"))
    return issues


def _back_to_back(arrangement: Arrangement, row: int) -> bool:
    """Whether low furniture stands with its back against the back or the side of other low furniture."""
    if arrangement.assets[row].size.height >= TALL:
        return False
    box = box_of(arrangement, row)
    (ax, ay), (bx, by) = box.corners()[:2]
    ends = BoxArray.of([OrientedBox(x, y, 0.0, 0.0, 0.0) for x, y in ((ax, ay), (bx, by))])
    others = [
        box_of(arrangement, other)
        for other, placement in enumerate(arrangement.placements)
        if other != row
        and placement.support == FLOOR
        and arrangement.assets[other].clearance > 0.0
        and arrangement.assets[other].size.height < TALL
        and arrangement.assets[other].subtype not in MOVABLE
    ]
    others = [other for other in others if _shows_back(other, box)]
    if not others:
        return False
    return bool((pairwise_distance(ends, BoxArray.of(others)) <= BACK_GAP).any(axis=1).all())


def _shows_back(other: OrientedBox, box: OrientedBox) -> bool:
    """Whether a neighbor is not used from the side on which a box stands; islands are used from their long sides."""
    dx, dy = box.x - other.x, box.y - other.y
    toward = other.front[0] * dx + other.front[1] * dy
    return toward <= 0.0 and (other.depth < ONE_SIDED or abs(toward) < other.depth / 2.0)


def _fronts(arrangement: Arrangement) -> list[FacilityIssue]:
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
        cause = f"move {', '.join(blockers)}" if blockers else "turn it away from the wall"
        message = f"{placement.id} needs {asset.clearance:g} m clear in front but has {free:.2f} m: {cause}"
        ids = (placement.id, *blockers)
        severity: Severity = "warning" if asset.subtype in MOVABLE else "error"
        source = "catalog clearance"
        issues.append(_issue("front_clearance", ids, free, asset.clearance, message, source, severity))
    return issues


def _shower_spaces(arrangement: Arrangement) -> list[FacilityIssue]:
    issues = []
    for row in _emergency_showers(arrangement):
        shower = arrangement.placements[row].id
        box = box_of(arrangement, row)
        center = OrientedBox(box.x, box.y, 0.0, 0.0, 0.0, 0.0, HEADROOM)
        others = [
            other
            for other, placement in enumerate(arrangement.placements)
            if other != row
            and placement.support in (FLOOR, WALL)
            and arrangement.spaces[other] == arrangement.spaces[row]
        ]
        if not others:
            continue
        gaps = pairwise_distance(BoxArray.of([center]), arrangement.take(others))[0].tolist()
        nearest = dict(zip(others, gaps, strict=True))
        for other, part in arrangement.open_parts:
            if other in nearest:
                nearest[other] = min(nearest[other], distance(center, part))
        for other, gap in nearest.items():
            placement = arrangement.placements[other]
            if gap < SHOWER_RADIUS - 1e-3:
                message = (
                    f"{placement.id} is {gap:.2f} m from the center of {shower}, under {SHOWER_RADIUS} m: "
                    f"move it {SHOWER_RADIUS - gap:.2f} m away"
                )
                source = "ANSI/ISEA Z358.1-2014"
                ids = (shower, placement.id)
                issues.append(_issue("shower_clear", ids, gap, SHOWER_RADIUS, message, source, "error"))
    return issues


def _hoods(arrangement: Arrangement) -> list[FacilityIssue]:
    issues = []
    desks = [row for row, asset in enumerate(arrangement.assets) if asset.subtype == "desk"]
    for row in hoods(arrangement):
        box, hood = box_of(arrangement, row), arrangement.placements[row].id
        for entrance in arrangement.building.entrances:
            gap = distance(box, entrance.opening)
            if entrance.space == arrangement.spaces[row] and gap < HOOD_DOOR:
                limit = HOOD_DOOR_LEAST if gap < HOOD_DOOR_LEAST else HOOD_DOOR
                message = f"{hood} is {gap:.2f} m from {entrance.label}, under {limit:g} m: move it away"
                issues.append(_issue("hood_door", (hood,), gap, limit, message, "NFPA 45; ANSI/AIHA Z9.5"))
        zone = front_zone(box, HOOD_OPPOSITE)
        for desk in desks:
            together = arrangement.spaces[desk] == arrangement.spaces[row]
            if together and penetration(zone, box_of(arrangement, desk)) > ROOM_TOLERANCE:
                ids, gap = (hood, arrangement.placements[desk].id), distance(box, box_of(arrangement, desk))
                message = f"{ids[1]} stands opposite {hood} at {gap:.2f} m, under {HOOD_OPPOSITE:g} m: move it aside"
                issues.append(_issue("hood_opposite_desk", ids, gap, HOOD_OPPOSITE, message, "NFPA 45"))
    return issues


def _showers(arrangement: Arrangement) -> list[FacilityIssue]:
    issues = []
    for hood, walk in shower_walks(arrangement).items():
        if walk > SHOWER_WALK:
            length = walk if math.isfinite(walk) else None
            way = "no way leads" if length is None else f"the walk is {walk:.1f} m"
            message = f"{way} from {hood} to an emergency shower; at most {SHOWER_WALK} m is allowed: add a shower"
            issues.append(_issue("shower_walk", (hood,), length, SHOWER_WALK, message, "ANSI/ISEA Z358.1-2014"))
    return issues


def _corrosives(arrangement: Arrangement) -> list[FacilityIssue]:
    issues = []
    for row in arrangement.reagents:
        hazards, bottom = arrangement.assets[row].hazards, float(arrangement.boxes.z[row, 0])
        chemistry = arrangement.assets[row].chemistry
        liquid = chemistry is not None and chemistry.state == "liquid"
        if (hazards.acid or hazards.base) and liquid and bottom > CORROSIVE_HEIGHT:
            reagent = arrangement.placements[row].id
            message = f"corrosive {reagent} stands at {bottom:.2f} m, above {CORROSIVE_HEIGHT} m: use a lower shelf"
            source = "university chemical storage practice"
            issues.append(_issue("corrosive_height", (reagent,), bottom, CORROSIVE_HEIGHT, message, source))
    return issues


def _emergency_showers(arrangement: Arrangement) -> list[int]:
    return [row for row, asset in enumerate(arrangement.assets) if asset.subtype == "shower"]


def _issue(
    rule: str,
    ids: Iterable[str],
    value: float | None,
    limit: float,
    message: str,
    source: str,
    severity: Severity = "warning",
) -> FacilityIssue:
    return FacilityIssue(
        rule=rule, ids=tuple(ids), value=value, limit=limit, message=message, source=source, severity=severity
    )
