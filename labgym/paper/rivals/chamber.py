"""The space that a rival furnishes, in the frame of the space: walls as line segments, and where nothing may stand."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from labgym.geometry import Array, BoxArray, OrientedBox, pairwise_penetration
from labgym.layouts.floor import Space
from labgym.layouts.ground import Ground
from labgym.layouts.placement import FLOOR
from labgym.layouts.request import Request

Pose = tuple[float, float, float]

DOOR_DEPTH = 1.0
"""Depth of the area that stays free inside a door, meters (Holodeck, `doors.py`: boxes 1.0 m deep on both sides)."""
SLACK = 1e-6
"""Overlaps smaller than this are none, meters."""


@dataclass(frozen=True)
class Chamber:
    """A space as furniture sees it.

    Attributes:
        ground: walls, doors and limits of the space.
        fixed: footprints of fixed floor objects, in the ground's frame.
    """

    ground: Ground
    fixed: tuple[OrientedBox, ...] = field(default=())

    @property
    def doors(self) -> tuple[OrientedBox, ...]:
        """Areas inside doors and passages that stay free."""
        return tuple(
            OrientedBox(
                gate.x - math.sin(gate.yaw) * DOOR_DEPTH / 2.0,
                gate.y + math.cos(gate.yaw) * DOOR_DEPTH / 2.0,
                gate.width,
                DOOR_DEPTH,
                gate.yaw,
            )
            for gate in self.ground.gates
        )

    @cached_property
    def segments(self) -> Array:
        """Stretches of wall as (x0, y0, x1, y1), shape (k, 4), meters."""
        rows = [(*one.point(0.0), *one.point(one.length)) for one in self.ground.segments]
        return np.array(rows, dtype=np.float64).reshape(-1, 4)

    @cached_property
    def taken(self) -> BoxArray:
        """Boxes that furniture avoids: outside, walls, columns, leaves, door areas, keep-outs, fixed objects."""
        ground = self.ground
        boxes = (*ground.outside, *ground.solid, *ground.leaves, *ground.clear, *self.doors, *self.fixed)
        return _flat(boxes)

    def wall_distance(self, points: Array) -> Array:
        """Return the distance of points (n, 2) to the nearest stretch of wall, shape (n,); inf without walls."""
        start, end = self.segments[:, :2], self.segments[:, 2:]
        if not len(start):
            return np.full(len(points), np.inf)
        along = end - start
        length = np.maximum((along**2).sum(axis=1), 1e-12)
        share = ((points[:, None, :] - start[None]) * along[None]).sum(axis=2) / length[None]
        nearest = start[None] + np.clip(share, 0.0, 1.0)[:, :, None] * along[None]
        distances: Array = np.linalg.norm(points[:, None, :] - nearest, axis=2).min(axis=1)
        return distances

    def free(self, boxes: BoxArray) -> NDArray[np.bool_]:
        """Return which of n footprints overlap nothing that is taken, shape (n,)."""
        if not len(boxes):
            return np.zeros(0, dtype=np.bool_)
        clear: NDArray[np.bool_] = np.all(pairwise_penetration(boxes, self.taken) <= SLACK, axis=1)
        return clear


def footprints(centers: Array, half: Array, yaw: Array) -> BoxArray:
    """Return n footprints of unit height: centers (n, 2), half extents (n, 2), yaw (n,)."""
    return BoxArray(centers, half, yaw, np.tile([0.0, 1.0], (len(yaw), 1)))


def _flat(boxes: Sequence[OrientedBox]) -> BoxArray:
    array = BoxArray.of(boxes)
    return footprints(array.centre, array.half, array.yaw)


def chambers(request: Request) -> list[Chamber]:
    """Return the spaces that a rival furnishes, the largest first: laboratories, or all spaces if a floor has none."""
    spaces = [space for space in request.floor.spaces if space.use == "laboratory"] or list(request.floor.spaces)
    found = [_chamber(request, space) for space in spaces]
    return sorted(found, key=lambda chamber: (-chamber.ground.area, chamber.ground.space))


def _chamber(request: Request, space: Space) -> Chamber:
    ground = Ground.of(request.floor, space)
    standing = [placement for placement in request.fixed if placement.support == FLOOR]
    boxes = []
    for placement in standing:
        size, (x, y, _) = request.fixed_asset(placement).size, placement.position
        boxes.append(ground.to_ground(OrientedBox(x, y, size.width, size.depth, placement.yaw)))
    return Chamber(ground, tuple(boxes))
