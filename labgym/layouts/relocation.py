"""Free places for furniture that is already in a layout: along the walls, and in the open for islands."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from labgym.geometry import BoxArray, OrientedBox, interpenetrating, wrap_angle
from labgym.layouts.model import Layout
from labgym.layouts.moves import Place, descendants
from labgym.layouts.placement import FLOOR, WALL
from labgym.layouts.rules.building import Building, building_of
from labgym.layouts.rules.thresholds import MOVABLE, ONE_SIDED
from labgym.layouts.rules.zones import INTRUSION, front_zone

WALL_STEP = 0.05
"""Spacing of the places tried along a wall, meters."""
FLOOR_STEP = 0.15
"""Spacing of the places tried in the open, meters."""
WALL_GAP = 0.01
"""Gap to the wall and to neighbors, meters."""
AISLES = (1.2, 0.95)
"""Clear widths around an island that are tried, meters: an aisle, and a way out."""
SPREAD = 0.3
"""Least distance between two places that are returned, meters."""
MOST = 12
"""Maximum number of places returned."""

Pose = tuple[float, float, float]


def free_places(layout: Layout, placement_id: str, most: int = MOST, step: float = WALL_STEP) -> tuple[Place, ...]:
    """Return places where a floor object is free and usable, the nearest first.

    Furniture that is used from one side stands with its back to a wall, furniture that is used from both sides stands
    in the open with an aisle around it. It stays in its space and overlaps nothing, the clear zone in front of it is
    free, and it stands in no door area and in no other object's front zone. Movable objects do not count as obstacles
    in front of it.

    Args:
        most: maximum number of places.
        step: spacing of the places tried along walls, meters.
    """
    if layout.placement(placement_id).support != FLOOR:
        return ()
    building, box = building_of(layout), layout.box(placement_id)
    if layout.asset(placement_id).size.depth < ONE_SIDED:
        return _usable(layout, placement_id, building.wall_poses(box, WALL_GAP, step), WALL_GAP, most)
    here = (box.x, box.y, box.yaw)
    for aisle in AISLES:
        stays = [here] if _stays(building, box, aisle) else []
        poses = [*stays, *building.open_poses(box, aisle, FLOOR_STEP)]
        places = _usable(layout, placement_id, poses, aisle, most)
        if places:
            return places
    return ()


def _stays(building: Building, box: OrientedBox, aisle: float) -> bool:
    """Whether an island keeps an aisle to every wall where it is."""
    around = replace(box, width=box.width + 2.0 * aisle, depth=box.depth + 2.0 * aisle, z1=box.z0 + 0.1)
    return bool(building.outside(BoxArray.of([around]))[0] <= 0.0)


def _usable(layout: Layout, placement_id: str, poses: Sequence[Pose], gap: float, most: int) -> tuple[Place, ...]:
    """The first poses at which an object keeps a gap to all others and every clear zone stays free."""
    free = usable(layout, placement_id, poses, gap)
    candidates = [pose for pose, is_free in zip(poses, free, strict=True) if is_free]
    return tuple(_spread(layout, placement_id, candidates, most))


def usable(layout: Layout, placement_id: str, poses: Sequence[Pose], gap: float) -> NDArray[np.bool_]:
    """Return at which of n poses an object keeps a gap to all others and every clear zone stays free, shape (n,).

    Args:
        gap: meters; with more than `WALL_GAP` it is an aisle, in which accessories may stand.
    """
    if not poses:
        return np.zeros(0, dtype=np.bool_)
    asset = layout.asset(placement_id)
    size, margin = asset.size, 2.0 * gap if gap > WALL_GAP else gap
    boxes = [OrientedBox(x, y, size.width, size.depth, yaw, 0.0, size.height) for x, y, yaw in poses]
    grown = [OrientedBox(b.x, b.y, b.width + margin, b.depth + margin, b.yaw, b.z0, b.z1) for b in boxes]
    carried = {placement_id, *descendants(layout, placement_id)}
    others = [p for p in layout.placements if p.id not in carried and p.support in (FLOOR, WALL)]
    heavy = [other for other in others if layout.asset(other.id).subtype not in MOVABLE]
    solids = [layout.box(other.id) for other in (others if gap <= WALL_GAP else heavy)]
    zones = [
        front_zone(layout.box(other.id), layout.asset(other.id).clearance)
        for other in heavy
        if other.support == FLOOR and layout.asset(other.id).clearance > 0.0
    ]
    building = building_of(layout)
    zones += [entrance.area for entrance in building.entrances]
    zones += [area.box for area in layout.floor.keep_outs]
    free = ~_hits(grown, solids, 0.0) & ~_hits(boxes, zones, INTRUSION)
    if asset.clearance > 0.0:
        fronts = [front_zone(box, asset.clearance) for box in boxes]
        inside = building.covers(fronts)
        free &= ~_hits(fronts, [layout.box(other.id) for other in heavy], INTRUSION) & inside
    return free


def _hits(boxes: Sequence[OrientedBox], others: Sequence[OrientedBox], depth: float) -> NDArray[np.bool_]:
    """Which boxes overlap one of the others by more than a depth in meters, shape (n,)."""
    hits = np.zeros(len(boxes), dtype=np.bool_)
    hits[interpenetrating(BoxArray.of(boxes), BoxArray.of(others), depth)[0]] = True
    return hits


def _spread(layout: Layout, placement_id: str, poses: Sequence[Pose], most: int) -> list[Place]:
    """The nearest pose first, then poses that are not close to those before."""
    here = layout.placement(placement_id)

    def effort(pose: Pose) -> tuple[float, Pose]:
        turn = abs(wrap_angle(pose[2] - here.yaw)) / math.pi
        return math.hypot(pose[0] - here.position[0], pose[1] - here.position[1]) + turn, pose

    places: list[Place] = []
    for x, y, yaw in sorted(poses, key=effort):
        if all(math.hypot(x - other.x, y - other.y) >= SPREAD for other in places):
            places.append(Place(placement_id, x, y, yaw))
            if len(places) >= most:
                break
    return places
