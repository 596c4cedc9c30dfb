"""Outlines of rooms as polygons: straight sides, those near the main direction along it, on common lines."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import cv2
import numpy as np
from scipy import ndimage
from shapely import MultiPolygon, Polygon
from shapely.geometry.polygon import orient

from labgym.exchange.recognition.picture import Array, Mask, Picture, components
from labgym.exchange.recognition.rooms import Labels
from labgym.geometry.polygons import difference, grown, largest

ALIGNED = math.radians(7.0)
"""Sides within this angle of the main direction are drawn along it."""
DRIFT = 0.4
"""Greatest distance between the ends of such a side across the main direction, meters: long walls may be bent."""
DRAWN = math.radians(3.0)
"""The same for sides between corners that a person states."""
DEVIATION = {False: 0.12, True: 0.04}
"""Deviation of an outline from straight sides, meters; of drawings it is less."""
JOG = {False: 0.3, True: 0.09}
"""Longest step in a wall that is straightened, meters."""
LINE = {False: 0.15, True: 0.04}
"""Sides that face the same way and are nearer than this lie on one line, meters."""
SHARE = 0.8
"""Share of the boundary along a side that lies inside: furniture at a wall hides more than beams reach through it."""
FACE = 0.75
"""Depth of the face of a wall in its first solid cells in a map, cells: half, and the rounding of turned cells."""
COARSE = 2.5
"""Factor on the deviation and the steps of outlines that are too complicated."""
FINE = 0.2
"""Longest step in a wall that is straightened in a map as long as its outline is not too complicated, meters."""
OBLIQUE = {False: 1.5, True: 0.4}
"""Length of the shortest side in another direction; shorter ones are drawn as steps, meters."""
FINE_OBLIQUE = 0.5
"""The same in a map as long as its outline is not too complicated, meters."""
LEAST_HOLE = 0.4
"""Area of the smallest part inside a room that is not of it, such as a shaft or a free-standing wall, square meters."""
SOLID_HOLE, LARGE_HOLE = 0.6, 4.0
"""Least share of the smallest rectangle around a hole of a map that it covers, and the area above which it may cover
less, square meters: what covers less, such as rows of seats, is no wall and no shaft."""
THINNEST = 0.045
"""Sides that are nearer than this have no wall between them and lie on one line, meters."""
APART = 0.08
"""Least distance between rooms: the thickness of the thinnest wall, meters."""

UNCHANGED = 0.9
"""Least overlap of a room with the outline that an answer states for it."""


@dataclass(frozen=True)
class _Side:
    """A side of an outline, counter-clockwise.

    Attributes:
        axis: 0 if it runs along x, 1 along y, None in another direction.
        at: y of a side along x, x of one along y, meters.
        start, end: its ends, meters.
    """

    axis: int | None
    at: float
    start: tuple[float, float]
    end: tuple[float, float]

    @property
    def length(self) -> float:
        if self.axis is None:
            return math.dist(self.start, self.end)
        return abs(self.end[self.axis] - self.start[self.axis])

    @property
    def sign(self) -> bool:
        """Whether the side runs towards greater coordinates, which says on which side of it the room lies."""
        return self.axis is not None and self.end[self.axis] > self.start[self.axis]


def outlines(picture: Picture, labels: Labels, coarse: Mapping[int, int] | None = None) -> dict[int, Polygon]:
    """Return the outline of each room in the turned frame, meters; rooms are apart by the thickness of a wall.

    Rooms without a straight outline are left out.

    Args:
        coarse: rooms whose outline is too complicated: 1 for one with few short oblique sides, 2 with fewer corners,
            3 for one that also has only sides along the axes. Those of drawings are as they are drawn at 0 and 1.
    """
    rooms: dict[int, list[list[_Side]]] = {}
    stated = _stated(picture, labels)
    for label, window in enumerate(ndimage.find_objects(labels), start=1):
        if window is None:
            continue
        x, y = picture.x + window[1].start * picture.cell, picture.y + window[0].start * picture.cell
        level = (coarse or {}).get(label, 0)
        rings = (
            [stated[label]]
            if label in stated
            else [
                _sides(part, (x, y), picture, level, 0.0 if index or picture.drawn else FACE * picture.cell)
                for index, part in enumerate(_parts(labels[window] == label, picture))
            ]
        )
        if len(rings[0]) >= 3:
            rooms[label] = [ring for ring in rings if len(ring) >= 3]
    rings_ = [ring for rings in rooms.values() for ring in rings]
    _to_common_lines(rings_, LINE[picture.drawn], same_way=True)
    _to_common_lines(rings_, THINNEST, same_way=False)  # else slits stay between a side and the end of another
    result: dict[int, Polygon] = {}
    for label, rings in rooms.items():
        area: Polygon | MultiPolygon = largest(Polygon(_corners(rings[0])))
        for ring in rings[1:]:  # a hole that lies on the outline cuts the room
            hole = largest(Polygon(_corners(ring)))
            slanted = any(side.axis is None for side in ring)
            area = largest(difference(area, hole.minimum_rotated_rectangle if slanted else hole))
        for other in result.values():
            if not area.is_empty and area.distance(other) < APART - 1e-6:
                area = largest(difference(area, grown(other, APART)))
        if area.area >= 0.5:
            result[label] = area
    return result


def _stated(picture: Picture, labels: Labels) -> dict[int, list[_Side]]:
    """Return the sides of rooms that answers state and no other answer changes; small angles are drawing errors."""
    result: dict[int, list[_Side]] = {}
    for corners in picture.outlines:
        room = picture.inside(corners)
        label = int(np.bincount(labels[room]).argmax()) if room.any() else 0
        if label and (room & (labels == label)).sum() > UNCHANGED * max(room.sum(), (labels == label).sum()):
            ring = orient(Polygon(corners)).exterior.coords
            result[label] = _joined([_between_corners(*ends) for ends in pairwise(ring)])
    return result


def _between_corners(start: tuple[float, ...], end: tuple[float, ...]) -> _Side:
    first, last = (start[0], start[1]), (end[0], end[1])
    dx, dy = last[0] - first[0], last[1] - first[1]
    for axis, (along, across) in enumerate(((dx, dy), (dy, dx))):
        if abs(math.atan2(across, abs(along))) <= DRAWN:
            return _Side(axis, (first[1 - axis] + last[1 - axis]) / 2.0, first, last)
    return _Side(None, 0.0, first, last)


def _parts(mask: Mask, picture: Picture) -> list[Mask]:
    """Return the area of a room with its holes filled, then its holes of some size."""
    full = ndimage.binary_fill_holes(mask)
    count, labels, stats = components(full & ~mask)
    large = [k for k in range(1, count + 1) if stats[k, cv2.CC_STAT_AREA] * picture.cell**2 >= LEAST_HOLE]
    holes = [np.asarray(labels == k) for k in large]
    return [np.asarray(full), *(hole for hole in holes if picture.drawn or _is_structure(hole, picture))]


def _is_structure(hole: Mask, picture: Picture) -> bool:
    """Return whether a hole in a room of a map is large or about as full as a wall or a shaft."""
    width, height = cv2.minAreaRect(np.argwhere(hole).astype(np.int32))[1]
    area = int(hole.sum())
    return area * picture.cell**2 >= LARGE_HOLE or area >= SOLID_HOLE * (width + 1.0) * (height + 1.0)


def _sides(mask: Mask, corner: tuple[float, float], picture: Picture, level: int, face: float) -> list[_Side]:
    """Return the sides of the outer boundary of a room or hole.

    Args:
        corner: that of cell [0, 0] of the mask, meters.
        face: distance of the faces of walls beyond the boundary, meters.
    """
    # Each cell as 2 x 2 cells, so that the contour runs a quarter of a cell inside the boundary everywhere.
    factor, fine = COARSE if level > 1 else 1.0, level == 0 and not picture.drawn
    shortest = math.inf if level > 2 else FINE_OBLIQUE if fine else factor * OBLIQUE[picture.drawn]
    doubled = np.kron(mask.astype(np.uint8), np.ones((2, 2), np.uint8))
    contours, _ = cv2.findContours(np.asarray(doubled, dtype=np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    contour = max(contours, key=cv2.contourArea)
    half = picture.cell / 2.0
    if cv2.contourArea(contour) < 4:
        return []
    tolerance = factor * max(DEVIATION[picture.drawn], 0.7 * picture.cell)
    corners = cv2.approxPolyDP(contour, tolerance / half, closed=True)[:, 0, :]
    if len(corners) < 3:
        return []
    points = contour[:, 0, :].astype(np.float64)
    # OpenCV traces outer boundaries clockwise in a frame whose y points up.
    if cv2.contourArea(contour, oriented=True) < 0.0:
        points, corners = points[::-1], corners[::-1]
    index = {tuple(point): place for place, point in reversed(list(enumerate(points.astype(int).tolist())))}
    places = [index[tuple(corner_)] for corner_ in corners.tolist()]
    metric = corner + (points + 0.5) * half
    sides = []
    for start, end in zip(places, [*places[1:], places[0]], strict=True):
        along = metric[start : end + 1] if start <= end else np.concatenate([metric[start:], metric[: end + 1]])
        sides.append(_side(along, tolerance, half / 2.0 + face, shortest))
    return _straightened(sides, FINE if fine else factor * JOG[picture.drawn])


def _side(points: Array, tolerance: float, inset: float, shortest: float) -> _Side:
    """Return the side along points (n, 2) of a contour, which runs by an inset inside the boundary, meters.

    Args:
        shortest: length of the shortest side in another direction than along an axis.
    """
    first, last = tuple(points[0].tolist()), tuple(points[-1].tolist())
    dx, dy = last[0] - first[0], last[1] - first[1]
    length = math.hypot(dx, dy)
    aligned = max(min(ALIGNED, math.atan2(DRIFT, length)), math.atan2(tolerance, length))
    slack = math.pi / 4.0 if length < shortest else aligned
    for axis, (along, across) in enumerate(((dx, dy), (dy, dx))):
        if abs(math.atan2(across, abs(along))) <= slack + 1e-9:
            outward = (-1.0 if along > 0.0 else 1.0) * (1.0 if axis == 0 else -1.0)
            at = outward * (float(np.quantile(outward * points[:, 1 - axis], SHARE)) + inset)
            return _Side(axis, at, first, last)
    nx, ny = dy / length * inset, -dx / length * inset
    return _Side(None, 0.0, (first[0] + nx, first[1] + ny), (last[0] + nx, last[1] + ny))


def _straightened(sides: list[_Side], jog: float) -> list[_Side]:
    """Return sides of which consecutive ones along one axis are joined, shortest steps first."""
    sides = _joined(sides)
    while len(sides) > 4:
        steps = [
            (side.length, index)
            for index, side in enumerate(sides)
            if side.length < jog
            and sides[index - 1].axis is not None
            and sides[index - 1].axis == sides[(index + 1) % len(sides)].axis
        ]
        if not steps:
            break
        index = min(steps)[1]
        before, after = sides[index - 1], sides[(index + 1) % len(sides)]
        merged = _between(before, after)
        rest = [
            side for k, side in enumerate(sides) if k not in {index, (index - 1) % len(sides), (index + 1) % len(sides)}
        ]
        place = sum(1 for k in range(index) if k not in {(index - 1) % len(sides), (index + 1) % len(sides)})
        sides = _joined([*rest[:place], merged, *rest[place:]])
    return sides


def _joined(sides: list[_Side]) -> list[_Side]:
    """Return sides of which consecutive ones that run the same way along one axis are one."""
    result: list[_Side] = []
    for side in sides:
        if result and side.axis is not None and side.axis == result[-1].axis and side.sign == result[-1].sign:
            result[-1] = _between(result[-1], side)
        else:
            result.append(side)
    while (
        len(result) > 3
        and result[0].axis is not None
        and result[0].axis == result[-1].axis
        and result[0].sign == result[-1].sign
    ):
        result[0] = _between(result.pop(), result[0])
    return result


def _between(before: _Side, after: _Side) -> _Side:
    """Return one side for two along the same axis, on the line of the longer one if it is much longer."""
    total = before.length + after.length
    share = after.length / total if total > 0.0 else 0.5
    share = 0.0 if share < 0.2 else 1.0 if share > 0.8 else share
    return _Side(before.axis, before.at + share * (after.at - before.at), before.start, after.end)


def _to_common_lines(rings: Sequence[list[_Side]], distance: float, same_way: bool) -> None:
    """Move sides that lie within a distance onto one line, by length; all or those that run the same way."""
    groups: dict[tuple[int, bool], list[tuple[float, float, int, int]]] = {}
    for label, sides in enumerate(rings):
        for index, side in enumerate(sides):
            if side.axis is not None:
                groups.setdefault((side.axis, side.sign and same_way), []).append((side.at, side.length, label, index))
    for entries in groups.values():
        entries.sort()
        cluster: list[tuple[float, float, int, int]] = []
        for entry in [*entries, (math.inf, 0.0, 0, 0)]:
            if cluster and entry[0] - cluster[0][0] > distance:
                weight = sum(length for _, length, _, _ in cluster)
                at = sum(position * length for position, length, _, _ in cluster) / weight if weight else cluster[0][0]
                for _, _, label, index in cluster:
                    rings[label][index] = replace(rings[label][index], at=round(at, 4))
                cluster = []
            cluster.append(entry)


def _corners(sides: Sequence[_Side]) -> list[tuple[float, float]]:
    """Return the corners at which consecutive sides meet, meters."""
    corners: list[tuple[float, float]] = []
    for before, side in zip([sides[-1], *sides[:-1]], sides, strict=True):
        if before.axis is not None and before.axis == side.axis:  # back along the same axis: a step between them
            middle = (before.end[side.axis] + side.start[side.axis]) / 2.0
            ends = [(middle, before.at), (middle, side.at)]
            corners += ends if side.axis == 0 else [(y, x) for x, y in ends]
        else:
            corners.append(_meeting(before, side))
    return corners


def _meeting(before: _Side, side: _Side) -> tuple[float, float]:
    if before.axis == 0 and side.axis == 1:
        return side.at, before.at
    if before.axis == 1 and side.axis == 0:
        return before.at, side.at
    if before.axis is None and side.axis is None:
        return (before.end[0] + side.start[0]) / 2.0, (before.end[1] + side.start[1]) / 2.0
    oblique, straight = (before, side) if before.axis is None else (side, before)
    (x0, y0), (x1, y1) = oblique.start, oblique.end
    corner = before.end if before.axis is None else side.start
    if straight.axis == 0:
        if abs(y1 - y0) < 0.05:
            return corner[0], straight.at
        return x0 + (straight.at - y0) / (y1 - y0) * (x1 - x0), straight.at
    if abs(x1 - x0) < 0.05:
        return straight.at, corner[1]
    return straight.at, y0 + (straight.at - x0) / (x1 - x0) * (y1 - y0)
