"""Floors from the parts of a drawing: strips of wall, marks of openings, outlines and tags of spaces."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from pydantic import ValidationError

from labgym.documents import document_error
from labgym.errors import DocumentError, OptionError
from labgym.exchange.areas import corners, enclosed, nested
from labgym.exchange.drawing import Drawing, Tag
from labgym.exchange.regions import region_of
from labgym.exchange.rounding import tidy_point
from labgym.exchange.squaring import squared
from labgym.exchange.strips import Point, around
from labgym.exchange.structure import outline
from labgym.exchange.wall_lines import add_opening, wall_lines, walls_on
from labgym.layouts.floor import Column, Floor, KeepOut, Service, Space, Wall
from labgym.layouts.floor.changes import closed_doors, walls_with

if TYPE_CHECKING:
    from shapely import Polygon

LIMITS = {"walls": 1000, "openings": 500, "outlines": 200}
"""Largest numbers of parts of a floor."""
FARTHEST = 100.0
"""Largest coordinate of walls and spaces, meters."""


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
        walls, spaces = squared(walls, spaces)
        floor_parts |= {"name": name[:80], "spaces": tuple(spaces)}
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
