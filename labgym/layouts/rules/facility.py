"""Facility rules outside the metrics: egress, doors, hoods, emergency equipment. What is not kept is a warning."""

from __future__ import annotations

import math

from labgym.documents import Record
from labgym.geometry import OrientedBox, distance, penetration
from labgym.layouts.model import FLOOR
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.thresholds import CORROSIVE_HEIGHT, ROOM_TOLERANCE
from labgym.layouts.rules.zones import door_area, doorway, front_zone, in_room, standing_in
from labgym.navigation import PLANNING_RADIUS, goal_pose, occupancy
from labgym.navigation.grid_search import distance_field

EXIT_WIDTH = 0.914
"""Clear width of a laboratory's exit door, metres (California Building Code, 24 CCR: 36 in)."""

SECOND_EXIT_AREA = 18.6
"""Floor area from which a laboratory has two exits, square metres (24 CCR, 200 ft2)."""

HOOD_DOOR = 3.0
"""A hood's distance to a doorway, metres (NFPA 45 and ANSI/AIHA Z9.5: 10 ft, as university guides cite them)."""

HOOD_DOOR_LEAST = 1.0
"""Under this distance a hood stands beside the doorway, metres (BS 7258-2 guidance: 1.0 to 1.5 m)."""

HOOD_OPPOSITE = 3.0
"""No desk within this distance before a hood, metres (NFPA 45: not opposite desks)."""

SHOWER_WALK = 16.8
"""Walk from a hood to a safety shower: 10 s at walking pace, 55 ft (ANSI/ISEA Z358.1-2014), metres."""


class FacilityWarning(Record):
    """A facility rule outside the metrics that is not kept.

    Attributes:
        rule: short name. value, limit: metres or a count; value None where there is nothing to measure.
        source: the standard or guide that the rule comes from.
    """

    rule: str
    ids: tuple[str, ...]
    value: float | None
    limit: float
    message: str
    source: str


def facility_warnings(arrangement: Arrangement) -> tuple[FacilityWarning, ...]:
    """Return the facility rules that a layout does not keep."""
    return (
        *_exits(arrangement),
        *_door_areas(arrangement),
        *_hoods(arrangement),
        *_showers(arrangement),
        *_fronts(arrangement),
        *_corrosives(arrangement),
    )


def hoods(arrangement: Arrangement) -> list[int]:
    """Return the rows of the fume hoods."""
    return [row for row, asset in enumerate(arrangement.assets) if asset.fume_hood]


def box_of(arrangement: Arrangement, row: int) -> OrientedBox:
    """Return an object's bounding box."""
    return arrangement.layout.box(arrangement.placements[row].id)


def shower_walks(arrangement: Arrangement) -> dict[str, float]:
    """Return the walk from in front of each hood to the nearest safety shower, metres; inf where there is no way.

    Measured over the free floor for a disc of the planning radius on a 5 cm grid, which overstates by up to 8%.
    """
    walks = {arrangement.placements[row].id: math.inf for row in hoods(arrangement)}
    showers = [row for row, asset in enumerate(arrangement.assets) if asset.subtype == "shower"]
    if not walks or not showers:
        return walks
    grid = occupancy(arrangement.layout).dilated(PLANNING_RADIUS)
    for shower in showers:
        x, y, _ = goal_pose(box_of(arrangement, shower))
        field = distance_field(grid, (x, y))
        for hood in walks:
            hx, hy, _ = goal_pose(arrangement.layout.box(hood))
            if grid.free(hx, hy):
                row, column = grid.cell_of(hx, hy)
                walks[hood] = min(walks[hood], float(field[row, column]))
    return walks


def blocked_front(arrangement: Arrangement, row: int, depth: float) -> tuple[float, tuple[str, ...]] | None:
    """Return how much of the wanted depth before an object is free, and what blocks it; None where all is free."""
    box = box_of(arrangement, row)
    zone = front_zone(box, depth)
    placement = arrangement.placements[row].id
    blockers = standing_in(arrangement, zone, ignore=(placement,))
    if not blockers and in_room(arrangement.layout.room, zone):
        return None
    gaps = [distance(box, arrangement.layout.box(blocker)) for blocker in blockers]
    return min([*gaps, _to_wall(arrangement, box)]), blockers


def _to_wall(arrangement: Arrangement, box: OrientedBox) -> float:
    """Free depth in front of a box up to the wall."""
    room, (fx, fy) = arrangement.layout.room, box.front
    corners = box.corners()[2:]
    reaches = []
    for x, y in corners:
        along_x = ((room.width if fx > 0 else 0.0) - x) / fx if abs(fx) > 1e-9 else math.inf
        along_y = ((room.depth if fy > 0 else 0.0) - y) / fy if abs(fy) > 1e-9 else math.inf
        reaches.append(min(along_x, along_y))
    return float(max(min(reaches), 0.0))


def _exits(arrangement: Arrangement) -> list[FacilityWarning]:
    room, found = arrangement.layout.room, []
    source = "24 CCR (California Building Code)"
    for door in room.doors:
        if door.width < EXIT_WIDTH - 0.005:
            message = f"the {door.wall} door is {door.width:.2f} m wide, an exit wants {EXIT_WIDTH:.2f} m"
            found.append(_warning("exit_width", (), door.width, EXIT_WIDTH, message, source))
    area = room.width * room.depth
    if area >= SECOND_EXIT_AREA and len(room.doors) < 2:
        message = f"{area:.0f} m2 have one door; from {SECOND_EXIT_AREA} m2 a laboratory wants a second exit"
        found.append(_warning("second_exit", (), float(len(room.doors)), 2.0, message, source))
    return found


def _door_areas(arrangement: Arrangement) -> list[FacilityWarning]:
    found = []
    for door in arrangement.layout.room.doors:
        zone = door_area(arrangement.layout.room, door)
        blockers = standing_in(arrangement, zone)
        if blockers:
            message = f"{', '.join(blockers)} in the area inside the {door.wall} door"
            found.append(_warning("door_area", blockers, None, zone.depth, message, "OSHA 29 CFR 1910.36 and .37"))
    return found


def _hoods(arrangement: Arrangement) -> list[FacilityWarning]:
    found = []
    room = arrangement.layout.room
    desks = [row for row, asset in enumerate(arrangement.assets) if asset.subtype == "desk"]
    for row in hoods(arrangement):
        box, hood = box_of(arrangement, row), arrangement.placements[row].id
        for door in room.doors:
            gap = distance(box, doorway(room, door))
            if gap < HOOD_DOOR:
                limit = HOOD_DOOR_LEAST if gap < HOOD_DOOR_LEAST else HOOD_DOOR
                message = f"{hood} is {gap:.2f} m from the {door.wall} door, under {limit:g} m"
                found.append(_warning("hood_door", (hood,), gap, limit, message, "NFPA 45; ANSI/AIHA Z9.5"))
        zone = front_zone(box, HOOD_OPPOSITE)
        for desk in desks:
            if penetration(zone, box_of(arrangement, desk)) > ROOM_TOLERANCE:
                ids, gap = (hood, arrangement.placements[desk].id), distance(box, box_of(arrangement, desk))
                message = f"{ids[1]} stands opposite {hood}, {gap:.2f} m away"
                found.append(_warning("hood_opposite_desk", ids, gap, HOOD_OPPOSITE, message, "NFPA 45"))
    return found


def _showers(arrangement: Arrangement) -> list[FacilityWarning]:
    found = []
    for hood, walk in shower_walks(arrangement).items():
        if walk > SHOWER_WALK:
            known = walk if math.isfinite(walk) else None
            way = f"{walk:.1f} m" if known is not None else "no way"
            message = f"{way} from {hood} to a safety shower, at most {SHOWER_WALK} m"
            found.append(_warning("shower_walk", (hood,), known, SHOWER_WALK, message, "ANSI/ISEA Z358.1-2014"))
    return found


def _fronts(arrangement: Arrangement) -> list[FacilityWarning]:
    found = []
    for row, (placement, asset) in enumerate(zip(arrangement.placements, arrangement.assets, strict=True)):
        if placement.support != FLOOR or asset.clearance <= 0.0 or asset.subtype == "seat":
            continue
        blocked = blocked_front(arrangement, row, asset.clearance)
        if blocked is not None:
            free, blockers = blocked
            message = f"{free:.2f} m free in front of {placement.id}, {asset.clearance:g} m wanted"
            ids = (placement.id, *blockers)
            found.append(_warning("front_clearance", ids, free, asset.clearance, message, "catalogue clearance"))
    return found


def _corrosives(arrangement: Arrangement) -> list[FacilityWarning]:
    found = []
    for row in arrangement.reagents:
        hazards, bottom = arrangement.assets[row].hazards, float(arrangement.boxes.z[row, 0])
        chemistry = arrangement.assets[row].chemistry
        liquid = chemistry is not None and chemistry.state == "liquid"
        if (hazards.acid or hazards.base) and liquid and bottom > CORROSIVE_HEIGHT:
            reagent = arrangement.placements[row].id
            message = f"corrosive {reagent} stands {bottom:.2f} m high, above {CORROSIVE_HEIGHT} m"
            source = "university chemical storage practice"
            found.append(_warning("corrosive_height", (reagent,), bottom, CORROSIVE_HEIGHT, message, source))
    return found


def _warning(
    rule: str, ids: tuple[str, ...], value: float | None, limit: float, message: str, source: str
) -> FacilityWarning:
    return FacilityWarning(rule=rule, ids=ids, value=value, limit=limit, message=message, source=source)
