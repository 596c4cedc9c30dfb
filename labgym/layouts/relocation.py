"""Free places for furniture that is already in a layout: along the walls, and in the open for islands."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from labgym.geometry import BoxArray, OrientedBox, pairwise_penetration, wrap_angle
from labgym.layouts.floor import Side
from labgym.layouts.model import FLOOR, WALL, Layout
from labgym.layouts.moves import Place, descendants
from labgym.layouts.rules.thresholds import MOVABLE, ONE_SIDED
from labgym.layouts.rules.zones import INTRUSION, door_area, front_zone

WALL_STEP = 0.05
"""Spacing of the places tried along a wall, meters."""
FLOOR_STEP = 0.15
"""Spacing of the places tried in the open, meters."""
WALL_GAP = 0.01
"""Gap to the wall and to neighbors, meters."""
AISLES = (1.2, 0.95)
"""Clear widths around an island that are tried, metres: an aisle, and a way out."""
SPREAD = 0.3
"""Least distance between two places that are returned, meters."""
MOST = 12
"""Maximum number of places returned."""

Pose = tuple[float, float, float]
WALL_YAW: dict[Side, float] = {"front": 0.0, "back": math.pi, "left": -math.pi / 2.0, "right": math.pi / 2.0}


def free_places(layout: Layout, placement_id: str, most: int = MOST) -> tuple[Place, ...]:
    """Return places where a floor object is free and usable, the nearest first.

    Furniture that is used from one side stands with its back to a wall, furniture that is used from both sides stands
    in the open with an aisle around it. It overlaps nothing, the clear zone in front of it is free, and it stands in no
    door area and in no other object's front zone. Movable objects do not count as obstacles in front of it.
    """
    if layout.placement(placement_id).support != FLOOR:
        return ()
    if layout.asset(placement_id).size.depth < ONE_SIDED:
        return _usable(layout, placement_id, _wall_poses(layout, placement_id), WALL_GAP, most)
    for aisle in AISLES:
        places = _usable(layout, placement_id, _open_poses(layout, placement_id, aisle), aisle, most)
        if places:
            return places
    return ()


def _usable(layout: Layout, placement_id: str, poses: Sequence[Pose], gap: float, most: int) -> tuple[Place, ...]:
    """The poses at which an object keeps a gap to all others and every clear zone stays free."""
    if not poses:
        return ()
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
    zones += [door_area(layout.room, door) for door in layout.room.doors]
    free = ~_hits(grown, solids, 0.0) & ~_hits(boxes, zones, INTRUSION)
    if asset.clearance > 0.0:
        fronts = [front_zone(box, asset.clearance) for box in boxes]
        inside = np.array([_inside(layout, front) for front in fronts])
        free &= ~_hits(fronts, [layout.box(other.id) for other in heavy], INTRUSION) & inside
    candidates = [pose for pose, is_free in zip(poses, free, strict=True) if is_free]
    return tuple(_spread(layout, placement_id, candidates, most))


def _wall_poses(layout: Layout, placement_id: str) -> list[Pose]:
    room, size = layout.room, layout.asset(placement_id).size
    inset, start = WALL_GAP + size.depth / 2.0, WALL_GAP + size.width / 2.0
    poses = []
    for wall, yaw in WALL_YAW.items():
        for along in np.arange(start, room.length(wall) - start + 1e-9, WALL_STEP):
            x, y = {
                "front": (along, inset),
                "back": (along, room.depth - inset),
                "left": (inset, along),
                "right": (room.width - inset, along),
            }[wall]
            poses.append((round(float(x), 6), round(float(y), 6), yaw))
    return poses


def _open_poses(layout: Layout, placement_id: str, aisle: float) -> list[Pose]:
    room, size = layout.room, layout.asset(placement_id).size
    poses = []
    for yaw, width, depth in ((0.0, size.width, size.depth), (math.pi / 2.0, size.depth, size.width)):
        x0, y0 = aisle + width / 2.0, aisle + depth / 2.0
        xs = np.arange(x0, room.width - x0 + 1e-9, FLOOR_STEP)
        ys = np.arange(y0, room.depth - y0 + 1e-9, FLOOR_STEP)
        poses += [(round(float(x), 6), round(float(y), 6), yaw) for x in xs for y in ys]
    return poses


def _hits(boxes: Sequence[OrientedBox], others: Sequence[OrientedBox], depth: float) -> NDArray[np.bool_]:
    """Which boxes overlap one of the others by more than a depth in meters, shape (n,)."""
    if not others:
        return np.zeros(len(boxes), dtype=np.bool_)
    overlaps = pairwise_penetration(BoxArray.of(boxes), BoxArray.of(others))
    return np.asarray((overlaps > depth).any(axis=1))


def _inside(layout: Layout, box: OrientedBox) -> bool:
    x0, y0, x1, y1 = box.bounds()
    return max(-x0, -y0, x1 - layout.room.width, y1 - layout.room.depth) <= INTRUSION


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
