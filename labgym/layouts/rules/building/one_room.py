"""A rectangular room, read from its four sides."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labgym.geometry import BoxArray, OrientedBox
from labgym.geometry.frames import PlanarPose
from labgym.layouts.floor import Door, Room, Side
from labgym.layouts.rules.building.interface import Array, Entrance, Workplace
from labgym.layouts.rules.zones import door_area, doorway, in_room

WALL_YAW: dict[Side, float] = {"front": 0.0, "back": math.pi, "left": -math.pi / 2.0, "right": math.pi / 2.0}
"""Yaw of furniture with its back to each wall, radians."""


@dataclass(frozen=True)
class OneRoom:
    """A rectangular room with its front-left corner at the origin."""

    room: Room

    @property
    def workplaces(self) -> tuple[Workplace, ...]:
        """The room."""
        return (Workplace(0, "", self.room.width * self.room.depth),)

    @property
    def entrances(self) -> tuple[Entrance, ...]:
        """The room's doors."""
        return tuple(self._entrance(door) for door in self.room.doors)

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """The sides of the room."""
        return 0.0, 0.0, self.room.width, self.room.depth

    def joined(self, space: int) -> frozenset[int]:
        """Return the room."""
        return frozenset({space})

    def clearance(self, xs: Array, ys: Array, reach: float) -> Array:
        """Return the distance of grid points from the sides of the room."""
        across, along = np.minimum(xs, self.room.width - xs), np.minimum(ys, self.room.depth - ys)
        return np.minimum(np.minimum(across[None, :], along[:, None]), reach)

    def _entrance(self, door: Door) -> Entrance:
        opening = doorway(self.room, door)
        pose = (opening.x, opening.y, opening.yaw)
        area = door_area(self.room, door)
        return Entrance(f"the {door.wall} door", 0, True, door.width, area, opening, pose)

    def spaces(self, boxes: BoxArray) -> NDArray[np.intp]:
        """Return zeros, shape (n,)."""
        return np.zeros(len(boxes), dtype=np.intp)

    def outside(self, boxes: BoxArray) -> Array:
        """Return how far n boxes reach out of the room, shape (n,)."""
        corners = boxes.corners()
        low, high = corners.min(axis=1), corners.max(axis=1)
        sides = np.maximum(-low, high - (self.room.width, self.room.depth)).max(axis=1)
        ends = np.maximum(-boxes.z[:, 0], boxes.z[:, 1] - self.room.height)
        return np.asarray(np.maximum(np.maximum(sides, ends), 0.0))

    def gaps(self, points: Array) -> Array:
        """Return the distances from the four sides, in the order left, front, right, back."""
        x, y = points[..., 0], points[..., 1]
        return np.stack([x, y, self.room.width - x, self.room.depth - y])

    def over_openings(self, boxes: BoxArray) -> Array:
        """Return zeros, shape (n,): the area inside a door, which stays free, includes its opening."""
        return np.zeros(len(boxes))

    def ahead(self, box: OrientedBox) -> float:
        """Return the free depth in front of a box up to a side of the room."""
        room, (fx, fy) = self.room, box.front
        reaches = []
        for x, y in box.corners()[2:]:
            along_x = ((room.width if fx > 0 else 0.0) - x) / fx if abs(fx) > 1e-9 else math.inf
            along_y = ((room.depth if fy > 0 else 0.0) - y) / fy if abs(fy) > 1e-9 else math.inf
            reaches.append(min(along_x, along_y))
        return float(max(min(reaches), 0.0))

    def covers(self, zones: Sequence[OrientedBox]) -> NDArray[np.bool_]:
        """Return which of n zones lie inside the room, shape (n,)."""
        return np.array([in_room(self.room, zone) for zone in zones], dtype=np.bool_)

    def lined(self, footprints: BoxArray, gap: float) -> float:
        """Return the share of the four sides that footprints line."""
        room, corners = self.room, footprints.corners()
        length = 0.0
        for along, across, side, far in ((0, 1, room.width, room.depth), (1, 0, room.depth, room.width)):
            for near_wall in (corners[..., across], far - corners[..., across]):
                close = near_wall.min(axis=1) <= gap if len(footprints) else np.zeros(0, dtype=bool)
                spans = [(float(c[:, along].min()), float(c[:, along].max())) for c in corners[close]]
                length += _covered(spans, side)
        return length / (2.0 * (room.width + room.depth))

    def skew(self, boxes: BoxArray) -> Array:
        """Return the angle of n boxes to the sides of the room, shape (n,)."""
        return np.array([abs(math.remainder(yaw, math.pi / 2.0)) for yaw in boxes.yaw.tolist()])

    def inward(self, box: OrientedBox) -> tuple[float, float]:
        """Return the least displacement that brings a box between the sides; to the middle if it is too long."""
        x0, y0, x1, y1 = box.bounds()
        return shift_inside(x0, x1, 0.0, self.room.width), shift_inside(y0, y1, 0.0, self.room.depth)

    def roomy(self, x: float, y: float, radius: float) -> bool:
        """Whether a disc at a point reaches no side."""
        return radius < x < self.room.width - radius and radius < y < self.room.depth - radius

    def wall_poses(self, box: OrientedBox, gap: float, step: float) -> list[PlanarPose]:
        """Return poses of a box with the back to a side, in the order front, back, left, right."""
        inset, start = gap + box.depth / 2.0, gap + box.width / 2.0
        poses = []
        for wall, yaw in WALL_YAW.items():
            for along in np.arange(start, self.room.length(wall) - start + 1e-9, step):
                x, y = {
                    "front": (along, inset),
                    "back": (along, self.room.depth - inset),
                    "left": (inset, along),
                    "right": (self.room.width - inset, along),
                }[wall]
                poses.append((round(float(x), 6), round(float(y), 6), yaw))
        return poses

    def open_poses(self, box: OrientedBox, aisle: float, step: float) -> list[PlanarPose]:
        """Return poses of a box with an aisle to every side."""
        poses = []
        for yaw, width, depth in ((0.0, box.width, box.depth), (math.pi / 2.0, box.depth, box.width)):
            x0, y0 = aisle + width / 2.0, aisle + depth / 2.0
            xs = np.arange(x0, self.room.width - x0 + 1e-9, step)
            ys = np.arange(y0, self.room.depth - y0 + 1e-9, step)
            poses += [(round(float(x), 6), round(float(y), 6), yaw) for x in xs for y in ys]
        return poses


def shift_inside(low: float, high: float, least: float, most: float) -> float:
    """Return the displacement that brings [low, high] into [least, most]; to the middle if it is too long."""
    if high - low > most - least:
        return (least + most - low - high) / 2.0
    if low < least:
        return least - low
    return most - high if high > most else 0.0


def _covered(spans: list[tuple[float, float]], length: float) -> float:
    """Return the length of [0, length] that a union of intervals covers."""
    covered, reached = 0.0, 0.0
    for start, end in sorted(spans):
        start, end = max(start, reached), min(end, length)
        if end > start:
            covered += end - start
            reached = end
    return covered
