"""Writes layouts as DXF drawings in meters."""

from __future__ import annotations

import io
import math
from pathlib import Path
from typing import TYPE_CHECKING

from labgym.documents import write_text
from labgym.errors import OptionError
from labgym.exchange.dimensions import IdLabel, dimensions, id_label
from labgym.exchange.dxf import blocks, layers
from labgym.exchange.dxf.layers import load_ezdxf
from labgym.exchange.dxf.opening import ORIGIN
from labgym.exchange.structure import PlacedOpening, openings, outline, polygon, wall_pieces, walls_in_plan
from labgym.geometry import OrientedBox
from labgym.geometry.frames import PlanarPose
from labgym.geometry.polygons import difference, largest, polygons, union
from labgym.layouts import Layout
from labgym.layouts.floor import Floor
from labgym.layouts.placement import FLOOR, WALL

if TYPE_CHECKING:
    from ezdxf.document import Drawing
    from ezdxf.layouts.layout import Modelspace

VERSION = "R2010"
METERS = 6
DIMENSION_STYLE = "LABGYM"
LABEL = 0.1
"""Height of the labels of spaces, meters: 2 mm at 1:50."""
POINTS_PER_METER = 72.0 / 25.4 * 1000.0 / 50.0
"""Printed length of a meter at 1:50, points."""
CAPITAL, SMALL = 0.72, 3.0
"""Height of a capital letter relative to the font size, and the font size of labels that do not fit, points."""


def write_dxf(layout: Layout, path: str | Path) -> Path:
    """Write a layout as a DXF drawing (AutoCAD 2010, meters) and return the path.

    `labgym.exchange.dxf.layers` names the layers and `labgym.exchange.dxf.blocks` the blocks with their attributes.
    `read_dxf` reads the floor back. A floor that was read from a file is drawn in the file's frame.

    Raises:
        OptionError: the path does not end in .dxf.
        MissingDependencyError: ezdxf is not installed.
    """
    path = Path(path)
    if path.suffix.lower() != ".dxf":
        raise OptionError(f"drawing {path.name!r} must end in .dxf, for example {path.name}.dxf")
    options, stream = load_ezdxf().options, io.StringIO()
    fixed = options.write_fixed_meta_data_for_testing
    try:
        options.write_fixed_meta_data_for_testing = True  # no dates and random ids: equal layouts give equal bytes
        dxf_drawing(layout).write(stream)
    finally:
        options.write_fixed_meta_data_for_testing = fixed
    return write_text(path, stream.getvalue())


def dxf_drawing(layout: Layout) -> Drawing:
    """Return a layout as a drawing of ezdxf.

    Raises:
        MissingDependencyError: ezdxf is not installed.
    """
    drawing = _new_drawing()
    model = drawing.modelspace()
    _draw_structure(model, layout.floor)
    _draw_spaces(model, layout)
    _draw_objects(drawing, model, layout)
    for dimension in dimensions(layout):
        start, end, offset = dimension.start, dimension.end, dimension.offset
        if math.cos(dimension.yaw) < -1e-6:  # the text would be upside down
            start, end, offset = end, start, -offset
        model.add_aligned_dim(
            p1=start,
            p2=end,
            distance=offset,
            dimstyle=DIMENSION_STYLE,
            dxfattribs={"layer": layers.DIMENSIONS},
        ).render()
    if any(layout.floor.origin):
        _place(drawing, layout.floor.origin)
    return drawing


def _place(drawing: Drawing, origin: PlanarPose) -> None:
    """Move everything to the frame of the file that the floor was read from, and note its pose there."""
    from ezdxf import transform
    from ezdxf.math import Matrix44

    x, y, yaw = origin
    transform.inplace(drawing.modelspace(), Matrix44.z_rotate(yaw) * Matrix44.translate(x, y, 0.0))
    drawing.header.custom_vars.append(ORIGIN, " ".join(map(repr, origin)))


def _new_drawing() -> Drawing:
    drawing: Drawing = load_ezdxf().new(VERSION, setup=["linetypes", "styles"], units=METERS)
    for name, color in layers.COLORS.items():
        drawing.layers.add(name, color=color)
    style = drawing.dimstyles.new(DIMENSION_STYLE)
    lengths = {"dimtxt": 0.1, "dimasz": 0.06, "dimexe": 0.05, "dimexo": 0.05, "dimgap": 0.03}
    text = {"dimdec": 2, "dimlfac": 1.0, "dimscale": 1.0, "dimtad": 1, "dimzin": 0}  # dimzin 0: "8.00", not "8"
    style.update_dxf_attribs({**lengths, **text, "dimblk": "ARCHTICK"})
    blocks.add_blocks(drawing)
    return drawing


def _draw_structure(model: Modelspace, floor: Floor) -> None:
    """Draw walls as closed polylines with their height as thickness, their common area, openings and columns."""
    for wall in floor.walls:
        for piece in wall_pieces(wall):
            model.add_lwpolyline(
                [(float(x), float(y)) for x, y in piece.corners()],
                close=True,
                dxfattribs={"layer": layers.WALLS, "thickness": wall.height},
            )
    hatch = model.add_hatch(color=9, dxfattribs={"layer": layers.WALL_FILL})
    for part in polygons(walls_in_plan(floor)):
        for ring, outer in ((part.exterior, True), *((inner, False) for inner in part.interiors)):
            hatch.paths.add_polyline_path(
                [(x, y) for x, y in ring.coords[:-1]], is_closed=True, flags=1 if outer else 0
            )
    for opening in openings(floor):
        _draw_opening(model, opening)
    for column in floor.columns:
        scale, rotation = (column.width, column.depth), math.degrees(column.yaw)
        blocks.insert(model, blocks.COLUMN, layers.COLUMNS, (column.x, column.y), {"ID": column.id}, scale, rotation)
    for area_ in floor.keep_outs:
        scale, rotation = (area_.width, area_.depth), math.degrees(area_.yaw)
        values = {"ID": area_.id, "REASON": area_.reason}
        blocks.insert(model, blocks.KEEP_OUT, layers.KEEP_OUTS, (area_.x, area_.y), values, scale, rotation)
    for service in floor.services:
        point: dict[str, object] = {"KIND": service.kind, "Z": service.z}
        point |= {"REACH": service.reach} if service.reach is not None else {}
        point |= {"REQUIRED": "yes"} if service.required else {}
        blocks.insert(model, blocks.SERVICE, layers.SERVICES, (service.x, service.y), point)


def _draw_opening(model: Modelspace, placed: PlacedOpening) -> None:
    opening, layer = placed.opening, blocks.LAYER_OF[placed.opening.kind]
    values: dict[str, object] = {
        "KIND": opening.kind,
        "WIDTH": opening.width,
        "HEIGHT": opening.height,
        "SILL": opening.sill,
        "STATE": opening.state,
        "ANGLE": opening.angle,
    }
    if opening.kind == "door":
        name = blocks.DOOR_LEFT if placed.turn > 0 else blocks.DOOR_RIGHT
        scale, rotation = (opening.width, opening.width), math.degrees(placed.closed_yaw)
        blocks.insert(model, name, layer, placed.hinge, values, scale, rotation)
        return
    values |= {"SWING": opening.swing, "HINGE": opening.hinge}
    name = {"window": blocks.WINDOW, "glazing": blocks.GLAZING, "passage": blocks.PASSAGE}[opening.kind]
    scale, rotation = (opening.width, placed.thickness), math.degrees(placed.yaw)
    blocks.insert(model, name, layer, (placed.x, placed.y), values, scale, rotation)


def _draw_spaces(model: Modelspace, layout: Layout) -> None:
    """Draw the outline of each space, and a tag with its id, use, size and ceiling height, clear of furniture."""
    from shapely.ops import polylabel

    furniture = union(polygon(layout.box(p.id)) for p in layout.placements if p.support == FLOOR)
    for space in layout.floor.spaces:
        region = outline(space).simplify(1e-6)
        for ring in (ring for part in polygons(region) for ring in (part.exterior, *part.interiors)):
            model.add_lwpolyline(list(ring.coords[:-1]), close=True, dxfattribs={"layer": layers.SPACES})
        free = largest(difference(region, furniture))
        middle = region.representative_point() if free.is_empty else polylabel(free, 0.05)
        place = (middle.x, middle.y)
        values = {"ID": space.id, "USE": space.use, "CEILING": space.ceiling}
        blocks.insert(model, blocks.SPACE_TAG, layers.SPACE_TAGS, place, values, rotation=math.degrees(space.yaw))
        text = f"{space.id}\\P{space.use}, {region.area:.1f} m²"
        model.add_mtext(
            text,
            dxfattribs={"layer": layers.SPACE_TAGS, "char_height": 1.5 * LABEL, "insert": place, "attachment_point": 5},
        )


def _draw_objects(drawing: Drawing, model: Modelspace, layout: Layout) -> None:
    """Insert a block for each object that is visible from above, and label those on the floor with their ids."""
    for placement in layout.placements:
        asset = layout.asset(placement.id)
        carried = placement.support not in (FLOOR, WALL)
        if carried and (asset.kind == "reagent" or layout.asset(placement.support).storage_class is not None):
            continue
        layer = layers.EQUIPMENT if carried else layers.FURNITURE
        name = blocks.furniture_block(drawing, asset.name if placement.size is None else placement.id, asset)
        position, rotation = placement.position[:2], math.degrees(placement.yaw)
        values = {"ID": placement.id, "ASSET": asset.name}
        blocks.insert(model, name, layer, position, values, rotation=rotation)
        for part in layout.open_parts(placement.id):
            model.add_lwpolyline(
                [tuple(corner) for corner in part.corners().tolist()], close=True, dxfattribs={"layer": layer}
            )
        if placement.support == FLOOR:
            _label(model, placement.id, layout.box(placement.id))


def _label(model: Modelspace, text: str, box: OrientedBox) -> None:
    """Write an id into a footprint, wrapped and turned as it fits; a small one if it does not fit."""
    label = id_label(text, box, POINTS_PER_METER) or IdLabel(text, SMALL, 0.0)
    place: dict[str, object] = {"layer": layers.LABELS, "insert": (box.x, box.y), "attachment_point": 5}
    height = CAPITAL * label.size / POINTS_PER_METER
    size: dict[str, object] = {"char_height": height, "rotation": math.degrees(label.rotation)}
    model.add_mtext(label.text.replace("\n", "\\P"), dxfattribs={**place, **size})
