"""Reads floors from building models: exactly, or as a picture from which a floor is recognized."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np

from labgym.errors import DocumentError, OptionError
from labgym.exchange.assembly import assemble
from labgym.exchange.drawing import Drawing, Mark, Tag
from labgym.exchange.ifc.storeys import Room, Storey, Wall, Way, read_storey
from labgym.exchange.recognition.picture import MAX_PIXELS, Array, Mask, Picture, main_direction, turned
from labgym.exchange.recognition.plans import CELL, MARGIN, outside_of, spread
from labgym.exchange.regions import region_of
from labgym.exchange.strips import Strip, tidy
from labgym.geometry import to_world
from labgym.geometry.frames import PlanarPose
from labgym.geometry.polygons import difference, grown, polygons, union
from labgym.layouts.floor import Floor
from labgym.layouts.floor.fields import IDENTIFIER

if TYPE_CHECKING:
    from shapely import Geometry, Polygon

RECTANGULAR, MITRED = 0.9, 0.6
"""Least shares of its smallest rectangle that the footprint of a wall covers: of any, and of one with four corners.

The ends of a mitred wall are filled; its neighbors cover what is added.
"""
TOUCHING, SAME = 0.01, 1e-3
"""Rooms that are nearer than the first are one; corners within the second of a straight side are dropped, meters."""
SAME_PLACE = 0.5
"""Two ways are in the same place if their middles are nearer than this share of the width of the wider one."""
OFF_WALL_M = 0.05
"""Greatest distance of a way from its wall; others are in walls that are not read."""
MOST_PIECES = 6
"""Largest number of rectangles of a wall that is read exactly."""
LEAST_AREA = 1.0
"""Area of the smallest room, square meters."""
THICKNESS = (0.02, 1.0)
"""Thicknesses of walls that are read exactly, meters."""
USES = {
    "corridor": r"corridor|hall|flur|gang|diele|couloir|pasillo|lobby|foyer|走廊",
    "store": r"stor|lager|abstell|archiv|magasin|almac|仓",
    "write-up": r"office|büro|buero|bureau|oficina|meeting|besprech|办公",
    "instrument": r"instrument|equipment|server|technik|仪器",
}
"""Words in names of spaces by use; other spaces are laboratories."""


def read_ifc(path: str | Path, storey: str | None = None) -> Floor:
    """Read the floor of a storey of a building model.

    Walls are those with rectangular footprints, rooms the spaces, doors, windows and passages the openings of walls.
    The frame of the floor lies along that of the storey; its `origin` is its pose in the world of the model.

    Args:
        storey: its number from the lowest, from 1, or its name; by default the one with most spaces and walls.

    Raises:
        DocumentError: the file is no building model, or the parts form no floor.
        UnknownNameError: it has no such storey.
        MissingDependencyError: ifcopenshell is not installed.
    """
    path = Path(path)
    parts = read_storey(path, storey)
    drawing = Drawing(origin=parts.origin)
    for wall in parts.walls:
        drawing.strips += [strip for part in polygons(wall.area) for strip in _strips(part, wall.height, path)]
    walls = union(wall.area for wall in parts.walls)
    drawing.marks = [[_mark(way, top)] for way in _distinct(parts.ways) if (top := _top(parts.walls, way)) is not None]
    rooms = _apart(parts.rooms, walls)
    for room, name in zip(rooms, _names(rooms), strict=True):
        rings = (room.area.exterior, *room.area.interiors)
        drawing.outlines += [tuple((tidy(x), tidy(y)) for x, y, *_ in ring.coords[:-1]) for ring in rings]
        point = room.area.representative_point()
        fields = {"id": name, "use": _use(room.use or room.name), "ceiling": min(max(round(room.height, 4), 2.2), 10.0)}
        drawing.tags.append(Tag(point.x, point.y, fields))
    return assemble(drawing, path, _name(path, parts))


def picture_of_building(path: Path, storey: str | None) -> tuple[Picture, PlanarPose, list[str], list[str]]:
    """Return the picture of a storey, the pose of its frame in the world, what was left out, and questions.

    Raises:
        DocumentError, UnknownNameError, MissingDependencyError: as `read_ifc`, or the storey has no wall and no space.
    """
    parts = read_storey(path, storey)
    rooms, walls = union(room.area for room in parts.rooms), union(wall.area for wall in parts.walls)
    every = [ring for area in (walls, rooms) for part in polygons(area) for ring in _rings(part)]
    if not every:
        raise DocumentError(path, "", f"storey {parts.number} has no wall or space that can be read: {_listed(parts)}")
    yaw = main_direction(np.concatenate([spread(ring, 0.2) for ring in every]), 0.05)
    points = turned(np.concatenate(every), -yaw)
    low, high = points.min(axis=0) - MARGIN, points.max(axis=0) + MARGIN
    cell = max(CELL, float(np.sqrt(np.prod(high - low) / MAX_PIXELS)))
    shape = (int(np.ceil((high - low)[1] / cell)), int(np.ceil((high - low)[0] / cell)))
    ends = [turned(np.array([way.start, way.end]), -yaw) for way in parts.ways if way.kind != "window"]
    solid = _filled(walls, yaw, low, cell, shape)
    labels = np.zeros(shape, dtype=np.int32)
    for number, room in enumerate(_apart(parts.rooms, walls), start=1):
        labels[_filled(room.area, yaw, low, cell, shape) & ~solid] = number
    inside = labels > 0
    outside = ~(inside | solid) if labels.any() else outside_of(~solid, cell)
    free = (inside if labels.any() else ~outside) & ~solid
    doors = tuple(((float(a[0]), float(a[1])), (float(b[0]), float(b[1]))) for a, b in ends)
    picture = Picture(free, ~free & ~outside, outside, cell, float(low[0]), float(low[1]), yaw, doors, 1.0, True)
    picture = replace(picture, rooms=labels if labels.any() else None)
    questions = []
    if storey is None and len(parts.names) > 1:
        questions.append(f"storey {parts.number} is read: give another one with --storey ({_listed(parts)})")
    skipped = [f"{count} {kind} without an extrusion or faces" for kind, count in sorted(parts.unread.items())]
    return picture, parts.origin, skipped, questions


def _distinct(ways: Sequence[Way]) -> list[Way]:
    """Return the ways without those in the same place: of the leaves of a double wall, and of windows around a door."""
    kept: list[Way] = []
    for way in sorted(ways, key=lambda way: way.kind):  # doors, passages, windows
        if all(math.dist(way.middle, other.middle) > SAME_PLACE * max(way.width, other.width) for other in kept):
            kept.append(way)
    return kept


def _top(walls: Sequence[Wall], way: Way) -> float | None:
    """Return the height of the highest wall that holds a way, None if no wall that is read holds it."""
    from shapely import LineString

    line = LineString((way.start, way.end))
    return max((wall.height for wall in walls if grown(wall.area, OFF_WALL_M).contains(line)), default=None)


def _apart(among: Sequence[Room], walls: Geometry) -> list[Room]:
    """Return the rooms without their walls; rooms that no wall divides are one, with the name of the largest."""
    rooms = [replace(room, area=area) for room in among for area in polygons(difference(room.area, walls))]
    joined = []
    for area in polygons(grown(grown(union(room.area for room in rooms), TOUCHING), -TOUCHING)):
        within = [room for room in rooms if area.contains(room.area.representative_point())]
        if area.area >= LEAST_AREA and within:
            largest = max(within, key=lambda room: room.area.area)
            joined.append(replace(largest, area=area.simplify(SAME)))
    return joined


def _name(path: Path, parts: Storey) -> str:
    name = parts.names[parts.number - 1] if len(parts.names) > 1 else ""
    return f"{path.stem} {name}".strip()


def _listed(parts: Storey) -> str:
    return ", ".join(f"{number} {name}" for number, name in enumerate(parts.names[:20], start=1))


def _strips(area: Polygon, height: float, path: Path) -> list[Strip]:
    """Return the footprint of a wall as strips: one, or up to `MOST_PIECES` of a wall with corners.

    Raises:
        DocumentError: it is too thick, or not made of a few rectangles.
    """
    box = area.minimum_rotated_rectangle
    mitred = len(area.simplify(SAME).exterior.coords) == 5
    if box.geom_type == "Polygon" and area.area >= (MITRED if mitred else RECTANGULAR) * box.area:
        return [_strip(np.array(box.exterior.coords)[:4], height, path)]
    try:
        frame, rectangles = region_of(area)
    except OptionError:
        rectangles = ()
    if not 0 < len(rectangles) <= MOST_PIECES:
        x, y = area.representative_point().coords[0]
        raise DocumentError(path, "walls", f"the wall at ({x:.2f}, {y:.2f}) m is not straight")
    corners = [to_world([(r.x0, r.y0), (r.x1, r.y0), (r.x1, r.y1), (r.x0, r.y1)], frame) for r in rectangles]
    return [_strip(each, height, path) for each in corners]


def _strip(corners: Array, height: float, path: Path) -> Strip:
    """Return a rectangle (4, 2) as a strip."""
    if np.hypot(*(corners[1] - corners[0])) < np.hypot(*(corners[2] - corners[1])):
        corners = np.roll(corners, -1, axis=0)
    start, end = (corners[0] + corners[3]) / 2.0, (corners[1] + corners[2]) / 2.0
    thickness = float(np.hypot(*(corners[3] - corners[0])))
    if not THICKNESS[0] <= thickness <= THICKNESS[1]:
        limits = f"{THICKNESS[0]:g} to {THICKNESS[1]:g} m"
        raise DocumentError(path, "walls", f"a wall is {thickness:.2f} m thick, not {limits}")
    ends = [(tidy(float(x)), tidy(float(y))) for x, y in (start, end)]
    return Strip(ends[0], ends[1], tidy(thickness), tidy(min(max(height, 2.2), 10.0)))


def _mark(way: Way, top: float) -> Mark:
    """Return the opening of a way in a wall of a height, meters."""
    fields: dict[str, Any] = {"height": tidy(min(way.height, top - way.sill))}
    if way.kind == "window":
        return Mark(way.start, way.end, "window", fields=fields | {"sill": tidy(way.sill)})
    hinge = way.hinge or way.start
    toward = (hinge[0] + way.across[0], hinge[1] + way.across[1])
    return Mark(way.start, way.end, "door" if way.kind == "door" else "passage", hinge, toward, fields)


def _names(rooms: Sequence[Room]) -> list[str]:
    """Return an identifier for each room, from its name."""
    names: list[str] = []
    for number, room in enumerate(rooms, start=1):
        name = re.sub(r"[^A-Za-z0-9_.-]", "_", room.name)[:60]
        fits = re.match(IDENTIFIER, name) is not None and name not in names and name != "outside"
        names.append(name if fits else f"room_{number}")
    return names


def _use(text: str) -> str:
    found = (use for use, words in USES.items() if re.search(words, text, re.IGNORECASE))
    return next(found, "laboratory")


def _rings(part: Polygon) -> Iterator[Array]:
    for ring in (part.exterior, *part.interiors):
        yield np.array([point[:2] for point in ring.coords])


def _filled(area: Geometry, yaw: float, low: Array, cell: float, shape: tuple[int, int]) -> Mask:
    """Return the cells that an area covers in the turned frame."""
    image = np.zeros(shape, dtype=np.uint8)
    for part in polygons(grown(area, 1e-4)):
        pixels = [np.round(((turned(ring, -yaw) - low) / cell - 0.5) * 16.0).astype(np.int32) for ring in _rings(part)]
        layer = np.zeros(shape, dtype=np.uint8)
        cv2.fillPoly(layer, [each.reshape(-1, 1, 2) for each in pixels], 1, shift=4)
        image |= layer
    return image > 0
