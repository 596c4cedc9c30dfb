"""Reads floors from building models: exactly, or as a picture from which a floor is recognized."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np

from labgym.errors import DocumentError
from labgym.exchange.assembly import assemble
from labgym.exchange.drawing import Drawing, Mark, Tag
from labgym.exchange.ifc.storeys import Room, Storey, Way, read_storey
from labgym.exchange.recognition.picture import MAX_PIXELS, Array, Mask, Picture, main_direction, turned
from labgym.exchange.recognition.plans import CELL, MARGIN, outside_of, spread
from labgym.exchange.strips import Strip, tidy
from labgym.geometry.frames import PlanarPose
from labgym.geometry.polygons import grown, polygons, union
from labgym.layouts.floor import Floor
from labgym.layouts.floor.fields import IDENTIFIER

if TYPE_CHECKING:
    from shapely import Geometry, Polygon

RECTANGULAR = 0.9
"""Least share of its smallest rectangle that the footprint of a wall covers to be read exactly."""
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
        drawing.strips += [_strip(piece, wall.height, path) for piece in polygons(wall.area)]
    drawing.marks = [[_mark(way)] for way in parts.ways]
    names = _names(parts.rooms)
    for room, name in zip(parts.rooms, names, strict=True):
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
    inside = _filled(rooms, yaw, low, cell, shape)
    outside = outside_of(~solid, cell) if rooms.is_empty else ~(inside | solid)
    free = (inside if rooms.area > 0.0 else ~outside) & ~solid
    doors = tuple(((float(a[0]), float(a[1])), (float(b[0]), float(b[1]))) for a, b in ends)
    picture = Picture(free, ~free & ~outside, outside, cell, float(low[0]), float(low[1]), yaw, doors, 1.0, True)
    questions = []
    if storey is None and len(parts.names) > 1:
        questions.append(f"storey {parts.number} is read: give another one with --storey ({_listed(parts)})")
    skipped = [f"{count} {kind} without an extrusion or faces" for kind, count in sorted(parts.unread.items())]
    return picture, parts.origin, skipped, questions


def _name(path: Path, parts: Storey) -> str:
    name = parts.names[parts.number - 1] if len(parts.names) > 1 else ""
    return f"{path.stem} {name}".strip()


def _listed(parts: Storey) -> str:
    return ", ".join(f"{number} {name}" for number, name in enumerate(parts.names[:20], start=1))


def _strip(area: Polygon, height: float, path: Path) -> Strip:
    """Return the footprint of a wall as a strip.

    Raises:
        DocumentError: it is no rectangle.
    """
    box = area.minimum_rotated_rectangle
    if box.geom_type != "Polygon" or area.area < RECTANGULAR * box.area:
        x, y = area.representative_point().coords[0]
        raise DocumentError(path, "walls", f"the wall at ({x:.2f}, {y:.2f}) m is not straight")
    corners = np.array(box.exterior.coords)[:4]
    if np.hypot(*(corners[1] - corners[0])) < np.hypot(*(corners[2] - corners[1])):
        corners = np.roll(corners, -1, axis=0)
    start, end = (corners[0] + corners[3]) / 2.0, (corners[1] + corners[2]) / 2.0
    thickness = float(np.hypot(*(corners[3] - corners[0])))
    if not THICKNESS[0] <= thickness <= THICKNESS[1]:
        raise DocumentError(
            path, "walls", f"a wall is {thickness:.2f} m thick, not {THICKNESS[0]:g} to {THICKNESS[1]:g} m"
        )
    ends = [(tidy(float(x)), tidy(float(y))) for x, y in (start, end)]
    return Strip(ends[0], ends[1], tidy(thickness), tidy(min(max(height, 2.2), 10.0)))


def _mark(way: Way) -> Mark:
    fields: dict[str, Any] = {"height": tidy(way.height)}
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
