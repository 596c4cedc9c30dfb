"""Reads floors from DXF drawings: walls, doors, windows, columns and outlines of rooms by layer or block."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import ValidationError

from labgym.assets import Catalog
from labgym.documents import document_error
from labgym.errors import DocumentError, LabgymError, OptionError, UnknownNameError
from labgym.exchange.assembly import assemble
from labgym.exchange.drawing import Drawing, Mark, Piece, Tag
from labgym.exchange.dxf import blocks, layers
from labgym.exchange.dxf.arcs import SAGITTA, Arc, curved_walls, flattened
from labgym.exchange.dxf.opening import (
    FARTHEST,
    FAULTS,
    Context,
    block_name,
    dxf_errors,
    entities,
    meters_per_unit,
    nothing_read,
    open_drawing,
    placed_at,
)
from labgym.exchange.dxf.sheets import Window, advice, drawings
from labgym.exchange.strips import THICKNESS, Point, Stroke, strips
from labgym.geometry.frames import PlanarPose, relative
from labgym.layouts import Placement
from labgym.layouts.floor import Floor
from labgym.layouts.placement import FLOOR, WALL

if TYPE_CHECKING:
    from ezdxf.entities.dxfentity import DXFEntity
    from ezdxf.entities.insert import Insert

FLAT = 1e-6
"""Largest bulge of a straight segment of a polyline."""
OUTLINE_SAGITTA = 0.004
"""Greatest distance of the arcs in outlines of rooms from their chords, meters: less than of those of walls."""
LONGEST = 1000.0
"""Largest radius of an arc, meters."""
WALL_THICKNESS = 0.2
NOTHING_INSIDE = "no wall and no outline of a room inside the window of --crop: give it in units of the drawing"


def read_dxf(
    path: str | Path,
    unit: str | None = None,
    thickness: float = WALL_THICKNESS,
    window: Window | None = None,
) -> Floor:
    """Read the floor of a DXF drawing.

    Layers count by their names, in `labgym.exchange.dxf.layers`: those of the U.S. National CAD Standard, and others
    that contain a word such as WALL, DOOR, WINDOW or ROOM, also in German, French, Spanish and Chinese. Walls are
    closed rectangles, polylines with a width, or pairs of parallel lines; without these and without outlines of
    rooms, the boundaries of hatches. Doors are blocks or drawings with an arc around the hinge. Windows and passages
    are blocks or closed rectangles in the wall. Outlines of rooms are closed polylines inside the walls; without
    outlines the rooms are what the walls enclose, without walls each outline gets walls around it. Drawings that
    labgym wrote keep their coordinates; of others the lower left corner is the origin.

    Args:
        unit: in, ft, mm, cm, dm or m; by default the drawing's $INSUNITS.
        thickness: of walls that are not drawn, meters.
        window: the part of the sheet that is read, such as the plan next to an elevation; None for all of it.

    Raises:
        DocumentError: the file is no DXF text, too large, refers to other files, or describes no floor.
        OptionError: the unit is unknown, or the thickness is out of range.
        MissingDependencyError: ezdxf is not installed.
    """
    return _read(Path(path), unit, thickness, window)[0]


def read_furniture(path: str | Path, catalog: Catalog, unit: str | None = None) -> list[Placement]:
    """Return the furniture of a DXF drawing, in the frame of the floor that `read_dxf` reads from it.

    A block is a piece of furniture if it has the attribute ASSET, or if its name is an asset's on a layer of furniture;
    its middle is the piece's, and its y axis points to the piece's front.

    Raises:
        DocumentError: as `read_dxf`, or an attribute names no asset.
        OptionError, MissingDependencyError: as `read_dxf`.
    """
    _, parts = _read(Path(path), unit, WALL_THICKNESS)
    pieces: list[Placement] = []
    for number, piece in enumerate(parts.furniture, start=1):
        try:
            asset = catalog.find(piece.asset)
        except UnknownNameError as error:
            if piece.named:
                raise DocumentError(path, f"block {piece.asset[:40]!r}", str(error)) from None
            continue
        if asset.placing not in ("floor", "wall"):
            continue
        x, y = piece.x + parts.shift[0], piece.y + parts.shift[1]
        wall = asset.placing == "wall"
        try:
            pieces.append(
                Placement(
                    id=piece.id or f"{asset.name}_fixed_{number}",
                    asset=asset.name,
                    position=(round(x, 6), round(y, 6), asset.mount_height if wall else 0.0),
                    yaw=math.remainder(piece.yaw, 2.0 * math.pi),
                    support=WALL if wall else FLOOR,
                )
            )
        except ValidationError as error:
            raise document_error(f"{path}: block {piece.asset[:40]!r}", error) from None
    return pieces


def _read(path: Path, unit: str | None, thickness: float, window: Window | None = None) -> tuple[Floor, Drawing]:
    """Return the floor of a drawing, and the parts from which it is assembled."""
    if not 0.05 <= thickness <= 1.0:
        raise OptionError(f"wall thickness {thickness:g} m must be 0.05 to 1 m")
    drawing = open_drawing(path)
    scale = meters_per_unit(drawing, path, unit)
    collector = _Collector(scale, placed_at(drawing, path))
    try:
        for context, entity in entities(drawing, path):
            if window is None or window.contains(entity):
                collector.add(context, entity)
        drawn = [*collector.walls, *curved_walls(collector.arcs)]
        if not drawn and not collector.drawing.outlines:
            drawn = collector.hatches
        walls = strips(drawn, oriented=collector.drawing.placed)
        if not walls and not collector.drawing.outlines:
            raise DocumentError(path, "walls", nothing_read(drawing, scale) if window is None else NOTHING_INSIDE)
    except OptionError as error:
        raise DocumentError(path, "", f"{error}{collector.advice()}") from None
    except LabgymError:
        raise
    except FAULTS + dxf_errors() as error:
        raise DocumentError(path, "", f"a damaged DXF drawing ({type(error).__name__})") from None
    parts = collector.drawing
    parts.strips = walls
    try:
        return assemble(parts, path, path.stem or "drawing", thickness), parts
    except DocumentError as error:
        problem = str(error).removeprefix(f"{path}: ")
        raise DocumentError(path, "", f"{problem}{collector.advice()}") from None


class _Collector:
    """Sorts the entities of a drawing into the parts of a floor.

    Args:
        scale: meters per unit. origin: pose of the floor's frame in the drawing's, meters and radians.
    """

    def __init__(self, scale: float, origin: PlanarPose) -> None:
        self.scale, self.origin = scale, origin
        self.walls: list[Stroke] = []
        self.arcs: list[tuple[Arc, float]] = []
        self.hatches: list[Stroke] = []
        self.drawing = Drawing(origin=origin)

    def advice(self) -> str:
        """Return the end of a message if the sheet has several drawings."""
        strokes = [stroke.points for stroke in self.walls] + list(self.drawing.outlines)
        return advice(drawings(strokes, self.scale))

    def add(self, context: Context, entity: DXFEntity) -> None:
        """Add an entity that is drawn in a context of layers and blocks."""
        if any(name in blocks.ATTRIBUTES for name in context.blocks):
            return  # read with its block
        role = layers.role(context.layers, context.blocks)
        if entity.dxftype() == "INSERT":
            self._add_block(entity)  # type: ignore[arg-type]
            self._add_furniture(entity, role == layers.FURNITURE)  # type: ignore[arg-type]
            return
        if role == layers.SERVICES and entity.dxftype() in ("POINT", "CIRCLE"):
            self._add_service(context, entity)
            return
        if role == layers.DOORS and entity.dxftype() == "ARC":
            self.drawing.marks.append(self._door(entity))
        elif role in (layers.WALLS, layers.WALL_FILL) and entity.dxftype() == "HATCH":
            self._add_hatch(entity)
        elif role in (layers.WALLS, layers.SPACES, layers.WINDOWS, layers.COLUMNS, layers.KEEP_OUTS):
            stroke = self._stroke(entity, role)
            if stroke is not None:
                self._add_stroke(role, stroke)

    def _add_stroke(self, role: str | None, stroke: Stroke) -> None:
        if role == layers.WALLS:
            self.walls.append(stroke)
        elif role == layers.SPACES and stroke.closed:
            self.drawing.outlines.append(stroke.points)
        elif stroke.closed and len(stroke.points) == 4:
            box = strips([stroke])
            if role == layers.WINDOWS and box:
                self.drawing.marks.append([Mark(box[0].start, box[0].end, "window", fields=WINDOW_FIELDS)])
            elif role == layers.COLUMNS:
                self.drawing.columns.append({"id": f"column_{len(self.drawing.columns) + 1}", **_extent(stroke.points)})
            elif role == layers.KEEP_OUTS:
                number = f"keep_out_{len(self.drawing.keep_outs) + 1}"
                self.drawing.keep_outs.append({"id": number, **_extent(stroke.points)})

    def _add_service(self, context: Context, entity: Any) -> None:
        """Add a point or a circle on a layer that names a kind of service."""
        kind = layers.service_kind(context.layers)
        if kind is not None:
            place = entity.dxf.location if entity.dxftype() == "POINT" else entity.ocs().to_wcs(entity.dxf.center)
            x, y = self._point(place)
            self.drawing.services.append({"kind": kind, "x": x, "y": y})

    def _add_furniture(self, insert: Insert, furniture: bool) -> None:
        """Add a block that may be a piece of furniture."""
        values = {attribute.dxf.tag: str(attribute.dxf.text) for attribute in insert.attribs}
        name = values.get("ASSET") or (block_name(insert) if furniture else "")
        if name:
            x, y = self._point(insert.dxf.insert)
            yaw = math.radians(insert.dxf.get("rotation", 0.0)) - self.origin[2]
            yaw += math.pi if insert.dxf.get("yscale", 1.0) < 0.0 else 0.0  # a mirror image looks the other way
            piece = Piece(values.get("ID", ""), name, x, y, yaw, named="ASSET" in values)
            self.drawing.furniture.append(piece)

    def _add_block(self, insert: Insert) -> None:
        """Add a block of labgym with its attributes; other blocks count by their content."""
        name = block_name(insert)
        if name not in blocks.ATTRIBUTES:
            return
        values = {attribute.dxf.tag: str(attribute.dxf.text) for attribute in insert.attribs}
        x, y = self._point(insert.dxf.insert)
        yaw = math.radians(insert.dxf.get("rotation", 0.0)) - self.origin[2]
        width, depth = (abs(insert.dxf.get(axis, 1.0)) * self.scale for axis in ("xscale", "yscale"))
        if name in (blocks.DOOR_LEFT, blocks.DOOR_RIGHT):
            side = 1.0 if name == blocks.DOOR_LEFT else -1.0
            end = (x + width * math.cos(yaw), y + width * math.sin(yaw))
            toward = (x - side * width * math.sin(yaw), y + side * width * math.cos(yaw))
            self.drawing.marks.append([Mark((x, y), end, "door", (x, y), toward, _opening_fields(values))])
        elif name in (blocks.WINDOW, blocks.GLAZING, blocks.PASSAGE):
            dx, dy = width / 2.0 * math.cos(yaw), width / 2.0 * math.sin(yaw)
            kind = {blocks.WINDOW: "window", blocks.GLAZING: "glazing", blocks.PASSAGE: "passage"}[name]
            hinge, toward_ = None, None
            if "HINGE" in values and "SWING" in values:
                hinge = (x - dx, y - dy) if values["HINGE"] == "start" else (x + dx, y + dy)
                side = 1.0 if values["SWING"] == "left" else -1.0
                toward_ = (x - side * dy, y + side * dx)
            mark = Mark((x - dx, y - dy), (x + dx, y + dy), kind, hinge, toward_, _opening_fields(values))  # type: ignore[arg-type]
            self.drawing.marks.append([mark])
        elif name == blocks.SPACE_TAG:
            self.drawing.placed = True
            fields: dict[str, Any] = {"id": values.get("ID", ""), "use": values.get("USE", "")}
            fields |= {"ceiling": _number(values.get("CEILING", ""))} if "CEILING" in values else {}
            self.drawing.tags.append(Tag(x, y, {key: value for key, value in fields.items() if value != ""}, yaw))
        else:
            self._add_fixed(name, values, {"x": x, "y": y}, {"yaw": yaw, "width": width, "depth": depth})

    def _add_fixed(self, name: str, values: Mapping[str, str], place: dict[str, Any], extent: dict[str, Any]) -> None:
        if name == blocks.COLUMN:
            number = f"column_{len(self.drawing.columns) + 1}"
            self.drawing.columns.append({"id": values.get("ID", number), **place, **extent})
        elif name == blocks.KEEP_OUT:
            number = f"keep_out_{len(self.drawing.keep_outs) + 1}"
            fields: dict[str, Any] = {"id": values.get("ID", number), "reason": values.get("REASON", "")}
            self.drawing.keep_outs.append({**fields, **place, **extent})
        elif name == blocks.SERVICE:
            fields = {"kind": values.get("KIND", ""), "z": _number(values.get("Z", "0"))}
            fields |= {"reach": _number(values["REACH"])} if values.get("REACH") else {}
            fields |= {"required": True} if values.get("REQUIRED", "").casefold() == "yes" else {}
            self.drawing.services.append({**fields, **place})

    def _door(self, arc: Any) -> list[Mark]:
        """Return the two doors that an arc may mean: each of its ends may be that of the closed leaf."""
        center, radius = self._point(arc.ocs().to_wcs(arc.dxf.center)), float(arc.dxf.radius) * self.scale
        ends = [self._point(point) for point in (arc.start_point, arc.end_point)]
        if not 0.0 < radius < LONGEST:
            raise OptionError(f"an arc of a door has a radius of {radius:g} m: check the unit of the drawing")
        return [
            Mark(center, ends[0], "door", center, ends[1]),
            Mark(center, ends[1], "door", center, ends[0]),
        ]

    def _stroke(self, entity: Any, role: str) -> Stroke | None:
        """Return a line or polyline in meters with chords for arcs, None for other entities and arcs of walls."""
        kind = entity.dxftype()
        if kind == "ARC" and role == layers.WALLS:
            self._add_arc(entity)
            return None
        if kind == "LINE":
            return Stroke((self._point(entity.dxf.start), self._point(entity.dxf.end)))
        if kind == "LWPOLYLINE":
            rows = list(entity.get_points("xyseb"))
            bulges, widths = [row[4] for row in rows], [max(row[2], row[3]) for row in rows]
            points = tuple(self._point(point) for point in entity.vertices_in_wcs())
            width = max([float(entity.dxf.get("const_width", 0.0)), *widths]) * self.scale
        elif kind == "POLYLINE" and (entity.is_2d_polyline or entity.is_3d_polyline):
            bulges = [vertex.dxf.get("bulge", 0.0) for vertex in entity.vertices]
            points = tuple(self._point(point) for point in entity.points_in_wcs())
            width = float(entity.dxf.get("default_start_width", 0.0)) * self.scale
        else:
            return None
        height, closed = abs(float(entity.dxf.get("thickness", 0.0))) * self.scale, bool(entity.is_closed)
        if any(abs(bulge) > FLAT for bulge in bulges) and len(points) > 1:
            if entity.dxf.get("extrusion", (0.0, 0.0, 1.0))[2] < 0.0:
                bulges = [-bulge for bulge in bulges]
            if role == layers.WALLS and width < THICKNESS[0]:
                self._split(points, bulges, closed, height)
                return None
            points = tuple(flattened(points, bulges, closed, SAGITTA if role == layers.WALLS else OUTLINE_SAGITTA))
        return Stroke(points, closed, width, height)

    def _add_hatch(self, hatch: Any) -> None:
        """Add the boundaries of a filled part of walls; those with curves are left out."""
        from ezdxf.entities.boundary_paths import LineEdge, PolylinePath

        system = hatch.ocs()
        for path in hatch.paths:
            if isinstance(path, PolylinePath):
                straight = all(abs(bulge) <= FLAT for _, _, bulge in path.vertices)
                corners = [(x, y) for x, y, _ in path.vertices]
            else:
                straight = all(isinstance(edge, LineEdge) for edge in path.edges)
                corners = [(edge.start.x, edge.start.y) for edge in path.edges] if straight else []
            if straight and len(corners) > 2:
                points = tuple(self._point(system.to_wcs((x, y, 0.0))) for x, y in corners)
                self.hatches.append(Stroke(points, closed=True))

    def _split(self, points: Sequence[Point], bulges: Sequence[float], closed: bool, height: float) -> None:
        """Add the straight and the curved parts of the outline of a wall."""
        ends = [*points[1:], *(points[:1] if closed else ())]
        for a, b, bulge in zip(points, ends, bulges, strict=False):
            if abs(bulge) <= FLAT:
                self.walls.append(Stroke((a, b), False, 0.0, height))
            elif math.dist(a, b) > FLAT:
                self.arcs.append((Arc.of_bulge(a, b, bulge), height))

    def _add_arc(self, entity: Any) -> None:
        """Add a face of a curved wall."""
        a, b = (self._point(point) for point in (entity.start_point, entity.end_point))
        center = self._point(entity.ocs().to_wcs(entity.dxf.center))
        span = math.radians((float(entity.dxf.end_angle) - float(entity.dxf.start_angle)) % 360.0)
        if entity.dxf.get("extrusion", (0.0, 0.0, 1.0))[2] < 0.0:
            a, b = b, a
        radius = math.dist(center, a)
        if not 0.0 < radius < LONGEST or span <= 0.0:
            raise OptionError(
                f"an arc of a wall has a radius of {radius:g} m and a span of {span:g} rad: check the unit"
            )
        height = abs(float(entity.dxf.get("thickness", 0.0))) * self.scale
        self.arcs.append((Arc(center, radius, math.atan2(a[1] - center[1], a[0] - center[0]), span), height))

    def _point(self, point: Iterable[float]) -> Point:
        x, y, *_ = (float(value) * self.scale for value in point)
        if not (abs(x) <= FARTHEST and abs(y) <= FARTHEST):
            raise OptionError(f"a point at ({x:g}, {y:g}) m is too far away; check the unit of the drawing")
        return relative(self.origin, (x, y, 0.0))[:2] if any(self.origin) else (x, y)


WINDOW_FIELDS: dict[str, Any] = {"height": 1.2, "sill": 0.9}
"""Height and sill of windows in flat drawings, meters."""


def _extent(points: tuple[Point, ...]) -> dict[str, float]:
    """Return the middle, the yaw and the sides of a quadrilateral."""
    a, b, c, _ = points
    yaw = math.atan2(b[1] - a[1], b[0] - a[0])
    middle = {"x": (a[0] + c[0]) / 2.0, "y": (a[1] + c[1]) / 2.0}
    return {**middle, "yaw": yaw, "width": math.dist(a, b), "depth": math.dist(b, c)}


def _opening_fields(values: Mapping[str, str]) -> dict[str, Any]:
    """Return the fields of an opening that attributes name."""
    fields: dict[str, Any] = {
        name.lower(): _number(values[name]) for name in ("HEIGHT", "SILL", "ANGLE") if values.get(name)
    }
    if values.get("STATE"):
        fields["state"] = values["STATE"]
    return fields


def _number(text: str) -> float:
    try:
        return float(text[:40])
    except ValueError:
        raise OptionError(f"attribute value {text[:40]!r} is not a number") from None
