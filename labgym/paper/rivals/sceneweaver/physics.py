"""SceneWeaver's physics: relations are enforced, overlapping objects give way, what still collides is deleted.

Public repository Scene-Weaver/SceneWeaver: after each tool `solve_large_object` searches poses that satisfy relations
without collisions (simulated annealing of Infinigen), then `del_top_collide_obj` deletes, in each group of colliding
objects, the one with the greatest shared volume until nothing collides. Here the nearest free pose replaces annealing.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from labgym.geometry import BoxArray, OrientedBox, pairwise_penetration
from labgym.geometry.overlap import overlap_volume
from labgym.paper.rivals.chamber import SLACK, Chamber, footprints
from labgym.paper.rivals.piece import RivalPiece
from labgym.paper.rivals.sceneweaver.scene import ROOM, WeaverItem, WeaverScene

CLOSE = 0.03
"""Gap between related objects, meters: relations mean less than 5 cm (`init_gpt` prompt)."""
AT_WALL = 0.02
"""Gap to the wall of an object against it, meters."""
STEP, REACH = 0.1, 1.5
"""Spacing and greatest length of the shifts that are tried for an object that overlaps others, meters."""
SHIFTS = tuple(
    (STEP * i, STEP * j) for i in range(-15, 16) for j in range(-15, 16) if STEP * math.hypot(i, j) <= REACH + 1e-9
)
"""Shifts of an object without a relation, (0, 0) among them."""
TOUCH = 0.001
"""Depth above which two objects collide, meters (`evaluate.py`: contact threshold)."""

Pose = tuple[float, float, float]


def settle(scene: WeaverScene, chamber: Chamber) -> WeaverScene:
    """Return the scene at rest: relations hold, nothing overlaps; what finds no place is deleted."""
    settled = WeaverScene(())
    for item in sorted(scene.large, key=_rank):
        pose = _resting_pose(item, settled, chamber)
        settled = settled.adding([item])
        if pose is not None:
            settled = settled.moved(item.piece.id, *pose)
    poses = {item.piece.id: item.piece for item in settled.large}
    for item in scene.large:
        piece = poses[item.piece.id]
        scene = scene.moved(item.piece.id, piece.x, piece.y, piece.yaw)
    return cleared(scene, chamber)


def cleared(scene: WeaverScene, chamber: Chamber) -> WeaverScene:
    """Return the scene without the objects that collide or lie outside, the greatest shared volume first."""
    scene = scene.without(outside(scene, chamber))
    while True:
        pairs = collisions(scene)
        if not pairs:
            return scene
        scene = scene.without(_worst(scene, pairs))


def outside(scene: WeaverScene, chamber: Chamber) -> list[str]:
    """Return the large objects that reach out of the space, into walls, door areas or fixed objects."""
    large = [item.piece for item in scene.large]
    free = chamber.free(_feet(large))
    return [piece.id for piece, is_free in zip(large, free, strict=True) if not is_free]


def collisions(scene: WeaverScene) -> list[tuple[str, str, float]]:
    """Return pairs of objects that overlap by more than 1 mm, with the volume that they share, cubic meters.

    Large objects are compared with each other, and small ones with those on the same surface.
    """
    pairs = []
    groups: dict[tuple[str, int | None], list[RivalPiece]] = {}
    for item in scene.items:
        groups.setdefault((item.piece.support, item.piece.slot), []).append(item.piece)
    for group in groups.values():
        boxes = BoxArray.of([piece.box for piece in group])
        for i, j in zip(*np.nonzero(np.triu(pairwise_penetration(boxes, boxes) > TOUCH, k=1)), strict=True):
            pairs.append((group[i].id, group[j].id, overlap_volume(group[i].box, group[j].box)))
    return pairs


def _worst(scene: WeaverScene, pairs: Sequence[tuple[str, str, float]]) -> list[str]:
    """The object with the greatest shared volume, the smaller one of equals, in each connected group of pairs."""
    volumes: dict[str, float] = {}
    groups: list[set[str]] = []
    for first, second, volume in pairs:
        for one in (first, second):
            volumes[one] = volumes.get(one, 0.0) + volume
        joined = [group for group in groups if first in group or second in group]
        groups = [group for group in groups if group not in joined] + [{first, second}.union(*joined)]
    return [
        max(group, key=lambda one: (round(volumes[one], 9), -_volume(scene.by_id[one].piece), one)) for group in groups
    ]


def _volume(piece: RivalPiece) -> float:
    size = piece.asset.size
    return size.width * size.depth * size.height


def _rank(item: WeaverItem) -> tuple[bool, float]:
    """Objects with a parent come after the others; larger ones first."""
    size = item.piece.asset.size
    return item.parent not in ("", ROOM), -size.width * size.depth


def _resting_pose(item: WeaverItem, settled: WeaverScene, chamber: Chamber) -> Pose | None:
    """The pose nearest to the present one that satisfies the relation and is free; None without any."""
    piece = item.piece
    poses = list(_poses(item, settled, chamber))
    if not poses:
        return None
    size = piece.asset.size
    array = np.array(poses)
    half = np.tile([size.width / 2.0, size.depth / 2.0], (len(poses), 1))
    feet = footprints(array[:, :2], half, array[:, 2])
    free = chamber.free(feet)
    if settled.items:
        others = _feet([other.piece for other in settled.large])
        free &= (pairwise_penetration(feet, others) <= SLACK).all(axis=1)
    if not free.any():
        return None
    distance = np.hypot(array[:, 0] - piece.x, array[:, 1] - piece.y)
    best: NDArray[np.float64] = array[int(np.argmin(np.where(free, distance, np.inf)))]
    return float(best[0]), float(best[1]), float(best[2])


def _feet(pieces: Sequence[RivalPiece]) -> BoxArray:
    boxes = BoxArray.of([piece.box for piece in pieces])
    return footprints(boxes.centre, boxes.half, boxes.yaw)


def _poses(item: WeaverItem, settled: WeaverScene, chamber: Chamber) -> Iterator[Pose]:
    """Poses that satisfy an item's relation."""
    piece = item.piece
    if item.relation == "against_wall":
        yield from wall_poses(piece, chamber)
    elif item.relation in ("front_against", "side_by_side") and item.parent in settled.by_id:
        parent = settled.by_id[item.parent].piece
        yield from _front_poses(piece, parent) if item.relation == "front_against" else _side_poses(piece, parent)
    else:
        for dx, dy in SHIFTS:
            yield piece.x + dx, piece.y + dy, piece.yaw


def wall_poses(piece: RivalPiece, chamber: Chamber) -> Iterator[Pose]:
    """Yield poses of a piece with its back against each wall, off the openings below its height, a step apart."""
    size = piece.asset.size
    for segment in chamber.ground.segments:
        for low, high in segment.free(size.height):
            along = np.arange(low, high - size.width + 1e-9, STEP) + size.width / 2.0
            for x, y in segment.points(along, AT_WALL + size.depth / 2.0).tolist():
                yield x, y, segment.yaw


def _front_poses(piece: RivalPiece, parent: RivalPiece) -> Iterator[Pose]:
    """Poses on all four sides of the parent, facing it."""
    box, size = parent.box, piece.asset.size
    for side in range(4):
        turn = side * math.pi / 2.0
        across, away = (box.width, box.depth) if side % 2 == 0 else (box.depth, box.width)
        frame = OrientedBox(box.x, box.y, across, away, box.yaw + turn)
        reach = max((across - size.width) / 2.0, 0.0)
        for along in np.arange(-reach, reach + 1e-9, STEP).tolist():
            x, y = frame.to_world(along, (away + size.depth) / 2.0 + CLOSE)
            yield x, y, frame.yaw + math.pi


def _side_poses(piece: RivalPiece, parent: RivalPiece) -> Iterator[Pose]:
    """Poses left and right of the parent, with the same orientation and the backs in line."""
    box, size = parent.box, piece.asset.size
    for side in (-1.0, 1.0):
        x, y = box.to_world(side * ((box.width + size.width) / 2.0 + CLOSE), (size.depth - box.depth) / 2.0)
        yield x, y, box.yaw
