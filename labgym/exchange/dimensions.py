"""Dimensions of a plan (sides of spaces, openings, aisles), and labels of furniture."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Literal

import numpy as np

from labgym.exchange.structure import Point, openings, outline, polygon
from labgym.geometry import OrientedBox, wrap_angle
from labgym.geometry.polygons import intersection, largest, polygons, union
from labgym.layouts import Layout
from labgym.layouts.floor import Floor
from labgym.layouts.placement import FLOOR

if TYPE_CHECKING:
    from shapely import Geometry


OUTSIDE = 1.0
"""Distance of the dimension line of a side from the inner face of its wall, meters."""
BEYOND = 4.0
"""A side faces the outside if no space is within this distance of it, meters."""
DOOR_LINE = 0.25
"""Distance of the dimension line of an opening from the face of its wall, meters."""
SHORTEST = 0.3
"""Length of the shortest side that gets a dimension, meters."""
AISLE = (0.5, 3.0)
"""Least and largest clear width that counts as an aisle, meters."""
AISLE_SIDE = 0.9
"""Length of the shortest side of furniture that an aisle is measured from, meters."""
APART = 0.7
"""Least distance between the middles of two aisle dimensions, meters."""

Kind = Literal["side", "opening", "aisle"]
SIZES = (6.5, 5.5, 4.8, 4.2)
"""Font sizes in points."""
WIDTH, LINE = 0.62, 1.2
"""Mean width of a character and height of a line, relative to the font size."""
MARGIN = 1.0
"""Distance of a label from the outline, points."""
_PARTS = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|[0-9]+|[_.-]")


@dataclass(frozen=True)
class Dimension:
    """A measured length between two points.

    Attributes:
        start, end: the measured points, meters in the floor's frame.
        offset: distance of the dimension line to the left of the line from start to end, meters.
    """

    kind: Kind
    start: Point
    end: Point
    offset: float = 0.0

    @property
    def length(self) -> float:
        """The measured length, meters."""
        return math.dist(self.start, self.end)

    @property
    def yaw(self) -> float:
        """Direction from start to end, radians."""
        return math.atan2(self.end[1] - self.start[1], self.end[0] - self.start[0])

    @property
    def line(self) -> tuple[Point, Point]:
        """The ends of the dimension line."""
        dx, dy = -self.offset * math.sin(self.yaw), self.offset * math.cos(self.yaw)
        return (self.start[0] + dx, self.start[1] + dy), (self.end[0] + dx, self.end[1] + dy)

    @property
    def middle(self) -> Point:
        """The middle of the dimension line."""
        (x0, y0), (x1, y1) = self.line
        return (x0 + x1) / 2.0, (y0 + y1) / 2.0


def dimensions(layout: Layout) -> tuple[Dimension, ...]:
    """Return the dimensions of a plan: outer sides of spaces, openings, then aisles, the narrowest first."""
    return (*sides(layout.floor), *widths(layout.floor), *aisles(layout))


def sides(floor: Floor) -> Iterator[Dimension]:
    """Yield the sides of each space that face the outside, measured between the walls' inner faces.

    Of two sides opposite each other one is drawn.
    """
    from shapely import Polygon

    outlines = [outline(space) for space in floor.spaces]
    everything = union(outlines)
    drawn: set[tuple[int, int, int]] = set()
    for region in (part for area in outlines for part in polygons(area)):
        ring = largest(region.simplify(1e-6)).exterior.normalize()
        # shapely's normalized exterior runs clockwise, so that the outside is to the left.
        for start, end in pairwise(ring.coords):
            if math.dist(start, end) < SHORTEST:
                continue
            side = Dimension("side", (start[0], start[1]), (end[0], end[1]), OUTSIDE)
            near, far = (replace(side, offset=distance).line for distance in (0.01, BEYOND))
            if intersection(Polygon([*near, *reversed(far)]), everything).area < 1e-3 and _extent(side) not in drawn:
                drawn.add(_extent(side))
                yield side


def widths(floor: Floor) -> Iterator[Dimension]:
    """Yield the clear width of each door, passage, window and glazed part, on the side to which no leaf opens."""
    for placed in openings(floor):
        half, side = placed.opening.width / 2.0, -placed.side
        across = side * placed.thickness / 2.0
        start, end = placed.point(-half, across), placed.point(half, across)
        yield Dimension("opening", start, end, side * DOOR_LINE)


def aisles(layout: Layout) -> tuple[Dimension, ...]:
    """Return the narrowest clear widths between furniture, and between furniture and walls, narrowest first.

    A clear width is measured at a right angle to a side of a piece of furniture, at the place where it is least. Each
    pair of pieces gets one dimension, and dimensions keep a distance from each other.
    """
    pieces = {
        placement.id: layout.box(placement.id)
        for placement in layout.placements
        if placement.support == FLOOR and layout.asset(placement.id).subtype != "seat"
    }
    areas: dict[str, Geometry] = {name: polygon(box) for name, box in pieces.items()}
    areas |= {f"wall {index}": polygon(wall.box) for index, wall in enumerate(layout.floor.walls)}
    candidates: dict[tuple[str, str], Dimension] = {}
    for name, box in pieces.items():
        for side in _long_sides(box):
            gap = _gap(side, {other: area for other, area in areas.items() if other != name})
            if gap is not None:
                pair, dimension = (min(name, gap[0]), max(name, gap[0])), gap[1]
                if pair not in candidates or dimension.length < candidates[pair].length:
                    candidates[pair] = dimension
    return tuple(_spread(sorted(candidates.values(), key=lambda each: (round(each.length, 4), each.start))))


def _long_sides(box: OrientedBox) -> Iterator[tuple[Point, Point]]:
    """Yield the sides of a box from which aisles are measured; the outside is to their right."""
    corners = [(float(x), float(y)) for x, y in box.corners()]
    for start, end in zip(corners, [*corners[1:], corners[0]], strict=True):
        if math.dist(start, end) >= AISLE_SIDE:
            yield start, end


def _gap(side: tuple[Point, Point], areas: dict[str, Geometry]) -> tuple[str, Dimension] | None:
    """Return the nearest area in front of a side and the distance to it, None if it is no aisle."""
    from shapely import Polygon

    (x0, y0), (x1, y1) = side
    length = math.dist(*side)
    ux, uy = (x1 - x0) / length, (y1 - y0) / length
    out = (uy, -ux)
    reach = AISLE[1]
    strip = Polygon(
        [(x0, y0), (x1, y1), (x1 + reach * out[0], y1 + reach * out[1]), (x0 + reach * out[0], y0 + reach * out[1])]
    )
    nearest: tuple[float, float, str] | None = None
    for name, area in areas.items():
        part = intersection(strip, area)
        if part.area < 1e-4:
            continue
        points = np.array(part.convex_hull.exterior.coords) - (x0, y0)
        depth, along = points @ np.array(out), points @ np.array((ux, uy))
        least = float(depth.min())
        # The middle of the nearest edge; of one point if the nearest is a corner.
        near = along[depth < least + 1e-3]
        if nearest is None or least < nearest[0] - 1e-6:
            nearest = (least, float((near.min() + near.max()) / 2.0), name)
    if nearest is None or not AISLE[0] <= nearest[0] < AISLE[1] - 1e-6:
        return None
    depth_, along_, name = nearest
    start = (x0 + along_ * ux, y0 + along_ * uy)
    end = (start[0] + depth_ * out[0], start[1] + depth_ * out[1])
    return name, Dimension("aisle", start, end)


def _spread(candidates: Sequence[Dimension]) -> Iterator[Dimension]:
    """Yield dimensions whose middles are not close to those before them."""
    taken: list[Point] = []
    for candidate in candidates:
        if all(math.dist(candidate.middle, other) >= APART for other in taken):
            taken.append(candidate.middle)
            yield candidate


def _extent(side: Dimension) -> tuple[int, int, int]:
    """Return the direction of a side, without its sense, and its two ends along it, in millimeters."""
    yaw = side.yaw % math.pi
    yaw = 0.0 if math.pi - yaw < 1e-4 else yaw
    along = [1e3 * (x * math.cos(yaw) + y * math.sin(yaw)) for x, y in (side.start, side.end)]
    return round(1e3 * yaw), round(min(along)), round(max(along))


@dataclass(frozen=True)
class IdLabel:
    """A label in a footprint.

    Attributes:
        rotation: radians; labels read from below or from the right.
    """

    text: str
    size: float
    rotation: float


def id_label(placement_id: str, box: OrientedBox, points_per_meter: float) -> IdLabel | None:
    """Return the label of a placement that fits into its footprint, None if none does."""
    along = _readable(box.yaw)
    across = _readable(box.yaw + math.pi / 2.0)
    width, depth = box.width * points_per_meter, box.depth * points_per_meter
    for size, text in itertools.product(SIZES, _wrappings(placement_id)):
        lines = text.split("\n")
        wide = WIDTH * size * max(map(len, lines)) + 2.0 * MARGIN
        high = LINE * size * len(lines) + 2.0 * MARGIN
        for rotation, room in ((along, (width, depth)), (across, (depth, width))):
            if wide <= room[0] and high <= room[1]:
                return IdLabel(text, size, rotation)
    return None


def _wrappings(text: str) -> Iterator[str]:
    """Yield a name in one to four lines, broken between its words."""
    words = _PARTS.findall(text) if "".join(_PARTS.findall(text)) == text else [text]
    yield text
    for count in (2, 3, 4):
        target = len(text) / count
        lines = [""]
        for word in words:
            if lines[-1] and len(lines[-1]) + len(word) / 2.0 > target and len(lines) < count and word not in "_.-":
                lines.append("")
            lines[-1] += word
        yield "\n".join(lines)


def _readable(yaw: float) -> float:
    """Return a direction turned by half a turn if text along it would be upside down."""
    angle = wrap_angle(yaw)
    return angle if -math.pi / 2.0 + 1e-6 < angle <= math.pi / 2.0 + 1e-6 else wrap_angle(angle + math.pi)
