"""Floors from the parts of a drawing: strips of wall, marks of openings, outlines and tags of spaces."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from pydantic import ValidationError

from labgym.documents import document_error
from labgym.errors import DocumentError, OptionError
from labgym.exchange.drawing import Drawing, Tag
from labgym.exchange.regions import region_of
from labgym.exchange.strips import Point, around, tidy_point
from labgym.exchange.structure import outline
from labgym.exchange.structure import polygon as footprint
from labgym.exchange.wall_lines import FRAME, TOUCHING, add_opening, wall_lines, walls_on
from labgym.geometry.frames import compose
from labgym.geometry.polygons import difference, grown, largest, polygons, union
from labgym.layouts.floor import Column, Floor, KeepOut, Opening, Rectangle, Service, Space, Wall
from labgym.layouts.floor.changes import closed_doors, walls_with
from labgym.layouts.floor.rooms import Room, rectangle_parts
from labgym.layouts.floor.walls import extensions

if TYPE_CHECKING:
    from shapely import MultiPolygon, Polygon
if TYPE_CHECKING:
    from shapely import Polygon


LEAST_AREA = 1.0
"""Area of the smallest enclosed space, square meters."""
LIMITS = {"walls": 1000, "openings": 500, "outlines": 200}
"""Largest numbers of parts of a floor."""
FARTHEST = 100.0
"""Largest coordinate of walls and spaces, meters."""


def squared(walls: Sequence[Wall], spaces: Sequence[Space]) -> tuple[list[Wall], list[Space]]:
    """Return the four walls of one rectangular space cut to its corners, other walls as they are."""
    plain = (list(walls), list(spaces))
    if len(spaces) != 1 or len(spaces[0].region) != 1 or len(walls) != 4:
        return plain
    space = spaces[0]
    if max(abs(space.x), abs(space.y), abs(space.yaw)) > 1e-6 or len({wall.thickness for wall in walls}) != 1:
        return plain
    corner: Rectangle = space.region[0]
    try:
        room = Room(width=corner.x1, depth=corner.y1, wall_thickness=walls[0].thickness, height=space.ceiling, doors=())
    except ValidationError:
        return plain
    sides, square = rectangle_parts(room)
    cut: list[Wall] = []
    for side in sides:
        for wall in walls:
            ends = [_off(side, wall.start), _off(side, wall.end)]
            if max(ends) <= FRAME and abs(wall.height - space.ceiling) < 1e-6:
                cut.append(_projected(wall, side))
                break
        else:
            return plain
    return cut, [space.model_copy(update={"x": 0.0, "y": 0.0, "yaw": 0.0, "region": square.region})]


def _off(side: Wall, point: Point) -> float:
    """Return the distance of a point from the middle line of a side."""
    (x0, y0), (x1, y1) = side.start, side.end
    return abs((x1 - x0) * (point[1] - y0) - (y1 - y0) * (point[0] - x0)) / side.length


def _projected(wall: Wall, side: Wall) -> Wall:
    """Return the wall of a side with the openings of a drawn wall."""
    forward = math.cos(wall.yaw - side.yaw) > 0.0
    openings = []
    for opening in wall.openings:
        x, y = wall.point(opening.position)
        position = (x - side.start[0]) * math.cos(side.yaw) + (y - side.start[1]) * math.sin(side.yaw)
        changes: dict[str, Any] = {"position": round(position, 6)}
        if not forward:
            changes["hinge"] = "end" if opening.hinge == "start" else "start"
            changes["swing"] = "right" if opening.swing == "left" else "left"
        openings.append(Opening(**{**{name: getattr(opening, name) for name in Opening.model_fields}, **changes}))
    return Wall(start=side.start, end=side.end, thickness=wall.thickness, height=wall.height, openings=tuple(openings))


def enclosed(walls: Sequence[Wall]) -> list[Polygon]:
    """Return the areas that walls with closed openings enclose, largest first."""
    from shapely import Polygon

    boxes = [
        wall.piece(-before, wall.length + after, 0.0, wall.height)
        for wall, (before, after) in zip(walls, extensions(walls), strict=True)
    ]
    solid = grown(union(footprint(box) for box in boxes), TOUCHING)
    areas = [
        largest(grown(Polygon(ring), TOUCHING).simplify(1e-3)) for part in polygons(solid) for ring in part.interiors
    ]
    return sorted((area for area in areas if area.area >= LEAST_AREA), key=lambda area: -area.area)


def nested(rings: Sequence[tuple[Point, ...]]) -> list[Polygon]:
    """Return polygons from rings; a ring inside another is a hole of it, one inside a hole is a polygon again."""
    from shapely import Polygon

    parts = [part for ring in rings if len(ring) >= 3 for part in polygons(Polygon(ring))]
    parts.sort(key=lambda part: -part.area)
    outer: dict[int, Polygon | MultiPolygon] = {}
    for index, part in enumerate(parts):
        enclosing = [other for other in range(index) if parts[other].contains(part.representative_point())]
        if len(enclosing) % 2 and enclosing[-1] in outer:
            outer[enclosing[-1]] = difference(outer[enclosing[-1]], part)
        else:
            outer[index] = part
    return [part for area in outer.values() for part in polygons(area) if part.area >= LEAST_AREA]


def corners(polygon: Polygon) -> list[Point]:
    """Return the corners of a polygon, counter-clockwise."""
    from shapely.geometry.polygon import orient

    return [(x, y) for x, y, *_ in orient(largest(polygon.simplify(1e-3))).exterior.coords[:-1]]


def assemble(drawing: Drawing, source: object, name: str = "drawing", thickness: float = 0.2) -> Floor:
    """Return the floor that a drawing describes.

    Args:
        source: the file, for messages.
        name: label of the floor.
        thickness: of the walls around the outlines if the drawing has no walls, meters.

    Raises:
        DocumentError: the drawing has no walls and no outlines, an opening lies in no wall, or the parts form no floor.
    """
    for what, count in (("walls", drawing.strips), ("openings", drawing.marks), ("outlines", drawing.outlines)):
        if len(count) > LIMITS[what]:
            raise DocumentError(source, what, f"{len(count)} {what}; at most {LIMITS[what]} are read: split the floor")
    whole, here = drawing, (0, 0)
    if not drawing.placed and max(map(abs, drawing.bounds())) > FARTHEST:  # coordinates of a site or a national grid
        here = _corner(drawing, source)
        drawing = drawing.moved(-here[0], -here[1])
    polygons = nested(drawing.outlines)
    strips = drawing.strips or [strip for polygon in polygons for strip in around(corners(polygon), thickness)]
    if not strips:
        raise DocumentError(
            source, "walls", "no wall and no outline of a room: see docs/engineers.md for the names of layers"
        )
    try:
        lines = wall_lines(strips)
        for alternatives in drawing.marks:
            add_opening(lines, alternatives)
        walls = [wall for line in lines for wall in walls_on(line)]
        if not polygons:
            polygons = enclosed(walls)
        if not polygons:
            doors = "" if drawing.marks else "no door was read, and "
            raise OptionError(
                f"{doors}the walls enclose no space: close the gaps between them, or draw the outlines of rooms"
            )
        spaces = _spaces(polygons, drawing.tags, max(wall.height for wall in walls))
        floor_parts: dict[str, Any] = {
            "columns": tuple(Column(**each) for each in drawing.columns),
            "services": tuple(Service(**each) for each in drawing.services),
            "keep_outs": tuple(KeepOut(**each) for each in drawing.keep_outs),
        }
        if not drawing.placed:
            dx, dy = _to_origin(spaces)
            walls, spaces, floor_parts = _shifted(walls, spaces, floor_parts, dx, dy)
            whole.shift = dx - here[0], dy - here[1]
            drawing.origin = compose(drawing.origin, (-whole.shift[0], -whole.shift[1], 0.0))
        walls, spaces = squared(walls, spaces)
        floor_parts |= {"name": name[:80], "spaces": tuple(spaces), "origin": drawing.origin}
        floor = Floor(walls=tuple(walls), **floor_parts)
        closed = () if drawing.placed else closed_doors(floor)
        return Floor(walls=walls_with(floor, closed, state="open"), **floor_parts) if closed else floor
    except ValidationError as error:
        raise document_error(source, error) from None
    except OptionError as error:
        origin = f"; coordinates count from ({here[0]}, {here[1]}) m of the drawing" if here != (0, 0) else ""
        raise DocumentError(source, "", f"{error}{origin}") from None


def _corner(drawing: Drawing, source: object) -> tuple[int, int]:
    """Return the lower left corner of a drawing, rounded down to meters.

    Raises:
        DocumentError: the drawing is too large for a floor.
    """
    x0, y0, x1, y1 = drawing.bounds()
    if max(x1 - x0, y1 - y0) > FARTHEST:
        size = f"{x1 - x0:.0f} x {y1 - y0:.0f} m"
        problem = (
            f"walls and outlines cover {size}, over {FARTHEST:g} m: check the unit of the drawing, or draw one floor"
        )
        raise DocumentError(source, "", problem)
    return math.floor(x0), math.floor(y0)


def _spaces(polygons: Sequence[Polygon], tags: Sequence[Tag], ceiling: float) -> list[Space]:
    from shapely import Point as ShapelyPoint

    spaces: list[Space] = []
    for number, polygon in enumerate(polygons, start=1):
        tag = next((tag for tag in tags if polygon.contains(ShapelyPoint(tag.x, tag.y))), None)
        (x, y, yaw), region = region_of(polygon, None if tag is None else tag.yaw)
        fields: dict[str, Any] = {"id": "laboratory" if len(polygons) == 1 else f"space_{number}", "ceiling": ceiling}
        fields |= {} if tag is None else tag.fields
        spaces.append(Space(**fields, x=x, y=y, yaw=yaw, region=region))
    return spaces


def _to_origin(spaces: Sequence[Space]) -> Point:
    """Return the shift that brings the lower left corner of some spaces to the origin."""
    bounds = [outline(space).bounds for space in spaces]
    return -min(each[0] for each in bounds), -min(each[1] for each in bounds)


def _shifted(
    walls: Sequence[Wall], spaces: Sequence[Space], others: dict[str, Any], dx: float, dy: float
) -> tuple[list[Wall], list[Space], dict[str, Any]]:
    """Return the parts of a floor moved by a distance."""

    def moved(point: Point) -> Point:
        return tidy_point((point[0] + dx, point[1] + dy))

    def shifted(record: Any) -> Any:
        x, y = moved((record.x, record.y))
        return record.model_copy(update={"x": x, "y": y})

    return (
        [wall.model_copy(update={"start": moved(wall.start), "end": moved(wall.end)}) for wall in walls],
        [shifted(space) for space in spaces],
        {name: tuple(map(shifted, records)) for name, records in others.items()},
    )
