"""Walls around recognized rooms with doors where the picture shows a way through, and the floor that they form."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence, Set
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
import shapely
from shapely import LineString, Polygon, STRtree
from shapely.geometry.polygon import orient

from labgym.exchange.recognition.picture import Picture
from labgym.exchange.strips import Point, tidy_point
from labgym.geometry.polygons import grown
from labgym.layouts.floor import Wall
from labgym.layouts.floor.checks import OVERLAP
from labgym.layouts.floor.walls import extensions

SHARED = 1.0
"""Largest distance between the sides of two rooms that have one wall, meters."""
THICKNESS = (0.2, 0.15, 0.1, 0.07, 0.05)
"""Thicknesses of outer walls, the first that leaves other rooms clear, meters."""
SHORTEST = 0.08
"""Length of the shortest wall, meters."""
SLANT = math.sin(math.radians(2.0))
"""Largest sine of the angle between the two faces of a wall."""
NARROWEST, WIDEST_DOOR, WIDEST = 0.6, 2.4, 12.0
"""Widths of the narrowest opening, the widest door and the widest passage, meters."""
BEGUN = 0.15
"""Length of a way through an outer wall that is seen, meters."""
FRAME = 0.05
"""Length of wall that is left between an opening and the end of its wall, meters."""
DOOR_WIDTH = 1.0
"""Width of a door that the picture does not show, meters."""
BEHIND = 0.36
"""A room that is nearer to the outer face of a wall lies behind it, meters: slightly more than for doorways."""
TRIM = 0.012
"""Length by which a wall ends before its joints, so that it does not run on through them, meters."""
TOUCH = 0.003
"""Overlaps of walls and rooms below this are contacts, meters."""


@dataclass
class PlanWall:
    """A wall outside a side of a room, in the turned frame, meters.

    Attributes:
        start, end: ends of its middle line; the room is on the left.
        rooms: the room, and that on the other side; 0 for the outside, -1 if a room is near but does not face it.
        openings: intervals along the wall.
    """

    start: Point
    end: Point
    thickness: float
    rooms: tuple[int, int]
    openings: list[tuple[float, float]] = field(default_factory=list)

    @property
    def length(self) -> float:
        """Length, meters."""
        return math.dist(self.start, self.end)

    def point(self, along: float, across: float = 0.0) -> Point:
        """Return the point at a distance along the middle line, and to its left."""
        (x0, y0), (x1, y1) = self.start, self.end
        ux, uy = (x1 - x0) / self.length, (y1 - y0) / self.length
        return x0 + along * ux - across * uy, y0 + along * uy + across * ux

    def along(self, point: Point) -> tuple[float, float]:
        """Return the distance of a point along the wall, and its distance from the wall."""
        (x0, y0), (x1, y1) = self.start, self.end
        along = ((point[0] - x0) * (x1 - x0) + (point[1] - y0) * (y1 - y0)) / self.length
        near = min(max(along, 0.0), self.length)
        return along, math.dist(point, self.point(near))

    def free_part(self, middle: float, width: float) -> tuple[float, float] | None:
        """Return an interval of a width around a place that fits between the openings, None if none does."""
        low_limit, high_limit = FRAME, self.length - FRAME
        for low, high in self.openings:
            if low <= middle <= high:
                return None
            if high < middle:
                low_limit = max(low_limit, high + FRAME)
            else:
                high_limit = min(high_limit, low - FRAME)
        width = min(width, high_limit - low_limit)
        if width < NARROWEST + 0.001:
            return None
        start = min(max(middle - width / 2.0, low_limit), high_limit - width)
        return start, start + width

    def widen(self, index: int, width: float) -> bool:
        """Widen an opening about its middle, and return whether there is place for it."""
        way = self.openings.pop(index)
        wider = self.free_part(sum(way) / 2.0, width)
        fits = wider is not None and wider[1] - wider[0] > width - 1e-6
        self.openings.insert(index, wider if wider is not None and fits else way)
        return fits


def walls_around(rooms: Mapping[int, Polygon]) -> list[PlanWall]:
    """Return the walls around rooms: shared ones between sides that face each other, outer ones elsewhere."""
    labels = list(rooms)
    sides = {label: list(_sides(rooms[label])) for label in labels}
    tree = STRtree([rooms[label] for label in labels])
    walls: list[PlanWall] = []
    for label in labels:
        for side in sides[label]:
            near = sorted(labels[k] for k in tree.query(LineString(side).buffer(SHARED)).tolist())
            shared = _shared(label, side, {other: sides[other] for other in near})
            walls += [wall for _, _, wall in shared if wall is not None]
            for low, high in _left(math.dist(*side), [(low, high) for low, high, _ in shared]):
                walls += _outer(label, side, low, high, [rooms[other] for other in near])
    return walls


def _sides(room: Polygon) -> Iterator[tuple[Point, Point]]:
    """Yield the sides of a room, which lies to their left."""
    room = orient(room)
    for ring in (room.exterior, *room.interiors):
        for (x0, y0, *_), (x1, y1, *_) in pairwise(ring.coords):
            if math.hypot(x1 - x0, y1 - y0) > 1e-6:
                yield (x0, y0), (x1, y1)


def _shared(
    label: int, side: tuple[Point, Point], others: Mapping[int, Sequence[tuple[Point, Point]]]
) -> list[tuple[float, float, PlanWall | None]]:
    """Return the parts of a side that other rooms face, nearest first, with the wall of those with a greater number.

    The other room makes the wall of the parts whose wall is None.
    """
    (x0, y0), (x1, y1) = side
    length = math.dist(*side)
    ux, uy = (x1 - x0) / length, (y1 - y0) / length
    candidates: list[tuple[float, float, float, int]] = []
    for other, their_sides in others.items():
        for a, b in their_sides:
            span = math.dist(a, b)
            if (b[0] - a[0]) * ux + (b[1] - a[1]) * uy > 0.0:
                continue
            if abs(ux * (b[1] - a[1]) - uy * (b[0] - a[0])) > SLANT * span:
                continue
            gaps = [uy * (p[0] - x0) - ux * (p[1] - y0) for p in (a, b)]
            if not THICKNESS[-1] - TOUCH < min(gaps) <= max(gaps) <= SHARED:
                continue
            s, t = sorted(ux * (p[0] - x0) + uy * (p[1] - y0) for p in (a, b))
            low, high = max(0.0, s), min(length, t)
            if high - low > max(SHORTEST, 0.5 * min(gaps)):
                candidates.append((min(gaps), low, high, other))
    taken: list[tuple[float, float, PlanWall | None]] = []
    for gap, low, high, other in sorted(candidates):
        parts = [(max(low, s), min(high, t)) for s, t in _left(length, [(s, t) for s, t, _ in taken])]
        for start, end in parts:
            if end - start > SHORTEST:
                wall = None
                if label < other or (label == other and (x0, y0) < (x1, y1)):
                    dx, dy = uy * gap / 2.0, -ux * gap / 2.0
                    ends = [(x0 + at * ux + dx, y0 + at * uy + dy) for at in (start, end)]
                    wall = PlanWall(ends[0], ends[1], round(gap, 4), (label, other))
                taken.append((start, end, wall))
    return taken


def _left(length: float, taken: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    """Return the parts of an interval from 0 to a length that others leave."""
    here, result = 0.0, []
    for low, high in sorted(taken):
        if low - here > 1e-6:
            result.append((here, low))
        here = max(here, high)
    if length - here > 1e-6:
        result.append((here, length))
    return result


def _outer(
    label: int, side: tuple[Point, Point], low: float, high: float, rooms: Sequence[Polygon]
) -> Iterator[PlanWall]:
    """Yield the outer walls of a part of a side, as thick as other rooms leave space for."""
    if high - low < SHORTEST:
        return
    (x0, y0), (x1, y1) = side
    length = math.dist(*side)
    ux, uy = (x1 - x0) / length, (y1 - y0) / length

    def at(along: float, across: float) -> Point:
        return x0 + along * ux + across * uy, y0 + along * uy - across * ux

    def body(start: float, end: float, thickness: float) -> Polygon:
        return Polygon([at(start, TOUCH), at(end, TOUCH), at(end, thickness), at(start, thickness)])

    near = [room for room in rooms if room.intersects(body(low, high, THICKNESS[0]))]
    for thickness in THICKNESS:
        if not any(body(low + TOUCH, high - TOUCH, thickness).intersects(room) for room in near):
            break
    else:  # at an acute corner of the room the wall is shorter than its side
        blocked = []
        for room in near:
            corners = shapely.get_coordinates(body(low + TOUCH, high - TOUCH, thickness).intersection(room))
            places = (corners - (x0, y0)) @ (ux, uy) - low
            blocked += [(float(places.min()) - TOUCH, float(places.max()) + TOUCH)] if len(places) else []
        parts = [(min(end, high - low) - start, start) for start, end in _left(high - low, blocked)]
        part, start = max(parts, default=(0.0, 0.0))
        low, high = low + start, low + start + part
        if part < SHORTEST:
            return
    beyond = LineString([at(low, thickness + BEHIND), at(high, thickness + BEHIND)])
    hidden = []
    for room in rooms:
        places = (shapely.get_coordinates(beyond.intersection(grown(room, BEHIND - TOUCH))) - (x0, y0)) @ (ux, uy) - low
        if len(places):
            first, last = float(places.min()), float(places.max())
            hidden.append((min(first, last - SHORTEST), max(last, first + SHORTEST)))
    clear = [(a, b) for a, b in _left(high - low, hidden) if b - a > NARROWEST + 2.0 * FRAME]
    for other, parts in ((0, clear), (-1, _left(high - low, clear))):
        for a, b in parts:
            yield PlanWall(at(low + a, thickness / 2.0), at(low + b, thickness / 2.0), thickness, (label, other))


def trimmed(walls: Sequence[Wall], rooms: Sequence[Polygon]) -> dict[int, Wall]:
    """Return the walls of a floor by index; those that would run on at a joint into a room end before it.

    Short ones, and those without an opening that overlap a room even then, are left out.
    """
    tree = STRtree([grown(room, -0.8 * OVERLAP) for room in rooms])
    result = dict(enumerate(walls))
    for last in (False, True):
        kept: dict[int, Wall] = {}
        for (index, wall), (before, after) in zip(result.items(), extensions(list(result.values())), strict=True):
            body = Polygon(wall.piece(-before, wall.length + after, 0.0, wall.height).corners())
            if not len(tree.query(body, predicate="intersects")):
                kept[index] = wall
            elif wall.length > 2.0 * TRIM + SHORTEST and (wall.openings or not last):
                openings = [each.model_copy(update={"position": each.position - TRIM}) for each in wall.openings]
                ends = {"start": tidy_point(wall.point(TRIM)), "end": tidy_point(wall.point(wall.length - TRIM))}
                kept[index] = wall.model_copy(update={**ends, "openings": tuple(openings)})
        result = kept
    return result


def add_openings(picture: Picture, walls: Sequence[PlanWall]) -> None:
    """Add the openings that the picture shows: where the way through a wall is free from one side to the other."""
    step = picture.cell / 2.0  # samples a cell apart may jump over the cells of a line
    for wall in walls:
        if wall.rooms[1] in (-1, wall.rooms[0]):
            continue
        near = wall.thickness / 2.0 + 0.1
        # Of an outer wall the thickness is not known: the way begins, and no wall closes it.
        reach = near if wall.rooms[1] else BEGUN - wall.thickness / 2.0
        along = np.arange(step / 2.0, wall.length, step)
        across = np.arange(-reach, near + step / 2.0, step)
        if not len(along):
            continue
        start, (ux, uy) = np.array(wall.start), (np.array(wall.end) - wall.start) / wall.length
        grid = start + along[:, None, None] * (ux, uy) + across[None, :, None] * (-uy, ux)
        points = grid.reshape(-1, 2)
        clear = picture.free if wall.rooms[1] else picture.free | picture.outside
        free = picture.sampled(clear, points).reshape(len(along), len(across)).all(axis=1)
        if not wall.rooms[1]:
            beyond = np.arange(-wall.thickness / 2.0 - 0.25, -reach, step)
            points = (start + along[:, None, None] * (ux, uy) + beyond[None, :, None] * (-uy, ux)).reshape(-1, 2)
            free &= ~picture.sampled(picture.solid, points).reshape(len(along), len(beyond)).any(axis=1)
        edges = np.flatnonzero(np.diff(np.concatenate([[False], free, [False]]).astype(np.int8)))
        for low, high in zip(edges[::2] * step, edges[1::2] * step, strict=True):
            low, high = max(float(low), FRAME), min(float(high), wall.length - FRAME)
            if high - low >= NARROWEST + 0.001:
                high = min(high, low + WIDEST)
                wall.openings.append((low, high))


def add_door(walls: Sequence[PlanWall], point: Point, width: float = DOOR_WIDTH, reach: float = 0.8) -> bool:
    """Add a door to the wall nearest to a point, and return whether one within reach has place for it, meters.

    A place that already has an opening counts as done.
    """
    able = [k for k, wall in enumerate(walls) if wall.length > NARROWEST and wall.rooms[1] not in (-1, wall.rooms[0])]
    ranked = sorted((walls[index].along(point)[1], index) for index in able)
    for distance, index in ranked:
        if distance > reach:
            return False
        wall = walls[index]
        along = wall.along(point)[0]
        if any(low - FRAME <= along <= high + FRAME for low, high in wall.openings):
            return True
        part = wall.free_part(along, width)
        if part is not None:
            wall.openings.append(part)
            return True
    return False


def reached(walls: Sequence[PlanWall], rooms: Sequence[int]) -> set[int]:
    """Return the rooms to which openings lead from outside, and 0 for the outside."""
    found = {0}
    for _ in rooms:
        for wall in walls:
            if wall.openings and not found.isdisjoint(wall.rooms):
                found.update(wall.rooms)
    return found


def longest_wall(
    walls: Sequence[PlanWall], rooms: Set[int], others: Set[int], blocked: Set[Point] = frozenset()
) -> PlanWall | None:
    """Return the longest wall between a room of one set and a member of another in which a door has place.

    Args:
        blocked: places in which no door can be.
    """
    able = [
        wall
        for wall in walls
        if (wall.rooms[0] in rooms and wall.rooms[1] in others) or (wall.rooms[1] in rooms and wall.rooms[0] in others)
    ]
    parts = [wall.free_part(wall.length / 2.0, DOOR_WIDTH) for wall in able]
    able = [w for w, part in zip(able, parts, strict=True) if part and w.point(sum(part) / 2.0) not in blocked]
    return max(able, key=lambda wall: (round(wall.length, 3), wall.start), default=None)
