"""Wall strips from the lines of a drawing: rectangles, wide polylines, and pairs of parallel faces."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from labgym.errors import OptionError

Point = tuple[float, float]

THICKNESS = (0.02, 1.0)
"""Least and largest thickness of a wall that is read, meters."""
PAIRED = 0.6
"""Largest distance between two faces that are read as one wall, meters."""
SHORTEST = 0.05
"""Length of the shortest strip, meters."""
PARALLEL = 0.01
"""Largest sine of the angle between two faces of a wall."""
MOST_FACES = 2000
"""Largest number of single lines that are compared with each other."""
PASSABLE = 0.72
"""Width of the narrowest door for the robot, meters; openings that may be as wide, for all that is known, get it."""
SAME = 1e-3
"""Lengths below this count as nothing, meters."""


@dataclass(frozen=True)
class Stroke:
    """A polyline of a drawing, in meters.

    Attributes:
        width: width of the line, 0 for an ordinary one.
        height: extruded height, 0 if the drawing is flat.
    """

    points: tuple[Point, ...]
    closed: bool = False
    width: float = 0.0
    height: float = 0.0

    def segments(self) -> Iterable[tuple[Point, Point]]:
        """Yield the segments that have a length."""
        ends = [*self.points[1:], *(self.points[:1] if self.closed else ())]
        return ((a, b) for a, b in zip(self.points, ends, strict=False) if math.dist(a, b) > SAME)


@dataclass(frozen=True)
class Strip:
    """A straight part of a wall by its middle line, in meters; height 0 if the drawing does not have it."""

    start: Point
    end: Point
    thickness: float
    height: float = 0.0

    @property
    def length(self) -> float:
        """Length of the middle line, meters."""
        return math.dist(self.start, self.end)

    @property
    def yaw(self) -> float:
        """Direction from start to end, radians."""
        return math.atan2(self.end[1] - self.start[1], self.end[0] - self.start[0])


def strips(strokes: Sequence[Stroke], oriented: bool = False) -> list[Strip]:
    """Return the wall strips that strokes describe.

    A closed rectangle up to 1 m thick is a strip, each segment of a polyline with a width is one, and two parallel
    segments up to 0.6 m apart are the faces of one.

    Args:
        oriented: whether the first side of each rectangle lies along the wall; otherwise the longer one does.

    Raises:
        OptionError: there are more than 2000 single lines.
    """
    walls: list[Strip] = []
    faces: list[tuple[Point, Point]] = []
    for stroke in strokes:
        rectangle = _rectangle(stroke, oriented)
        if rectangle is not None:
            walls.append(rectangle)
        elif stroke.width >= THICKNESS[0]:
            walls += [Strip(a, b, min(stroke.width, THICKNESS[1]), stroke.height) for a, b in stroke.segments()]
        else:
            faces += stroke.segments()
    if len(faces) > MOST_FACES:
        raise OptionError(f"{len(faces)} lines of walls; at most {MOST_FACES} are read: draw closed rectangles")
    return walls + _between(faces)


def around(corners: Sequence[Point], thickness: float) -> list[Strip]:
    """Return the walls outside the sides of a polygon, in their order.

    A wall ends at the corners of its side; at a corner that points inwards at less than a right angle it ends earlier,
    so that its end does not reach into the polygon.

    Args:
        corners: of the polygon, counter-clockwise, meters.
    """
    count = len(corners)
    sides = [(corners[index], corners[(index + 1) % count]) for index in range(count)]
    yaws = [math.atan2(b[1] - a[1], b[0] - a[0]) for a, b in sides]
    walls = []
    for index, ((x0, y0), (x1, y1)) in enumerate(sides):
        yaw, length = yaws[index], math.dist((x0, y0), (x1, y1))
        ux, uy = math.cos(yaw), math.sin(yaw)
        start = _setback(yaws[index - 1], yaw, thickness)
        end = length - _setback(yaw, yaws[(index + 1) % count], thickness)
        if end - start <= SHORTEST:
            start, end = 0.0, length
        dx, dy = uy * thickness / 2.0, -ux * thickness / 2.0
        points = [(x0 + at * ux + dx, y0 + at * uy + dy) for at in (start, end)]
        walls.append(Strip(points[0], points[1], thickness))
    return walls


def _setback(before: float, after: float, thickness: float) -> float:
    """Return by how much walls end before a corner between sides of two directions in radians, meters."""
    turn = math.remainder(after - before, 2.0 * math.pi)
    between = math.pi + turn  # angle between the sides on the walls' side, if the corner points inwards
    return thickness / math.tan(between) if turn < 0.0 and 0.2 < between < math.pi / 2.0 - 1e-6 else 0.0


def _rectangle(stroke: Stroke, oriented: bool) -> Strip | None:
    """Return the strip that a closed rectangle describes, None if a stroke is something else."""
    points = list(stroke.points)
    if len(points) > 1 and math.dist(points[0], points[-1]) <= SAME:
        points.pop()
    elif not stroke.closed:
        return None
    if len(points) != 4:
        return None
    a, b, c, d = points
    if math.dist(_middle(a, c), _middle(b, d)) > SAME or abs(math.dist(a, c) - math.dist(b, d)) > SAME:
        return None
    first, second = math.dist(a, b), math.dist(b, c)
    along_first = oriented or first >= second
    length, thickness = (first, second) if along_first else (second, first)
    if not THICKNESS[0] <= thickness <= THICKNESS[1] or length <= (SAME if oriented else SHORTEST):
        return None
    start, end = (_middle(d, a), _middle(b, c)) if along_first else (_middle(a, b), _middle(c, d))
    return Strip(start, end, thickness, stroke.height)


def _between(faces: Sequence[tuple[Point, Point]]) -> list[Strip]:
    """Return the strips between parallel faces; each stretch of a face belongs to the nearest face opposite."""
    candidates: list[tuple[float, int, int, float, float]] = []
    for i, (a, b) in enumerate(faces):
        length = math.dist(a, b)
        ux, uy = (b[0] - a[0]) / length, (b[1] - a[1]) / length
        for j in range(i + 1, len(faces)):
            c, d = faces[j]
            if abs(ux * (d[1] - c[1]) - uy * (d[0] - c[0])) > PARALLEL * math.dist(c, d):
                continue
            gap = abs(ux * (c[1] - a[1]) - uy * (c[0] - a[0]))
            if not THICKNESS[0] <= gap <= PAIRED:
                continue
            s, t = (ux * (p[0] - a[0]) + uy * (p[1] - a[1]) for p in (c, d))
            low, high = max(0.0, min(s, t)), min(length, max(s, t))
            if high - low > SHORTEST:
                candidates.append((gap, i, j, low, high))
    taken: dict[int, list[tuple[float, float]]] = {}
    walls: list[Strip] = []
    for _, i, j, low, high in sorted(candidates):
        (a, b), (c, d) = faces[i], faces[j]
        length = math.dist(a, b)
        u = ((b[0] - a[0]) / length, (b[1] - a[1]) / length)
        for start, end in _free([*taken.get(i, []), *_seen_from(faces[i], faces[j], taken.get(j, []))], low, high):
            p, q = _along(a, u, start), _along(a, u, end)
            opposite = _foot(p, c, d), _foot(q, c, d)
            walls.append(Strip(_middle(p, opposite[0]), _middle(q, opposite[1]), math.dist(p, opposite[0])))
            taken.setdefault(i, []).append((start, end))
            other = math.dist(c, d)
            v = ((d[0] - c[0]) / other, (d[1] - c[1]) / other)
            ends = sorted(v[0] * (e[0] - c[0]) + v[1] * (e[1] - c[1]) for e in opposite)
            taken.setdefault(j, []).append((ends[0], ends[1]))
    return walls


def _free(taken: Iterable[tuple[float, float]], low: float, high: float) -> Iterable[tuple[float, float]]:
    """Yield the parts of an interval that are not taken and long enough."""
    here = low
    for start, end in sorted(taken):
        if start >= high:
            break
        if start - here > SHORTEST:
            yield here, start
        here = max(here, end)
    if high - here > SHORTEST:
        yield here, high


def _seen_from(
    face: tuple[Point, Point], other: tuple[Point, Point], intervals: Iterable[tuple[float, float]]
) -> Iterable[tuple[float, float]]:
    """Yield intervals along a face that lie opposite intervals along another one."""
    (a, b), (c, d) = face, other
    length, size = math.dist(a, b), math.dist(c, d)
    u, v = ((b[0] - a[0]) / length, (b[1] - a[1]) / length), ((d[0] - c[0]) / size, (d[1] - c[1]) / size)
    for interval in intervals:
        points = [_along(c, v, each) for each in interval]
        low, high = sorted(u[0] * (x - a[0]) + u[1] * (y - a[1]) for x, y in points)
        yield low, high


def _along(origin: Point, direction: Point, distance: float) -> Point:
    return origin[0] + distance * direction[0], origin[1] + distance * direction[1]


def _foot(point: Point, start: Point, end: Point) -> Point:
    """Return the foot of the perpendicular from a point to the line through two others."""
    dx, dy = end[0] - start[0], end[1] - start[1]
    share = ((point[0] - start[0]) * dx + (point[1] - start[1]) * dy) / (dx * dx + dy * dy)
    return start[0] + share * dx, start[1] + share * dy


def _middle(a: Point, b: Point) -> Point:
    return (a[0] + b[0]) / 2.0, (a[1] + b[1]) / 2.0


def tidy(length: float) -> float:
    """Return a length in meters rounded to a micrometer, without a negative zero."""
    return round(length, 6) + 0.0


def tidy_point(point: tuple[float, float]) -> tuple[float, float]:
    """Return a point in meters rounded to a micrometer, without negative zeros."""
    return tidy(point[0]), tidy(point[1])
