"""What the rules read of a building: how far things reach out of its rooms, how near its walls are, and its doors.

One rectangular room is read from its four sides; any other floor from its walls, columns and spaces.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from labgym.geometry import BoxArray, OrientedBox, pairwise_distance, pairwise_penetration
from labgym.layouts.floor import OUTSIDE, Doorway, Floor
from labgym.layouts.model import Door, Layout, Room
from labgym.layouts.rules.clearance import lower_to_boxes
from labgym.layouts.rules.thresholds import EGRESS_WIDTH, ROOM_TOLERANCE
from labgym.layouts.rules.zones import DOOR_AREA, HEADROOM, INTRUSION, door_area, doorway, in_room

Array = NDArray[np.float64]

WEDGE = 0.35
"""A point outside all regions that is at most this far from one, with no wall between, is in the wedge that a region of
rectangles leaves along an oblique wall, meters."""
PLAN = (-1000.0, 1000.0)
"""Heights of a box that stands for its outline, meters."""
FACE = 0.1
"""Spacing of the points at which the faces of walls are looked at, and their distance from them, meters."""


@dataclass(frozen=True)
class Entrance:
    """A door or a passage as seen from one of its spaces.

    Attributes:
        label: its name in messages.
        space: index of the space; 0 in a one-room floor.
        exit: whether it leads out of the floor.
        width: clear width, meters.
        area: the floor inside it that stays free.
        opening: the opening itself, as a thin box on the face of the wall.
        pose: (x, y, yaw) of its middle on the face of the wall, front toward the space.
    """

    label: str
    space: int
    exit: bool
    width: float
    area: OrientedBox
    opening: OrientedBox
    pose: tuple[float, float, float]


@dataclass(frozen=True)
class Workplace:
    """A space in which people work: its index, where it is in messages, and its floor area in square meters."""

    space: int
    where: str
    area: float


class Building(Protocol):
    """A floor as the rules read it; points and boxes are in the floor's frame, lengths in meters."""

    @property
    def workplaces(self) -> tuple[Workplace, ...]:
        """The laboratories and instrument rooms."""
        ...

    @property
    def entrances(self) -> tuple[Entrance, ...]:
        """Doors and passages, once for each space into which they lead."""
        ...

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """Axis-aligned bounds (x0, y0, x1, y1) of the rooms."""
        ...

    def joined(self, space: int) -> frozenset[int]:
        """Return the spaces that doors and passages join with a space, itself included, without leaving the floor."""
        ...

    def clearance(self, xs: Array, ys: Array, reach: float) -> Array:
        """Return the distance of grid points from walls and columns, shape (ny, nx), at most `reach`.

        Every interior door stands wide open. Not positive in walls.
        """
        ...

    def spaces(self, boxes: BoxArray) -> NDArray[np.intp]:
        """Return the index of the space that each of n boxes is in, or nearest to, shape (n,)."""
        ...

    def outside(self, boxes: BoxArray) -> Array:
        """Return how far n boxes reach out of the rooms, floor and ceiling included, shape (n,); 0 inside."""
        ...

    def gaps(self, points: Array) -> Array:
        """Return the distances of points (..., 2) from the face of each of m walls, shape (m, ...).

        Negative inside a wall; inf beside its ends.
        """
        ...

    def ahead(self, box: OrientedBox) -> float:
        """Return the free depth in front of a box up to a wall."""
        ...

    def covers(self, zone: OrientedBox) -> bool:
        """Whether a zone lies inside the rooms."""
        ...

    def lined(self, footprints: BoxArray, gap: float) -> float:
        """Return the share of the walls' length, in [0, 1], before which n footprints stand within a gap."""
        ...

    def skew(self, boxes: BoxArray) -> Array:
        """Return the angle of n boxes to the walls, shape (n,), radians in [0, pi / 4]."""
        ...


def building_of(layout: Layout) -> Building:
    """Return the building of a layout."""
    return OneRoom(layout.room) if layout.floor.is_rectangle else ManyRooms(layout.floor)


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

    def ahead(self, box: OrientedBox) -> float:
        """Return the free depth in front of a box up to a side of the room."""
        room, (fx, fy) = self.room, box.front
        reaches = []
        for x, y in box.corners()[2:]:
            along_x = ((room.width if fx > 0 else 0.0) - x) / fx if abs(fx) > 1e-9 else math.inf
            along_y = ((room.depth if fy > 0 else 0.0) - y) / fy if abs(fy) > 1e-9 else math.inf
            reaches.append(min(along_x, along_y))
        return float(max(min(reaches), 0.0))

    def covers(self, zone: OrientedBox) -> bool:
        """Whether a zone lies inside the room."""
        return in_room(self.room, zone)

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


@dataclass(frozen=True)
class ManyRooms:
    """Any floor: spaces that walls enclose.

    A wall ends a room along its whole length, also where it has an opening: nothing stands in a doorway.
    """

    floor: Floor

    @property
    def workplaces(self) -> tuple[Workplace, ...]:
        """The laboratories and instrument rooms."""
        return tuple(
            Workplace(index, f" in {space.id!r}", space.area)
            for index, space in enumerate(self.floor.spaces)
            if space.use in ("laboratory", "instrument")
        )

    @cached_property
    def entrances(self) -> tuple[Entrance, ...]:
        """Doors and passages, once for each space into which they lead."""
        index = {space.id: k for k, space in enumerate(self.floor.spaces)}
        return tuple(
            self._entrance(way, name, index[name])
            for way in self.floor.doorways
            for name in dict.fromkeys(way.spaces)
            if name != OUTSIDE
        )

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """Axis-aligned bounds of the floor."""
        return self.floor.bounds

    def joined(self, space: int) -> frozenset[int]:
        """Return the spaces that interior doors and passages join with a space, itself included."""
        names = [one.id for one in self.floor.spaces]
        reached = {names[space]}
        for _ in names:
            for way in self.floor.doorways:
                if not way.exit and not reached.isdisjoint(way.spaces):
                    reached.update(way.spaces)
        return frozenset(index for index, name in enumerate(names) if name in reached)

    def clearance(self, xs: Array, ys: Array, reach: float) -> Array:
        """Return the distance of grid points from walls, panes and columns."""
        values = np.full((len(ys), len(xs)), reach)
        solid = [part.box for part in self.floor.parts if part.kind not in ("leaf", "lintel")]
        lower_to_boxes(values, xs, ys, solid, reach)
        return values

    def _entrance(self, way: Doorway, name: str, space: int) -> Entrance:
        x, y, yaw = way.side(name)
        height = way.opening.height
        opening = OrientedBox(x, y, way.width, 0.0, yaw, 0.0, height)
        return Entrance(way.label, space, way.exit, way.width, swing_area(way, name), opening, (x, y, yaw))

    @cached_property
    def _solids(self) -> BoxArray:
        """Outlines of whole walls, columns and open leaves."""
        fixed = [part.box for part in self.floor.parts if part.kind in ("column", "leaf")]
        return _outlines(BoxArray.of([*self.floor.wall_boxes, *fixed]))

    @cached_property
    def _regions(self) -> tuple[BoxArray, NDArray[np.intp]]:
        """Outlines of the rectangles of all spaces, and the space of each."""
        boxes = [space.boxes for space in self.floor.spaces]
        owner = np.repeat(np.arange(len(boxes)), [len(own) for own in boxes])
        return _outlines(BoxArray.of([box for own in boxes for box in own])), owner

    def _nearest(self, boxes: BoxArray) -> tuple[Array, NDArray[np.intp]]:
        """Return the distance of the middle of each box from the nearest rectangle, and that rectangle."""
        middles = BoxArray(boxes.centre, np.zeros_like(boxes.half), boxes.yaw, np.tile(PLAN, (len(boxes), 1)))
        distances = pairwise_distance(middles, self._regions[0])
        nearest = distances.argmin(axis=1)
        return distances[np.arange(len(boxes)), nearest], nearest

    def spaces(self, boxes: BoxArray) -> NDArray[np.intp]:
        """Return the index of the space that each of n boxes is in, or nearest to, shape (n,)."""
        return np.asarray(self._regions[1][self._nearest(boxes)[1]], dtype=np.intp)

    def outside(self, boxes: BoxArray) -> Array:
        """Return how far n boxes reach into walls and columns, or stand outside of all spaces, shape (n,)."""
        if not len(boxes):
            return np.zeros(0)
        away, nearest = self._nearest(boxes)
        reach = pairwise_penetration(_outlines(boxes), self._solids).max(axis=1)
        for row in np.flatnonzero(away > 0.0):
            if away[row] > WEDGE or self._walled_off(boxes.centre[row], int(nearest[row])):
                reach[row] = max(reach[row], away[row])
        ceilings = np.array([space.ceiling for space in self.floor.spaces])[self._regions[1][nearest]]
        ends = np.maximum(-boxes.z[:, 0], boxes.z[:, 1] - ceilings)
        return np.asarray(np.maximum(np.maximum(reach, ends), 0.0))

    def _walled_off(self, point: Array, rectangle: int) -> bool:
        """Whether a wall lies between a point and the nearest point of a rectangle of a region."""
        regions = self._regions[0]
        axes = regions.axes()[rectangle]
        local = np.clip(axes @ (point - regions.centre[rectangle]), -regions.half[rectangle], regions.half[rectangle])
        target = regions.centre[rectangle] + local @ axes
        x, y = ((point + target) / 2.0).tolist()
        dx, dy = (target - point).tolist()
        line = OrientedBox(x, y, math.hypot(dx, dy), 0.0, math.atan2(dy, dx), *PLAN)
        walls = _outlines(BoxArray.of(self.floor.wall_boxes))
        return bool((pairwise_penetration(BoxArray.of([line]), walls) > 0.0).any())

    def gaps(self, points: Array) -> Array:
        """Return the distances of points from the face of each wall, shape (m, ...); inf beside its ends."""
        walls = BoxArray.of(self.floor.wall_boxes)
        flat = np.asarray(points, dtype=np.float64).reshape(-1, 2)
        local = np.abs(np.einsum("mnd,mkd->mnk", flat[None] - walls.centre[:, None], walls.axes()))
        beyond = local - walls.half[:, None]
        gaps = np.where(beyond[..., 0] > INTRUSION, np.inf, beyond[..., 1])
        return np.asarray(gaps.reshape(len(walls), *points.shape[:-1]))

    def ahead(self, box: OrientedBox) -> float:
        """Return the free depth in front of a box up to a wall, a column or an open leaf."""
        corners = self._solids.corners()
        frame = np.array([(math.cos(box.yaw), math.sin(box.yaw)), box.front])
        local = np.einsum("nkd,ad->nka", corners - (box.x, box.y), frame)
        return _first_ahead(local, box.width / 2.0, box.depth / 2.0)

    def covers(self, zone: OrientedBox) -> bool:
        """Whether a zone reaches into no wall, column or open leaf."""
        outline = _outlines(BoxArray.of([zone]))
        return bool((pairwise_penetration(outline, self._solids) <= INTRUSION).all())

    def lined(self, footprints: BoxArray, gap: float) -> float:
        """Return the share of points on the faces of walls in rooms before which a footprint is within a gap."""
        faces = [
            (*wall.point(s, side * wall.thickness / 2.0), wall.yaw, side)
            for wall in self.floor.walls
            for s in np.arange(FACE / 2.0, wall.length, FACE)
            for side in (1.0, -1.0)
        ]
        rows = np.array(faces).reshape(-1, 4)
        normals = np.column_stack([-np.sin(rows[:, 2]), np.cos(rows[:, 2])]) * rows[:, 3:]
        inner = np.any([space.contains(rows[:, :2] + FACE * normals, FACE) for space in self.floor.spaces], axis=0)
        if not inner.any() or not len(footprints):
            return 0.0
        rows, middles = rows[inner], (rows[:, :2] + gap / 2.0 * normals)[inner]
        halves = np.tile((0.0, gap / 2.0), (len(rows), 1))
        lines = BoxArray(middles, halves, rows[:, 2], np.tile(PLAN, (len(rows), 1)))
        return float((pairwise_penetration(lines, _outlines(footprints)) > -1e-9).any(axis=1).mean())

    def skew(self, boxes: BoxArray) -> Array:
        """Return the angle of n boxes to the nearest wall, or to the frame of their space if that is less."""
        if not len(boxes):
            return np.zeros(0)
        walls = _outlines(BoxArray.of(self.floor.wall_boxes))
        nearest = pairwise_distance(_outlines(boxes), walls).argmin(axis=1)
        frames = np.array([space.yaw for space in self.floor.spaces])[self.spaces(boxes)]
        turns = np.stack([boxes.yaw - walls.yaw[nearest], boxes.yaw - frames])
        quarter = math.pi / 2.0
        return np.asarray(np.abs(turns - quarter * np.round(turns / quarter)).min(axis=0))


def swing_area(way: Doorway, space: str) -> OrientedBox:
    """Return the floor inside a doorway that stays free in a space, as a box of standing height.

    On the side to which the leaf opens it is that of the door of a room, and at least as deep as the leaf is wide; on
    the other side, and in passages, as wide as the opening and as deep as a way out is wide.
    """
    x, y, yaw = way.side(space)
    if way.opens_into(space):
        width, depth = max(way.width, DOOR_AREA), max(way.width, DOOR_AREA)
    else:
        width, depth = way.width, EGRESS_WIDTH
    x, y = x - math.sin(yaw) * depth / 2.0, y + math.cos(yaw) * depth / 2.0
    return OrientedBox(x, y, width, depth, yaw, 0.0, HEADROOM)


def _covered(spans: list[tuple[float, float]], length: float) -> float:
    """Return the length of [0, length] that a union of intervals covers."""
    covered, reached = 0.0, 0.0
    for start, end in sorted(spans):
        start, end = max(start, reached), min(end, length)
        if end > start:
            covered += end - start
            reached = end
    return covered


def _outlines(boxes: BoxArray) -> BoxArray:
    """Return boxes that overlap in height whatever their heights are."""
    return BoxArray(boxes.centre, boxes.half, boxes.yaw, np.tile(PLAN, (len(boxes), 1)))


def _first_ahead(polygons: Array, half_width: float, start: float) -> float:
    """Return the least y - start >= 0 at which convex polygons (n, 4, 2) meet the strip |x| < half_width - 1 cm."""
    x, y = polygons[..., 0], polygons[..., 1]
    next_x, next_y = np.roll(x, -1, axis=1), np.roll(y, -1, axis=1)
    inner = half_width - ROOM_TOLERANCE
    candidates, valid = [y], [np.abs(x) < inner]
    for level in (-inner, inner):
        crosses = (x - level) * (next_x - level) < 0.0
        step = np.where(crosses, next_x - x, 1.0)
        candidates.append(y + (level - x) / step * (next_y - y))
        valid.append(crosses)
    at = np.where(np.concatenate(valid, axis=1), np.concatenate(candidates, axis=1), np.nan)
    far = np.nanmax(np.where(np.isnan(at).all(axis=1, keepdims=True), -np.inf, at), axis=1)
    near = np.nanmin(np.where(np.isnan(at).all(axis=1, keepdims=True), np.inf, at), axis=1)
    ahead = near[far > start]
    return float(max(ahead.min() - start, 0.0)) if len(ahead) else math.inf
