"""A floor as the rules read it: how far things reach out of its rooms, how near walls are, and its doors."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from labgym.geometry import (
    BoxArray,
    OrientedBox,
    interpenetrating,
    pairwise_distance,
    pairwise_penetration,
    rotate,
    to_local,
    to_world,
    wrap_angle,
)
from labgym.geometry.boxes import ROUNDING
from labgym.geometry.frames import PlanarPose
from labgym.geometry.overlap import separating_push
from labgym.layouts.floor import OUTSIDE, Doorway, Floor
from labgym.layouts.model import Layout
from labgym.layouts.rules.clearance import lower_to_boxes
from labgym.layouts.rules.thresholds import EGRESS_WIDTH, ROOM_TOLERANCE
from labgym.layouts.rules.zones import DOOR_AREA, HEADROOM, INTRUSION

Array = NDArray[np.float64]

WEDGE = 0.35
"""A point outside all regions that is at most this far from one, with no wall between, is in the wedge that a region of
rectangles leaves along an oblique wall, meters."""
PLAN = (-1000.0, 1000.0)
"""Heights of a box that stands for its outline, meters."""
PUSHES = 4
"""Pushes out of walls that are tried before an object is moved into a rectangle of its space."""
PUSH = 1e-4
"""Added to a push, meters, so that rounding does not undo it."""
NEAR = 0.10
"""Distance from the face of a wall within which an object hangs over its openings, meters."""
FACE = 0.1
"""Spacing of the points at which the faces of walls are looked at, and their distance from them, meters."""


@dataclass(frozen=True)
class Entrance:
    """A door or a passage as seen from one of its spaces.

    Attributes:
        label: its name in messages.
        space: index of the space.
        exit: whether it leads out of the floor.
        width: clear width, meters.
        area: the floor inside it that stays free.
        opening: the opening itself, as a thin box on the face of the wall.
        pose: (x, y, yaw) of its middle on the face of the wall, front toward the space.
        passage: whether it has no leaf.
    """

    label: str
    space: int
    exit: bool
    width: float
    area: OrientedBox
    opening: OrientedBox
    pose: PlanarPose
    passage: bool = False


@dataclass(frozen=True)
class Workplace:
    """A space in which people work: its index, where it is in messages, and its floor area in square meters."""

    space: int
    where: str
    area: float


@dataclass(frozen=True)
class Building:
    """Spaces that walls enclose; points and boxes are in the floor's frame, lengths in meters.

    A wall ends a room along its whole length, also where it has an opening: nothing stands in a doorway.
    """

    floor: Floor

    @property
    def workplaces(self) -> tuple[Workplace, ...]:
        """The laboratories and instrument rooms."""
        several = len(self.floor.spaces) > 1
        return tuple(
            Workplace(index, f" in {space.id!r}" if several else "", space.area)
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
        """Return the distance of grid points from walls, panes and columns, shape (ny, nx), at most `reach`.

        Every interior door stands wide open. Not positive in walls.
        """
        values = np.full((len(ys), len(xs)), reach)
        solid = [part.box for part in self.floor.parts if part.kind not in ("leaf", "lintel")]
        lower_to_boxes(values, xs, ys, solid, reach)
        return values

    def _entrance(self, way: Doorway, name: str, space: int) -> Entrance:
        x, y, yaw = way.side(name)
        height = way.opening.height
        opening = OrientedBox(x, y, way.width, 0.0, yaw, 0.0, height)
        passage = way.opening.kind == "passage"
        return Entrance(way.label, space, way.exit, way.width, swing_area(way, name), opening, (x, y, yaw), passage)

    @cached_property
    def _solid_boxes(self) -> tuple[OrientedBox, ...]:
        """Outlines of whole walls, columns and leaves."""
        fixed = [part.box for part in self.floor.parts if part.kind in ("column", "leaf")]
        return tuple(_outline(box) for box in (*self.floor.wall_boxes, *fixed))

    @cached_property
    def _solids(self) -> BoxArray:
        return BoxArray.of(self._solid_boxes)

    @cached_property
    def _solid_corners(self) -> Array:
        return self._solids.corners()

    @cached_property
    def _walls(self) -> BoxArray:
        """Whole walls."""
        return BoxArray.of(self.floor.wall_boxes)

    @cached_property
    def _openings(self) -> BoxArray:
        """Doors, passages and windows, up to `NEAR` from the faces of their walls."""
        return BoxArray.of(
            [
                OrientedBox(*wall.point(o.position), o.width, wall.thickness + 2.0 * NEAR, wall.yaw, o.sill, o.top)
                for wall in self.floor.walls
                for o in wall.openings
            ]
        )

    @cached_property
    def _regions(self) -> tuple[BoxArray, NDArray[np.intp]]:
        """Outlines of the rectangles of all spaces, and the space of each."""
        boxes = [space.boxes for space in self.floor.spaces]
        owner = np.repeat(np.arange(len(boxes)), [len(own) for own in boxes])
        return _outlines(BoxArray.of([box for own in boxes for box in own])), owner

    def _nearest(self, boxes: BoxArray) -> tuple[Array, NDArray[np.intp]]:
        """Return the distance of the middle of each box from the nearest rectangle, and that rectangle.

        Distances are computed only of the middles that are not well inside a rectangle.
        """
        middles = BoxArray(boxes.centre, np.zeros_like(boxes.half), boxes.yaw, np.tile(PLAN, (len(boxes), 1)))
        depths = pairwise_penetration(middles, self._regions[0])
        away, nearest = np.zeros(len(boxes)), (depths > -ROUNDING).argmax(axis=1)
        unclear = np.flatnonzero(depths[np.arange(len(boxes)), nearest] < ROUNDING)
        if len(unclear):
            distances = pairwise_distance(middles.take(unclear), self._regions[0])
            nearest[unclear] = distances.argmin(axis=1)
            away[unclear] = distances.min(axis=1)
        return away, nearest

    def spaces(self, boxes: BoxArray) -> NDArray[np.intp]:
        """Return the index of the space that each of n boxes is in, or nearest to, shape (n,)."""
        return np.asarray(self._regions[1][self._nearest(boxes)[1]], dtype=np.intp)

    def outside(self, boxes: BoxArray) -> Array:
        """Return how far n boxes reach into walls, columns, floor and ceiling, or out of all spaces, shape (n,)."""
        if not len(boxes):
            return np.zeros(0)
        away, nearest = self._nearest(boxes)
        reach = _deepest(_outlines(boxes), self._solids)
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
        return bool((pairwise_penetration(BoxArray.of([line]), _outlines(self._walls)) > 0.0).any())

    def gaps(self, points: Array) -> Array:
        """Return the distances of points (..., 2) from the face of each of m walls, shape (m, ...).

        Inf beyond the ends of a wall.
        """
        walls = self._walls
        flat = np.asarray(points, dtype=np.float64).reshape(-1, 2)
        local = np.abs(np.einsum("mnd,mkd->mnk", flat[None] - walls.centre[:, None], walls.axes()))
        beyond = local - walls.half[:, None]
        gaps = np.where(beyond[..., 0] > INTRUSION, np.inf, beyond[..., 1])
        return np.asarray(gaps.reshape(len(walls), *points.shape[:-1]))

    def over_openings(self, boxes: BoxArray) -> Array:
        """Return how far n boxes at a wall reach over a door, a passage or a window of it, shape (n,)."""
        return _deepest(boxes, self._openings)

    def ahead(self, box: OrientedBox) -> float:
        """Return the free depth in front of a box up to a wall, a column or an open leaf."""
        corners = self._solid_corners
        frame = np.array([(math.cos(box.yaw), math.sin(box.yaw)), box.front])
        local = np.einsum("nkd,ad->nka", corners - (box.x, box.y), frame)
        return _first_ahead(local, box.width / 2.0, box.depth / 2.0)

    def covers(self, zones: Sequence[OrientedBox]) -> NDArray[np.bool_]:
        """Return which of n zones lie in rooms and reach into no wall, column or open leaf, shape (n,)."""
        outlines = _outlines(BoxArray.of(zones))
        free = np.ones(len(zones), dtype=np.bool_)
        free[interpenetrating(outlines, self._solids, INTRUSION)[0]] = False
        return np.asarray(free & (self._nearest(outlines)[0] <= WEDGE))

    def lined(self, footprints: BoxArray, gap: float) -> float:
        """Return the share of points on the faces of walls in rooms before which a footprint stands within a gap."""
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
        """Return the angle of n boxes to the nearest wall, or to the frame of their space if that is less.

        Shape (n,), radians in [0, pi / 4].
        """
        if not len(boxes):
            return np.zeros(0)
        walls = _outlines(self._walls)
        nearest = pairwise_distance(_outlines(boxes), walls).argmin(axis=1)
        frames = np.array([space.yaw for space in self.floor.spaces])[self.spaces(boxes)]
        turns = np.stack([boxes.yaw - walls.yaw[nearest], boxes.yaw - frames])
        quarter = math.pi / 2.0
        return np.asarray(np.abs(turns - quarter * np.round(turns / quarter)).min(axis=0))

    def inward(self, box: OrientedBox) -> tuple[float, float]:
        """Return a displacement that brings a box out of walls and columns, or else into a rectangle of its space."""
        moved = box
        for _ in range(PUSHES):
            depths = pairwise_penetration(_outlines(BoxArray.of([moved])), self._solids)[0]
            if depths.max() <= 0.0:
                break
            push = separating_push(_outline(moved), self._solid_boxes[int(depths.argmax())], PUSH)
            moved = _shifted(moved, *push) if push is not None else moved
        if self.outside(BoxArray.of([moved]))[0] > 0.0:
            moved = self._in_rectangle(box)
        return moved.x - box.x, moved.y - box.y

    def _in_rectangle(self, box: OrientedBox) -> OrientedBox:
        """Return a box moved by the least displacement into one of the rectangles of its space."""
        space = self.floor.spaces[int(self.spaces(BoxArray.of([box]))[0])]
        x0, y0, x1, y1 = OrientedBox(0.0, 0.0, box.width, box.depth, box.yaw - space.yaw).bounds()
        x, y = to_local([(box.x, box.y)], space.frame)[0].tolist()
        shifts = [
            (shift_inside(x + x0, x + x1, r.x0, r.x1), shift_inside(y + y0, y + y1, r.y0, r.y1)) for r in space.region
        ]
        return _shifted(box, *rotate(*min(shifts, key=lambda shift: math.hypot(*shift)), space.yaw))

    def roomy(self, x: float, y: float, radius: float) -> bool:
        """Whether a disc at a point in a space or a doorway reaches no wall, column or open leaf."""
        dot = _outlines(BoxArray.of([OrientedBox(x, y, 0.0, 0.0)]))
        inside = bool(self.floor.inside(np.array([[x, y]]))[0])
        return inside and bool((pairwise_distance(dot, self._solids) > radius).all())

    def wall_poses(self, box: OrientedBox, gap: float, step: float) -> list[PlanarPose]:
        """Return poses of a box in its space with the back to a wall at a gap, every `step` along the walls."""
        poses = []
        start, inset = gap + box.width / 2.0, gap + box.depth / 2.0
        for wall in self.floor.walls:
            for side, turn in ((1.0, 0.0), (-1.0, math.pi)):
                for along in np.arange(start, wall.length - start + 1e-9, step).tolist():
                    x, y = wall.point(along, side * (wall.thickness / 2.0 + inset))
                    poses.append((round(x, 6), round(y, 6), wrap_angle(wall.yaw + turn)))
        return self._free(box, poses, 0.0)

    def open_poses(self, box: OrientedBox, aisle: float, step: float) -> list[PlanarPose]:
        """Return poses of a box in its space, parallel to its frame, with an aisle to every wall, on a grid."""
        space = self.floor.spaces[int(self.spaces(BoxArray.of([box]))[0])]
        xs = np.arange(min(r.x0 for r in space.region), max(r.x1 for r in space.region), step)
        ys = np.arange(min(r.y0 for r in space.region), max(r.y1 for r in space.region), step)
        places = to_world([(x, y) for x in xs for y in ys], space.frame).round(6).tolist()
        poses = [(x, y, wrap_angle(space.yaw + turn)) for turn in (0.0, math.pi / 2.0) for x, y in places]
        return self._free(box, poses, aisle)

    def _free(self, box: OrientedBox, poses: list[PlanarPose], aisle: float) -> list[PlanarPose]:
        """Return the poses at which a box, with an aisle around it, stays inside the space in which it is now."""
        if not poses:
            return []
        space = int(self.spaces(BoxArray.of([box]))[0])
        width, depth = box.width + 2.0 * aisle, box.depth + 2.0 * aisle
        boxes = BoxArray.of([OrientedBox(x, y, width, depth, yaw, 0.0, 0.1) for x, y, yaw in poses])
        here = np.flatnonzero(self.spaces(boxes) == space)
        return [poses[row] for row in here[self.outside(boxes.take(here)) <= 0.0].tolist()]


def building_of(layout: Layout) -> Building:
    """Return the building of a layout; layouts with the same floor share it."""
    return building_on(layout.floor)


@lru_cache(maxsize=16)
def building_on(floor: Floor) -> Building:
    """Return the building of a floor."""
    return Building(floor)


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


def shift_inside(low: float, high: float, least: float, most: float) -> float:
    """Return the displacement that brings [low, high] into [least, most]; to the middle if it is too long."""
    if high - low > most - least:
        return (least + most - low - high) / 2.0
    if low < least:
        return least - low
    return most - high if high > most else 0.0


def _outline(box: OrientedBox) -> OrientedBox:
    """Return a box that overlaps in height whatever its heights are."""
    return replace(box, z0=PLAN[0], z1=PLAN[1])


def _shifted(box: OrientedBox, dx: float, dy: float) -> OrientedBox:
    return replace(box, x=box.x + dx, y=box.y + dy)


def _outlines(boxes: BoxArray) -> BoxArray:
    """Return boxes that overlap in height whatever their heights are."""
    return BoxArray(boxes.centre, boxes.half, boxes.yaw, np.tile(PLAN, (len(boxes), 1)))


def _deepest(boxes: BoxArray, others: BoxArray) -> Array:
    """Return the greatest penetration of each box into another, 0 of those that reach into none, shape (n,)."""
    depths = np.zeros(len(boxes))
    rows, _, penetrations = interpenetrating(boxes, others)
    np.maximum.at(depths, rows, penetrations)
    return depths


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
