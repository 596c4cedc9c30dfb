"""Reads floors from maps of ROS: the outer walls with their doors, and inner walls."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import cv2
import numpy as np
from numpy.typing import NDArray

from labgym.errors import DocumentError, OptionError
from labgym.exchange.assembly import assemble
from labgym.exchange.drawing import Drawing, Mark
from labgym.exchange.regions import direction
from labgym.exchange.ros_files import RosMap, open_ros_map
from labgym.exchange.ros_partitions import THICKEST, partitions
from labgym.exchange.strips import PASSABLE, Point, around
from labgym.geometry.polygons import grown, largest
from labgym.layouts.floor import Floor

if TYPE_CHECKING:
    from shapely import Polygon

THICKNESS = 0.2
"""Thickness of outer walls whose outer face the map does not show, meters."""
DOOR = (0.6, 4.0)
"""Least and largest width of a gap in a wall that is read as a door, meters."""
STRAIGHT = 1.5
"""Deviation from a straight line that a wall may have, cells."""
SNAP = math.radians(1.5)
"""Sides within this angle of the main direction are parallel to it; short ones within the error of their direction."""
SHORT = 10.0
"""Length below which a side in another direction is left out, cells."""
WALLED = 0.5
"""Least share of the outer boundary that is occupied."""
LEAST_AREA = 4.0
"""Area of the smallest floor, square meters."""
Array = NDArray[np.float64]


def read_ros_map(path: str | Path, thickness: float | None = None) -> Floor:
    """Read the floor of a map of ROS: its outer walls, with gaps of 0.6 to 4 m as doors, and inner walls.

    The outer boundary of the known cells is the outer face of the walls. Sides near the main direction are made
    parallel to it; positions are accurate to about a cell. `partitions` says which structures inside are
    walls; everything else inside is taken for furniture and not read.

    Args:
        path: the map.yaml, next to its image.
        thickness: of the walls, meters; by default what the map shows, 0.05 to 0.8 m.

    Raises:
        DocumentError: a file is missing, too large or damaged, or the map shows no closed floor.
        MissingDependencyError: PyYAML is not installed.
    """
    path = Path(path)
    if thickness is not None and not 0.05 <= thickness <= 1.0:
        raise OptionError(f"wall thickness {thickness:g} m must be 0.05 to 1 m")
    grid = open_ros_map(path)
    boundary = _boundary(grid, path)
    if _walled(grid, boundary) < WALLED:
        share = f"{WALLED:.0%} of the outer boundary"
        raise DocumentError(path, "", f"less than {share} is wall: draw the walls as occupied")
    thickness = thickness or _wall_thickness(grid, boundary)
    inner = largest(grown(boundary, -thickness).simplify(grid.resolution / 10.0))
    if inner.area < LEAST_AREA:
        raise DocumentError(path, "", f"the walls enclose no floor of {LEAST_AREA:g} m² or more")
    drawing = Drawing()
    sides = list(_sides(inner))
    drawing.strips += around([start for start, _ in sides], thickness)
    for start, end in sides:
        drawing.marks += [[mark] for mark in _doors(grid, start, end, thickness)]
    if not drawing.marks:
        raise DocumentError(path, "", f"the outer walls have no gap of {DOOR[0]:g} to {DOOR[1]:g} m: draw a door")
    doors = [mark for alternatives in drawing.marks for mark in alternatives]
    walls = partitions(grid, inner, doors, direction(inner), max(THICKEST, thickness + 1.01 * grid.resolution))
    if walls:
        drawing.strips += [wall.strip for wall in walls]
        drawing.marks += [[mark] for wall in walls for mark in wall.marks]
    else:
        drawing.outlines.append(tuple((x, y) for x, y in inner.exterior.coords[:-1]))
    return assemble(drawing, path, path.parent.name if path.stem == "map" else path.stem)


def _boundary(grid: RosMap, path: Path) -> Polygon:
    """Return the outer boundary of the known cells as a polygon in meters, with straight sides.

    Raises:
        DocumentError: the largest known area is smaller than 4 square meters.
    """
    from shapely import Polygon

    known = np.asarray(grid.free | grid.occupied, dtype=np.uint8)
    # Cells that only touch at a corner, such as beams of a lidar through a window, do not belong to the floor.
    opened = cv2.morphologyEx(known, cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))
    count, labels, stats, _ = cv2.connectedComponentsWithStats(opened, connectivity=4)
    areas = stats[1:, cv2.CC_STAT_AREA] * grid.resolution**2
    if count < 2 or areas.max() < LEAST_AREA:
        raise DocumentError(path, "", f"the map shows no known area of {LEAST_AREA:g} m² or more")
    mask = (labels == 1 + int(areas.argmax())).astype(np.uint8)
    contours, _ = cv2.findContours(_doubled(mask), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    contour = max(contours, key=cv2.contourArea)
    corners = cv2.approxPolyDP(contour, 2.0 * STRAIGHT, closed=True)[:, 0, :]
    if len(corners) < 3:
        raise DocumentError(path, "", "the known area has no corners")
    # The contour of the doubled mask runs through the centers of border cells, a quarter of a cell from their edges.
    traced = [(np.asarray(each, dtype=np.float64) + 0.5) / 2.0 for each in (contour[:, 0, :], corners)]
    points = _corners(_straightened(*traced))
    if len(points) < 3:
        raise DocumentError(path, "", "the known area has no straight sides")
    polygon = Polygon(points).buffer(0.25, join_style="mitre")
    if polygon.geom_type != "Polygon" or not polygon.is_valid or not polygon.exterior.is_simple:
        raise DocumentError(path, "", "the outer boundary of the known area crosses itself")
    return Polygon(_to_floor(np.array(polygon.exterior.coords), grid))


def _doubled(mask: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return a mask with each cell as 2 x 2 cells, so that diagonal contact survives the tracing."""
    return np.kron(mask, np.ones((2, 2), np.uint8))


@dataclass(frozen=True)
class _Side:
    """A straight part of the boundary: a point on it, its direction in radians, and its ends; in cells."""

    middle: Array
    angle: float
    start: Array
    end: Array

    @property
    def length(self) -> float:
        return float(np.hypot(*(self.end - self.start)))

    def off(self, point: Array) -> float:
        """Return the distance of a point from the line."""
        dx, dy = point - self.middle
        return abs(float(dy * math.cos(self.angle) - dx * math.sin(self.angle)))

    def foot(self, point: Array) -> Array:
        """Return the foot of the perpendicular from a point to the line."""
        direction = np.array([math.cos(self.angle), math.sin(self.angle)])
        return np.asarray(self.middle + direction * float((point - self.middle) @ direction))


def _straightened(contour: Array, corners: Array) -> list[_Side]:
    """Return the sides of a traced boundary; sides near the main direction are parallel to it or at right angles.

    Short sides in other directions are the steps at corners of oblique walls; they are left out.

    Args:
        contour: points of the boundary, shape (n, 2), cells. corners: those at which it is divided, in their order.
    """
    places = [int(np.abs(contour - corner).sum(axis=1).argmin()) for corner in corners]
    ends = np.roll(corners, -1, axis=0)
    vectors = ends - corners
    lengths, angles = np.hypot(*vectors.T), np.arctan2(vectors[:, 1], vectors[:, 0])
    main = _main_direction(angles, lengths)
    sides: list[_Side] = []
    for index, angle in enumerate(angles.tolist()):
        off = (angle - main + math.pi / 4.0) % (math.pi / 2.0) - math.pi / 4.0
        aligned = abs(off) <= max(SNAP, math.atan2(STRAIGHT, float(lengths[index])))
        if not aligned and lengths[index] < SHORT:
            continue
        points = _between(contour, places[index], places[(index + 1) % len(places)])
        snapped = angle - off if aligned else angle
        side = _Side(points.mean(axis=0), snapped, corners[index], ends[index])
        if sides and _continues(sides[-1], side):
            sides[-1] = _joined(sides[-1], side)
        else:
            sides.append(side)
    if len(sides) > 1 and _continues(sides[-1], sides[0]):
        sides[0] = _joined(sides.pop(), sides[0])
    return sides


def _main_direction(angles: Array, lengths: Array) -> float:
    """Return the direction in (-pi/4, pi/4] along or across which most of the boundary runs; 0 within half a degree."""
    turned = (angles + math.pi / 4.0) % (math.pi / 2.0) - math.pi / 4.0
    apart = np.abs((turned[:, None] - turned[None] + math.pi / 4.0) % (math.pi / 2.0) - math.pi / 4.0)
    near = apart <= SNAP
    best = int((near @ lengths).argmax())
    turns, weights = 4.0 * angles[near[best]], lengths[near[best]]
    main = math.atan2(float(weights @ np.sin(turns)), float(weights @ np.cos(turns))) / 4.0
    return 0.0 if abs(main) < math.radians(0.5) else main


def _corners(sides: list[_Side]) -> Array:
    """Return the corners (n, 2) at which sides meet; parallel sides are joined at a right angle."""
    points: list[Array] = []
    for before, side in zip([sides[-1], *sides[:-1]], sides, strict=True):
        if abs(math.sin(side.angle - before.angle)) < 0.1:
            middle = (before.end + side.start) / 2.0
            points += [before.foot(middle), side.foot(middle)]
        else:
            points.append(_crossing(before.middle, before.angle, side.middle, side.angle))
    return np.array(points).reshape(-1, 2)


def _between(contour: Array, start: int, end: int) -> Array:
    """Return the points of a closed contour from one index to another."""
    return contour[start : end + 1] if start < end else np.concatenate([contour[start:], contour[: end + 1]])


def _continues(first: _Side, second: _Side) -> bool:
    """Return whether two sides run the same way on lines less than a cell apart."""
    return math.cos(second.angle - first.angle) > 0.99 and first.off(second.middle) < 1.0


def _joined(first: _Side, second: _Side) -> _Side:
    share = second.length / (first.length + second.length)
    middle = first.middle + share * (second.middle - first.middle)
    return _Side(middle, first.angle, first.start, second.end)


def _crossing(p: Array, first: float, q: Array, second: float) -> Array:
    """Return where two lines through points at directions meet."""
    ux, uy, vx, vy = math.cos(first), math.sin(first), math.cos(second), math.sin(second)
    along = ((q[0] - p[0]) * vy - (q[1] - p[1]) * vx) / (ux * vy - uy * vx)
    return np.array([p[0] + along * ux, p[1] + along * uy])


def _walled(grid: RosMap, boundary: Polygon) -> float:
    """Return the share of the outer boundary behind which a cell is occupied."""
    hits: list[NDArray[np.bool_]] = []
    import shapely

    ring = boundary.exterior
    along = np.arange(0.0, ring.length, grid.resolution)
    for cells in (0.5, 1.5):
        inside = grown(boundary, -cells * grid.resolution).boundary
        nearest = shapely.shortest_line(shapely.line_interpolate_point(ring, along), inside)
        points = shapely.get_coordinates(nearest[~shapely.is_missing(nearest)])[1::2]
        hits.append(grid.sampled(grid.occupied, points) if len(points) else np.zeros(len(along), dtype=np.bool_))
    return float((hits[0] | hits[1]).mean())


def _wall_thickness(grid: RosMap, boundary: Polygon) -> float:
    """Return the depth of occupied cells behind the outer boundary that is least but not rare, meters."""
    depths: list[int] = []
    steps = round(0.9 / grid.resolution)
    for start, end in _sides(boundary):
        length = math.dist(start, end)
        inward = (-(end[1] - start[1]) / length, (end[0] - start[0]) / length)
        for along in np.arange(0.5, length - 0.5, 2.0 * grid.resolution):
            share = along / length
            x, y = start[0] + share * (end[0] - start[0]), start[1] + share * (end[1] - start[1])
            at = (np.arange(steps) + 0.5) * grid.resolution
            line = grid.sampled(grid.occupied, np.column_stack([x + at * inward[0], y + at * inward[1]]))
            if line[0] and not line.all():
                depths.append(int(np.argmin(line)))
    if not depths:
        return THICKNESS
    least = float(np.percentile(depths, 10.0)) * grid.resolution
    return min(max(round(least / grid.resolution) * grid.resolution, 0.05), 0.8)


def _doors(grid: RosMap, start: Point, end: Point, thickness: float) -> Iterator[Mark]:
    """Yield the gaps in the wall outside a side of the floor; all doors open inwards."""
    length = math.dist(start, end)
    ux, uy = (end[0] - start[0]) / length, (end[1] - start[1]) / length
    step = grid.resolution / 4.0
    along = np.arange(step / 2.0, length, step)
    free = np.zeros(len(along), dtype=np.bool_)
    for share in (0.3, 0.5, 0.7):
        x, y = start[0] + share * thickness * uy, start[1] - share * thickness * ux
        free |= grid.sampled(grid.free, np.column_stack([x + along * ux, y + along * uy]))
    edges = np.flatnonzero(np.diff(np.concatenate([[False], free, [False]]).astype(np.int8)))
    for low, high in zip(edges[::2] * step, edges[1::2] * step, strict=True):
        if DOOR[0] <= high - low <= DOOR[1]:
            if high - low < PASSABLE <= high - low + 2.0 * grid.resolution:
                middle = min(max((low + high) / 2.0, PASSABLE / 2.0), length - PASSABLE / 2.0)
                low, high = middle - PASSABLE / 2.0, middle + PASSABLE / 2.0
            ends = [(start[0] + at * ux, start[1] + at * uy) for at in (low, high)]
            yield Mark(ends[0], ends[1], "door", ends[0], (ends[0][0] - uy, ends[0][1] + ux))


def _sides(polygon: Polygon) -> Iterator[tuple[Point, Point]]:
    """Yield the sides of a polygon; the inside is to their left."""
    from shapely.geometry.polygon import orient

    for (x0, y0, *_), (x1, y1, *_) in pairwise(orient(polygon).exterior.coords):
        if math.hypot(x1 - x0, y1 - y0) > 1e-6:
            yield (x0, y0), (x1, y1)


def _to_floor(cells: Array, grid: RosMap) -> Array:
    """Return positions (n, 2) in cells in the map's frame, meters."""
    x, y, yaw = grid.origin
    dx, dy = (cells * grid.resolution).T
    return np.column_stack([x + dx * math.cos(yaw) - dy * math.sin(yaw), y + dx * math.sin(yaw) + dy * math.cos(yaw)])
