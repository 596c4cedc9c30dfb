"""The ground of a space: its boundary as segments of wall, its gates, and where no furniture may stand."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from labgym.geometry import BoxArray, OrientedBox, compose, pairwise_penetration, relative
from labgym.layouts.floor import Doorway, Floor, Space, Wall
from labgym.layouts.ground.segments import PARALLEL, Gate, LocalWall, Pose, Segment, backed, faces
from labgym.layouts.rules.building import swing_area
from labgym.layouts.rules.supplies import Supplies

JOIN = 1e-3
"""Coordinates that are nearer than this count as one, meters."""


class Edge(NamedTuple):
    """A straight edge with the union on its left: start, unit direction along an axis, and length; meters."""

    x: float
    y: float
    dx: int
    dy: int
    length: float


class Span(NamedTuple):
    """An axis-aligned rectangle, meters."""

    x0: float
    y0: float
    x1: float
    y1: float


def outline(rectangles: Sequence[Span]) -> list[Edge]:
    """Return the edges of a union of rectangles, each as long as it is straight, holes included."""
    xs, ys, inside = _cells(rectangles)
    padded = np.pad(inside, 1)
    core = padded[1:-1, 1:-1]
    edges = []
    for row, first, last in _runs(core & ~padded[:-2, 1:-1]):
        edges.append(Edge(xs[first], ys[row], 1, 0, xs[last] - xs[first]))
    for row, first, last in _runs(core & ~padded[2:, 1:-1]):
        edges.append(Edge(xs[last], ys[row + 1], -1, 0, xs[last] - xs[first]))
    for column, first, last in _runs((core & ~padded[1:-1, :-2]).T):
        edges.append(Edge(xs[column], ys[last], 0, -1, ys[last] - ys[first]))
    for column, first, last in _runs((core & ~padded[1:-1, 2:]).T):
        edges.append(Edge(xs[column + 1], ys[first], 0, 1, ys[last] - ys[first]))
    return edges


def missing(rectangles: Sequence[Span]) -> list[Span]:
    """Return disjoint rectangles that fill the bounds of a union of rectangles up."""
    xs, ys, inside = _cells(rectangles)
    growing: dict[tuple[int, int], int] = {}
    filled = []
    for row in range(len(ys)):
        runs = {(first, last) for _, first, last in _runs(~inside[row : row + 1])} if row < len(inside) else set()
        ended = [run for run in growing if run not in runs]
        filled += [Span(xs[run[0]], ys[growing.pop(run)], xs[run[1]], ys[row]) for run in ended]
        for run in sorted(runs):
            growing.setdefault(run, row)
    return filled


def _cells(rectangles: Sequence[Span]) -> tuple[list[float], list[float], NDArray[np.bool_]]:
    """The distinct coordinates, and which cells between them lie in the union, (ny, nx)."""
    xs = distinct([x for r in rectangles for x in (r.x0, r.x1)])
    ys = distinct([y for r in rectangles for y in (r.y0, r.y1)])
    inside = np.zeros((len(ys) - 1, len(xs) - 1), dtype=np.bool_)
    for r in rectangles:
        columns = slice(_index(xs, r.x0), _index(xs, r.x1))
        inside[_index(ys, r.y0) : _index(ys, r.y1), columns] = True
    return xs, ys, inside


def distinct(values: Sequence[float]) -> list[float]:
    """Return coordinates in order, each farther than `JOIN` from the one before."""
    result: list[float] = []
    for value in sorted(values):
        if not result or value - result[-1] > JOIN:
            result.append(value)
    return result


def _index(values: Sequence[float], value: float) -> int:
    return int(np.argmin(np.abs(np.asarray(values) - value)))


def _runs(mask: NDArray[np.bool_]) -> Iterator[tuple[int, int, int]]:
    """Yield (row, first column, last column + 1) of each run of True in each row."""
    steps = np.diff(np.pad(mask, ((0, 0), (1, 1))).astype(np.int8), axis=1)
    for row in range(len(mask)):
        for first, last in zip(np.flatnonzero(steps[row] == 1), np.flatnonzero(steps[row] == -1), strict=True):
            yield row, int(first), int(last)


Use = Literal["laboratory", "instrument", "store", "write-up", "corridor"]
"""Use of a space."""
SHORTEST = 0.3
"""Length of the shortest segment, meters: nothing stands against less."""
BEYOND = 2.0
"""Thickness of the boxes that stand for what is outside the bounds, meters."""
SAMPLE = 0.05
"""Spacing of the points that tell where an oblique wall borders a space, meters."""
NEAR = 0.12
"""Distance of these points from the wall, meters: the region's staircase along it is finer."""
TOLERANCE = 1e-6
"""Overlaps smaller than this are none, meters."""


@dataclass(frozen=True)
class Ground:
    """Walls, doors and limits of a space as furniture sees them.

    The frame has its origin at the corner of the region's bounds.

    Attributes:
        space, use: id and use of the space.
        frame: pose of the ground's frame in the floor's.
        width, depth: bounds of the region, meters.
        area: of the region, square meters.
        segments: stretches of wall, at least `SHORTEST` long.
        gates: doors and passages.
        outside: boxes that fill what is not the region: beyond the bounds, missing corners, walls.
        solid: columns and walls. leaves: of interior doors as they stand.
        clear: areas without furniture, which people and robots may cross.
        ceiling: height, meters.
        supplies: service points in the space and its walls.
        water: all water points of the floor, as boxes without size.
    """

    space: str
    use: Use
    frame: Pose
    width: float
    depth: float
    area: float
    segments: tuple[Segment, ...]
    gates: tuple[Gate, ...]
    outside: tuple[OrientedBox, ...]
    solid: tuple[OrientedBox, ...]
    leaves: tuple[OrientedBox, ...]
    clear: tuple[OrientedBox, ...]
    ceiling: float
    supplies: Supplies
    water: tuple[OrientedBox, ...]

    @classmethod
    def of(cls, floor: Floor, space: Space) -> Ground:
        """Return the ground of a space of a floor."""
        x0, y0 = min(r.x0 for r in space.region), min(r.y0 for r in space.region)
        spans = [Span(r.x0 - x0, r.y0 - y0, r.x1 - x0, r.y1 - y0) for r in space.region]
        width, depth = max(s.x1 for s in spans), max(s.y1 for s in spans)
        frame = compose(space.frame, (x0, y0, 0.0))
        walls = [_local(wall, frame) for wall in floor.walls]
        holes = missing(spans)
        segments = [backed(segment, walls) for segment in (*_straight(spans), *_oblique(walls, spans))]
        gates = [_gate(way, space.id, frame) for way in floor.doorways if space.id in way.spaces]
        solid = [*floor.wall_boxes, *(part.box for part in floor.parts if part.kind == "column")]
        leaves = [part.box for part in floor.parts if part.kind == "leaf"]
        clear = [k.box for k in floor.keep_outs]
        bounds = OrientedBox(width / 2.0, depth / 2.0, width, depth, 0.0)
        return cls(
            space=space.id,
            use=space.use,
            frame=frame,
            width=width,
            depth=depth,
            area=width * depth - sum((h.x1 - h.x0) * (h.y1 - h.y0) for h in holes),
            segments=tuple(segments),
            gates=tuple(gates),
            outside=(*_around(width, depth), *(_box(hole) for hole in holes)),
            solid=tuple(_within(bounds, [_moved(box, frame) for box in solid])),
            leaves=tuple(_within(bounds, [_moved(box, frame) for box in leaves])),
            clear=tuple(_within(bounds, [_moved(box, frame) for box in clear])),
            ceiling=space.ceiling,
            supplies=Supplies.of(floor, space).moved(frame),
            water=tuple(_moved(OrientedBox(s.x, s.y, 0.0, 0.0), frame) for s in floor.services if s.kind == "water"),
        )

    def to_floor(self, pose: Pose) -> Pose:
        """Return a pose of the ground's frame in the floor's."""
        return compose(self.frame, pose)

    def box_on_floor(self, box: OrientedBox) -> OrientedBox:
        """Return a box of the ground's frame in the floor's."""
        x, y, yaw = self.to_floor((box.x, box.y, box.yaw))
        return replace(box, x=x, y=y, yaw=yaw)

    def to_ground(self, box: OrientedBox) -> OrientedBox:
        """Return a box of the floor's frame in the ground's."""
        return _moved(box, self.frame)


@lru_cache(maxsize=16)
def grounds(floor: Floor) -> tuple[Ground, ...]:
    """Return the grounds of a floor's spaces."""
    return tuple(Ground.of(floor, space) for space in floor.spaces)


def _local(wall: Wall, frame: Pose) -> LocalWall:
    yaw = math.atan2(wall.end[1] - wall.start[1], wall.end[0] - wall.start[0])
    x, y, turned = relative(frame, (*wall.start, yaw))
    return LocalWall(x, y, turned, math.dist(wall.start, wall.end), wall.thickness, wall.openings)


def _gate(way: Doorway, space: str, frame: Pose) -> Gate:
    area = _moved(swing_area(way, space), frame)
    return Gate(*relative(frame, way.side(space)), way.width, area, way.opening.kind == "door", way.exit)


def _straight(spans: Sequence[Span]) -> Iterator[Segment]:
    """The edges of a region that are long enough to stand against."""
    for number, edge in enumerate(outline(spans)):
        if edge.length >= SHORTEST:
            yield Segment(f"s{number}", edge.x, edge.y, math.atan2(edge.dy, edge.dx), edge.length)


def _oblique(walls: Sequence[LocalWall], spans: Sequence[Span]) -> Iterator[Segment]:
    """The stretches of the faces of oblique walls that border a region."""
    for number, wall in enumerate(walls):
        if abs(math.sin(2.0 * wall.yaw)) < 2.0 * PARALLEL:
            continue
        for side, face in zip("lr", faces(wall), strict=True):
            alongs = np.arange(SAMPLE / 2.0, wall.length, SAMPLE)
            points = np.array([face.point(along, NEAR) for along in alongs])
            near = np.zeros(len(points), dtype=np.bool_)
            for span in spans:
                in_x = (points[:, 0] >= span.x0) & (points[:, 0] <= span.x1)
                near |= in_x & (points[:, 1] >= span.y0) & (points[:, 1] <= span.y1)
            for _, first, last in _runs(near[None]):
                start, end = alongs[first] - SAMPLE / 2.0, alongs[last - 1] + SAMPLE / 2.0
                if end - start >= SHORTEST:
                    x, y = face.point(float(start))
                    yield Segment(f"o{number}{side}{first}", x, y, face.yaw, float(end - start), straight=False)


def _moved(box: OrientedBox, frame: Pose) -> OrientedBox:
    x, y, yaw = relative(frame, (box.x, box.y, box.yaw))
    return replace(box, x=x, y=y, yaw=yaw)


def _within(bounds: OrientedBox, boxes: Sequence[OrientedBox]) -> list[OrientedBox]:
    """The boxes that reach into the bounds."""
    if not boxes:
        return []
    depths = pairwise_penetration(BoxArray.of(boxes), BoxArray.of([bounds]))[:, 0]
    return [box for box, depth in zip(boxes, depths, strict=True) if depth > TOLERANCE]


def _around(width: float, depth: float) -> list[OrientedBox]:
    """Boxes around the bounds of a region, which stand for everything beyond."""
    x, y, half = width / 2.0, depth / 2.0, BEYOND / 2.0
    long, high = width + 2.0 * BEYOND, depth + 2.0 * BEYOND
    return [
        OrientedBox(x, -half, long, BEYOND, 0.0),
        OrientedBox(x, depth + half, long, BEYOND, 0.0),
        OrientedBox(-half, y, BEYOND, high, 0.0),
        OrientedBox(width + half, y, BEYOND, high, 0.0),
    ]


def _box(span: Span) -> OrientedBox:
    width, depth = span.x1 - span.x0, span.y1 - span.y0
    return OrientedBox((span.x0 + span.x1) / 2.0, (span.y0 + span.y1) / 2.0, width, depth, 0.0)
