"""Berths: poses at which a piece of furniture can stand, those that cause the fewest warnings and are nearest first."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from labgym.assets import Asset
from labgym.geometry import BoxArray, OrientedBox, pairwise_distance, rotate, wrap_angle
from labgym.layouts.floor import Floor
from labgym.layouts.floor.fields import HOOD_DOOR_LEAST
from labgym.layouts.ground import grounds
from labgym.layouts.habits import Habits
from labgym.layouts.model import Layout
from labgym.layouts.moves import Place
from labgym.layouts.placement import FLOOR
from labgym.layouts.relocation import AISLES, SPREAD, WALL_GAP, usable
from labgym.layouts.rules.building import building_of
from labgym.layouts.rules.facility.backs import TALL
from labgym.layouts.rules.facility.hoods import HOOD_DOOR
from labgym.layouts.rules.supplies import Supplies, shortfall, supplies_of
from labgym.layouts.rules.thresholds import MOVABLE, ONE_SIDED

WALL_STEP, OPEN_STEP = 0.05, 0.15
"""Spacing of the poses along walls and in the open, meters."""
TOUCH = 0.002
"""Gap to a neighbor at whose side or back a piece stands, meters."""
MOST_APART = 60
"""Maximum number of poses that are far from each other."""
BATCH = 32
"""Poses that are compared with the building together."""

Pose = tuple[float, float, float]


@dataclass(frozen=True)
class Berth:
    """A pose of a piece of furniture, the index of its space, and the warnings that it causes there."""

    pose: Pose
    space: int
    warnings: int


def berths(layout: Layout, piece: str) -> Iterator[Place]:
    """Yield poses at which a floor object is free and usable, in its space and in all others.

    They are turns in place, poses along walls, next to and behind other furniture, and for islands in the open. Those
    within reach of services and away from doors come first, then those in the same space, then the nearest. Poses
    that are far from each other come before those between them.
    """
    box, building = layout.box(piece), building_of(layout)
    here = int(building.spaces(BoxArray.of([box]))[0])
    suitability = _suitability(layout.floor, layout.asset(piece))
    candidates = sorted(
        _free(layout, piece, box),
        key=lambda berth: (
            berth.warnings,
            berth.space != here,
            suitability[berth.space],
            _effort(box, berth.pose),
            berth.pose,
        ),
    )
    for x, y, yaw in _inside(layout, box, _spread([berth.pose for berth in candidates])):
        yield Place(piece, x, y, yaw)


def warnings_at(layout: Layout, piece: str, boxes: Sequence[OrientedBox], spaces: Sequence[int]) -> list[int]:
    """Return how many warnings a piece causes with each of n boxes: services out of reach, and doors near a hood.

    A hood that is nearer to a door than 1 m counts twice.
    """
    asset, floor = layout.asset(piece), layout.floor
    counts = [0] * len(boxes)
    kinds = supplies_of(asset, [layout.asset(child.id) for child in layout.children(piece)]) if floor.services else ()
    if kinds:
        supplies = _supplies(floor)
        for k, (box, space) in enumerate(zip(boxes, spaces, strict=True)):
            near = supplies[space]
            counts[k] += sum(kind in near.described and shortfall(box, near.of_kind(kind)) > 1e-6 for kind in kinds)
    entrances = building_of(layout).entrances
    if asset.fume_hood and boxes and entrances:
        gaps = pairwise_distance(BoxArray.of(boxes), BoxArray.of([entrance.opening for entrance in entrances]))
        same = np.array(spaces)[:, None] == np.array([entrance.space for entrance in entrances])[None, :]
        near_door = (gaps < HOOD_DOOR).astype(int) + (gaps < HOOD_DOOR_LEAST).astype(int)
        counts = [count + int(more) for count, more in zip(counts, (near_door * same).sum(axis=1), strict=True)]
    return counts


@lru_cache(maxsize=16)
def _supplies(floor: Floor) -> tuple[Supplies, ...]:
    return tuple(Supplies.of(floor, space) for space in floor.spaces)


def _suitability(floor: Floor, asset: Asset) -> list[int]:
    """Return the rank of each space's use for an asset, 0 for the best."""
    return [Habits.published().rank_of(asset.role, space.use) for space in floor.spaces]


def _free(layout: Layout, piece: str, box: OrientedBox) -> list[Berth]:
    """Return the poses at which other furniture leaves room for a piece."""
    asset, building = layout.asset(piece), building_of(layout)
    around = _turns(layout, box)
    if asset.size.depth < ONE_SIDED:
        poses, gap = [*_along_walls(layout, box, box), *_beside(layout, piece), *_behind(layout, piece)], 0.0
    else:
        poses, gap = _in_the_open(layout, box), AISLES[-1]
        if Habits.published().of(asset.role).stance == "peninsula":
            around += _ends_at_walls(layout, box)
    free = [pose for pose, is_free in zip(poses, usable(layout, piece, poses, gap), strict=True) if is_free]
    free += [pose for pose, is_free in zip(around, usable(layout, piece, around, 0.0), strict=True) if is_free]
    if not free:
        return []
    boxes = [_at(box, pose) for pose in dict.fromkeys(free)]
    spaces = building.spaces(BoxArray.of(boxes)).tolist()
    warnings = warnings_at(layout, piece, boxes, spaces)
    return [
        Berth((each.x, each.y, each.yaw), space, count)
        for each, space, count in zip(boxes, spaces, warnings, strict=True)
    ]


def _turns(layout: Layout, box: OrientedBox) -> list[Pose]:
    """Return the pose of a piece turned in place, parallel to the walls of its space or to its frame."""
    space = int(building_of(layout).spaces(BoxArray.of([box]))[0])
    ground = grounds(layout.floor)[space]
    yaws = {ground.to_floor((0.0, 0.0, segment.yaw))[2] for segment in ground.segments}
    yaws |= {ground.frame[2] + quarter * math.pi / 2.0 for quarter in range(4)}
    return [(box.x, box.y, yaw) for yaw in sorted({round(wrap_angle(yaw), 9) for yaw in yaws})]


def _along_walls(layout: Layout, box: OrientedBox, foot: OrientedBox, turn: float = 0.0) -> list[Pose]:
    """Return poses with the back to a wall, and the one nearest to where a piece is on each stretch of wall.

    Args:
        foot: its footprint as it faces the wall. turn: yaw of the piece in it, radians.
    """
    poses: list[Pose] = []
    for ground in grounds(layout.floor):
        local = ground.to_ground(box)
        for segment in ground.segments:
            yaw = wrap_angle(ground.to_floor((0.0, 0.0, segment.yaw))[2] + turn)
            across, _ = rotate(local.x - segment.x, local.y - segment.y, -segment.yaw)
            for low, high in segment.free(box.z1 - box.z0):
                first, last = low + WALL_GAP + foot.width / 2.0, high - WALL_GAP - foot.width / 2.0
                if first > last:
                    continue
                along = np.array([*np.arange(first, last, WALL_STEP), last, min(max(across, first), last)])
                for x, y in segment.points(along, WALL_GAP + foot.depth / 2.0).tolist():
                    wx, wy, _ = ground.to_floor((x, y, 0.0))
                    poses.append((round(wx, 6), round(wy, 6), yaw))
    return poses


def _ends_at_walls(layout: Layout, box: OrientedBox) -> list[Pose]:
    """Return poses of a peninsula: with one of its short ends to a wall."""
    foot = replace(box, width=box.depth, depth=box.width)
    return [*_along_walls(layout, box, foot, math.pi / 2.0), *_along_walls(layout, box, foot, -math.pi / 2.0)]


def _neighbors(layout: Layout, piece: str) -> list[str]:
    """Return the furniture on the floor that is used from one side, without a piece."""
    return [
        other.id
        for other in layout.placements
        if other.support == FLOOR
        and other.id != piece
        and layout.asset(other.id).size.depth < ONE_SIDED
        and layout.asset(other.id).subtype not in MOVABLE
    ]


def _beside(layout: Layout, piece: str) -> list[Pose]:
    """Return poses at the sides of other furniture, the backs in line: gaps may be hardly wider than the piece."""
    box, poses = layout.box(piece), []
    for other in map(layout.box, _neighbors(layout, piece)):
        shift = (other.width + box.width) / 2.0 + TOUCH
        poses += [_relative(other, along, (box.depth - other.depth) / 2.0, 0.0) for along in (shift, -shift)]
    return poses


def _behind(layout: Layout, piece: str) -> list[Pose]:
    """Return poses back to back with other furniture."""
    places = [place for other in _neighbors(layout, piece) for place in behind_poses(layout, piece, other)]
    return [(place.x, place.y, place.yaw) for place in places]


def behind_poses(layout: Layout, piece: str, other: str) -> list[Place]:
    """Return places of a piece back to back with another, which then faces no wall; none unless both are low."""
    box, front = layout.box(piece), layout.box(other)
    if max(box.z1 - box.z0, front.z1 - front.z0) >= TALL:
        return []
    slack, ahead = (front.width - box.width) / 2.0, -(front.depth + box.depth) / 2.0 - TOUCH
    shifts = dict.fromkeys((0.0, slack, -slack))
    return [Place(piece, *_relative(front, along, ahead, math.pi)) for along in shifts]


def _relative(other: OrientedBox, along: float, ahead: float, turn: float) -> Pose:
    """Return a pose in the frame of a box."""
    dx, dy = rotate(along, ahead, other.yaw)
    return round(other.x + dx, 6), round(other.y + dy, 6), wrap_angle(other.yaw + turn)


def _in_the_open(layout: Layout, box: OrientedBox) -> list[Pose]:
    """Return poses on a grid, parallel to the frame of each space."""
    poses: list[Pose] = []
    for ground in grounds(layout.floor):
        for turn in (0.0, math.pi / 2.0):
            width, depth = (box.width, box.depth) if turn == 0.0 else (box.depth, box.width)
            margin_x, margin_y = AISLES[-1] + width / 2.0, AISLES[-1] + depth / 2.0
            for x in np.arange(margin_x, ground.width - margin_x + 1e-9, OPEN_STEP).tolist():
                for y in np.arange(margin_y, ground.depth - margin_y + 1e-9, OPEN_STEP).tolist():
                    wx, wy, yaw = ground.to_floor((x, y, turn))
                    poses.append((round(wx, 6), round(wy, 6), wrap_angle(yaw)))
    return poses


def _effort(box: OrientedBox, pose: Pose) -> float:
    return math.hypot(pose[0] - box.x, pose[1] - box.y) + abs(wrap_angle(pose[2] - box.yaw)) / math.pi


def _at(box: OrientedBox, pose: Pose) -> OrientedBox:
    return replace(box, x=pose[0], y=pose[1], yaw=pose[2])


def _spread(poses: Sequence[Pose]) -> list[Pose]:
    """Return poses in the order given, but those that are near to an earlier one last."""
    apart: list[Pose] = []
    near: list[Pose] = []
    for pose in poses:
        is_apart = all(math.dist(pose[:2], one[:2]) >= SPREAD for one in apart)
        (apart if is_apart else near).append(pose)
        if len(apart) == MOST_APART:
            break
    return apart + near


def _inside(layout: Layout, box: OrientedBox, poses: Sequence[Pose]) -> Iterator[Pose]:
    """Yield the poses at which a box reaches into no wall or column."""
    building = building_of(layout)
    for start in range(0, len(poses), BATCH):
        some = poses[start : start + BATCH]
        outside = building.outside(BoxArray.of([_at(box, pose) for pose in some]))
        yield from (pose for pose, depth in zip(some, outside.tolist(), strict=True) if depth <= 0.0)
