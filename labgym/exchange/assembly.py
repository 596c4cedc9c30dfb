"""Floors from the parts of a drawing: strips of wall, marks of openings, outlines and tags of spaces."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

from pydantic import ValidationError

from labgym.documents import document_error
from labgym.errors import DocumentError, OptionError
from labgym.exchange.regions import region_of
from labgym.exchange.strips import Point, Strip, around
from labgym.layouts.floor import Column, Floor, KeepOut, Opening, Rectangle, Service, Space, Wall
from labgym.layouts.floor.joints import extensions
from labgym.layouts.floor.rectangles import rectangle_parts
from labgym.layouts.floor.rooms import Room

if TYPE_CHECKING:
    from shapely import Polygon

HEIGHT, DOOR_HEIGHT = 3.0, 2.1
"""Heights of walls and doors if the drawing is flat, meters."""
ALIGNED = 5e-3
"""Largest distance of a strip from the line of a wall that it continues, meters."""
PARALLEL = 0.01
TOUCHING = 5e-3
"""Longest gap between strips that are one wall, meters."""
FRAME = 0.12
"""Longest gap between an opening and the wall next to it, the space of a frame, meters."""
LEAST_AREA = 1.0
"""Area of the smallest enclosed space, square meters."""
LIMITS = {"walls": 1000, "openings": 500, "outlines": 200}
"""Largest numbers of parts of a floor."""


@dataclass(frozen=True)
class Mark:
    """An opening in a drawing: the ends of the opening, on or near its wall, in meters.

    Attributes:
        hinge: end of the opening at which the leaf turns; None without a leaf.
        toward: a point on the side to which the leaf opens.
        fields: further fields of `Opening`.
    """

    start: Point
    end: Point
    kind: Literal["door", "passage", "window", "glazing"] = "door"
    hinge: Point | None = None
    toward: Point | None = None
    fields: dict[str, Any] = field(default_factory=dict)

    @property
    def width(self) -> float:
        """Width of the opening, meters."""
        return math.dist(self.start, self.end)


@dataclass(frozen=True)
class Tag:
    """The description of the space around a point of a drawing."""

    x: float
    y: float
    fields: dict[str, Any]
    yaw: float | None = None


@dataclass
class _Line:
    """A straight wall in the making: a frame along its middle line, solid intervals, and openings."""

    origin: Point
    yaw: float
    thickness: float
    height: float
    solid: list[tuple[float, float]]
    marks: list[tuple[float, float, Mark]] = field(default_factory=list)

    def local(self, point: Point) -> Point:
        """Return the distance of a point along the line, and to the left of it."""
        dx, dy = point[0] - self.origin[0], point[1] - self.origin[1]
        cosine, sine = math.cos(self.yaw), math.sin(self.yaw)
        return dx * cosine + dy * sine, dy * cosine - dx * sine

    def world(self, along: float) -> Point:
        """Return the point at a distance along the line."""
        x, y = self.origin
        return x + along * math.cos(self.yaw), y + along * math.sin(self.yaw)


@dataclass(frozen=True)
class Piece:
    """A block of furniture in a drawing: its middle in meters and its yaw.

    Attributes:
        id: empty if the drawing gives none.
        asset: its name.
        named: whether an attribute names the asset; otherwise the block's own name may be one.
    """

    id: str
    asset: str
    x: float
    y: float
    yaw: float
    named: bool


@dataclass
class Drawing:
    """The parts of a floor in a drawing, in meters.

    Attributes:
        marks: openings; of the alternatives of each the first that lies in a wall counts.
        outlines: polygons around spaces, inside their walls; if empty, spaces are what walls enclose.
        placed: whether the drawing's coordinates are those of a floor; otherwise its lower left corner is the origin.
        shift: of the assembled floor's coordinates against the drawing's, meters.
    """

    strips: list[Strip] = field(default_factory=list)
    marks: list[Sequence[Mark]] = field(default_factory=list)
    outlines: list[tuple[Point, ...]] = field(default_factory=list)
    tags: list[Tag] = field(default_factory=list)
    columns: list[dict[str, Any]] = field(default_factory=list)
    services: list[dict[str, Any]] = field(default_factory=list)
    keep_outs: list[dict[str, Any]] = field(default_factory=list)
    furniture: list[Piece] = field(default_factory=list)
    placed: bool = False
    shift: Point = (0.0, 0.0)


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
    polygons = _nested(drawing.outlines)
    strips = drawing.strips or [strip for polygon in polygons for strip in around(_corners(polygon), thickness)]
    if not strips:
        raise DocumentError(
            source, "walls", "no wall and no outline of a room: see docs/engineers.md for the names of layers"
        )
    try:
        lines = _lines(strips)
        for alternatives in drawing.marks:
            _mark(lines, alternatives)
        walls = [wall for line in lines for wall in _walls(line)]
        if not polygons:
            polygons = _enclosed(walls)
        if not polygons:
            raise OptionError("the walls enclose no space: close the gaps between them, or draw the outlines of rooms")
        spaces = _spaces(polygons, drawing.tags, max(wall.height for wall in walls))
        floor_parts: dict[str, Any] = {
            "columns": tuple(Column(**each) for each in drawing.columns),
            "services": tuple(Service(**each) for each in drawing.services),
            "keep_outs": tuple(KeepOut(**each) for each in drawing.keep_outs),
        }
        if not drawing.placed:
            drawing.shift = _to_origin(spaces)
            walls, spaces, floor_parts = _shifted(walls, spaces, floor_parts, *drawing.shift)
        walls, spaces = _squared(walls, spaces)
        return Floor(name=name[:80], walls=tuple(walls), spaces=tuple(spaces), **floor_parts)
    except ValidationError as error:
        raise document_error(source, error) from None
    except OptionError as error:
        raise DocumentError(source, "", str(error)) from None


def _lines(strips: Sequence[Strip]) -> list[_Line]:
    """Return the lines on which strips lie; strips of one thickness on one line share it."""
    lines: list[_Line] = []
    for strip in sorted(strips, key=lambda each: -each.length):
        height = strip.height or HEIGHT
        for line in lines:
            if abs(line.thickness - strip.thickness) > ALIGNED or abs(line.height - height) > ALIGNED:
                continue
            if abs(math.sin(line.yaw - strip.yaw)) > PARALLEL:
                continue
            (a, across), (b, across_end) = line.local(strip.start), line.local(strip.end)
            if max(abs(across), abs(across_end)) <= ALIGNED:
                line.solid.append((min(a, b), max(a, b)))
                break
        else:
            lines.append(_Line(strip.start, strip.yaw, strip.thickness, height, [(0.0, strip.length)]))
    return lines


def _mark(lines: Sequence[_Line], alternatives: Sequence[Mark]) -> None:
    """Add an opening to the wall in which it lies.

    Raises:
        OptionError: it lies in no wall.
    """
    best: tuple[float, _Line, float, float, Mark] | None = None
    for mark in alternatives:
        for line in lines:
            (a, across), (b, across_end) = line.local(mark.start), line.local(mark.end)
            off = max(abs(across), abs(across_end)) - line.thickness / 2.0
            if off > FRAME or abs(across - across_end) > 0.05 * mark.width:
                continue
            low, high = min(a, b), max(a, b)
            if any(start - FRAME <= high and low <= end + FRAME for start, end in line.solid):
                low, high = _snapped(line, low, high)
                if best is None or off < best[0] - 1e-9:
                    best = (off, line, low, high, mark)
    if best is None:
        x, y = alternatives[0].start
        kind = alternatives[0].kind
        raise OptionError(f"the {kind} at ({x:.2f}, {y:.2f}) m lies in no wall: move it onto one, or draw the wall")
    _, line, low, high, mark = best
    line.marks.append((low, high, mark))


def _snapped(line: _Line, low: float, high: float) -> tuple[float, float]:
    """Return an interval extended to the gap between the solid parts around it, if that is as wide as a frame."""
    before = [end for _, end in line.solid if end <= low + FRAME]
    after = [start for start, _ in line.solid if start >= high - FRAME]
    if before and abs(max(before) - low) <= FRAME:
        low = max(before)
    if after and abs(min(after) - high) <= FRAME:
        high = min(after)
    return low, high


def _walls(line: _Line) -> list[Wall]:
    """Return the walls on a line: solid parts and openings without gaps between them."""
    spans = sorted([*line.solid, *((low, high) for low, high, _ in line.marks)])
    chains: list[tuple[float, float]] = []
    for low, high in spans:
        if chains and low <= chains[-1][1] + TOUCHING:
            chains[-1] = (chains[-1][0], max(chains[-1][1], high))
        else:
            chains.append((low, high))
    return [
        Wall(
            start=_tidy(line.world(low)),
            end=_tidy(line.world(high)),
            thickness=round(line.thickness, 6),
            height=round(line.height, 6),
            openings=tuple(
                _opening(line, mark, a - low, b - low) for a, b, mark in line.marks if low <= (a + b) / 2.0 <= high
            ),
        )
        for low, high in chains
    ]


def _opening(line: _Line, mark: Mark, low: float, high: float) -> Opening:
    fields: dict[str, Any] = {"kind": mark.kind, "position": round((low + high) / 2.0, 6)}
    fields |= {"width": round(high - low, 6), "height": DOOR_HEIGHT, **mark.fields}
    if mark.hinge is not None:
        ends = line.local(mark.start)[0], line.local(mark.end)[0]
        fields["hinge"] = "start" if abs(line.local(mark.hinge)[0] - min(ends)) < mark.width / 2.0 else "end"
    if mark.toward is not None:
        fields["swing"] = "left" if line.local(mark.toward)[1] > 0.0 else "right"
    return Opening(**fields)


def _enclosed(walls: Sequence[Wall]) -> list[Polygon]:
    """Return the areas that walls with closed openings enclose, largest first."""
    from shapely import Polygon, union_all

    boxes = [
        wall.piece(-before, wall.length + after, 0.0, wall.height)
        for wall, (before, after) in zip(walls, extensions(walls), strict=True)
    ]
    solid = union_all([Polygon(box.corners()) for box in boxes]).buffer(TOUCHING, join_style="mitre")
    areas = [
        Polygon(ring).buffer(TOUCHING, join_style="mitre").simplify(1e-3)
        for part in getattr(solid, "geoms", [solid])
        for ring in part.interiors
    ]
    return sorted((area for area in areas if area.area >= LEAST_AREA), key=lambda area: -area.area)


def _nested(rings: Sequence[tuple[Point, ...]]) -> list[Polygon]:
    """Return polygons from rings; a ring inside another is a hole of it, one inside a hole is a polygon again."""
    from shapely import Polygon

    polygons = sorted((Polygon(ring) for ring in rings if len(ring) >= 3), key=lambda each: -each.area)
    polygons = [polygon if polygon.is_valid else polygon.buffer(0.0) for polygon in polygons]
    polygons = [polygon for polygon in polygons if polygon.geom_type == "Polygon" and polygon.area > 0.0]
    nested: list[Polygon] = []
    owners: list[int] = []
    for index, polygon in enumerate(polygons):
        around = [other for other in range(index) if polygons[other].contains(polygon.representative_point())]
        if len(around) % 2 and around[-1] in owners:
            place = owners.index(around[-1])
            nested[place] = nested[place].difference(polygon)
        else:
            nested.append(polygon)
            owners.append(index)
    return [polygon for polygon in nested if polygon.area >= LEAST_AREA]


def _corners(polygon: Polygon) -> list[Point]:
    """Return the corners of a polygon, counter-clockwise."""
    from shapely.geometry.polygon import orient

    return [(x, y) for x, y, *_ in orient(polygon.simplify(1e-3)).exterior.coords[:-1]]


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
    from labgym.exchange.structure import outline

    bounds = [outline(space).bounds for space in spaces]
    return -min(each[0] for each in bounds), -min(each[1] for each in bounds)


def _shifted(
    walls: Sequence[Wall], spaces: Sequence[Space], others: dict[str, Any], dx: float, dy: float
) -> tuple[list[Wall], list[Space], dict[str, Any]]:
    """Return the parts of a floor moved by a distance."""

    def moved(point: Point) -> Point:
        return _tidy((point[0] + dx, point[1] + dy))

    def shifted(record: Any) -> Any:
        x, y = moved((record.x, record.y))
        return record.model_copy(update={"x": x, "y": y})

    return (
        [wall.model_copy(update={"start": moved(wall.start), "end": moved(wall.end)}) for wall in walls],
        [shifted(space) for space in spaces],
        {name: tuple(map(shifted, records)) for name, records in others.items()},
    )


def _squared(walls: Sequence[Wall], spaces: Sequence[Space]) -> tuple[list[Wall], list[Space]]:
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


def _tidy(point: Point) -> Point:
    """Return a point rounded to a micrometer, without negative zeros."""
    return round(point[0], 6) + 0.0, round(point[1], 6) + 0.0
