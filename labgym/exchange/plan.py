"""Dimensioned plans of layouts at scale, as PDF and SVG."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from labgym.documents import write_bytes
from labgym.errors import OptionError
from labgym.eval.drawing import palette
from labgym.eval.drawing.pictures import picture_bytes
from labgym.exchange.dimensions import OUTSIDE, Dimension, IdLabel, dimensions, id_label
from labgym.exchange.plan_sheet import (
    AISLE,
    BAR,
    BORDER,
    COLUMN,
    DIMENSION,
    FONT,
    KEEP_OUT,
    MM_PER_INCH,
    SERVICE,
    Sheet,
    SheetColumn,
    draw_scale_bar,
    sheet_for,
)
from labgym.exchange.structure import PlacedOpening, openings, outline, walls_in_plan
from labgym.geometry.polygons import polygons, union
from labgym.layouts import Layout
from labgym.layouts.floor import Floor
from labgym.layouts.placement import FLOOR, WALL

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MARGIN = OUTSIDE + 0.15
"""Space around the walls for dimension lines, meters."""
TICK = 0.06
"""Half the length of the stroke at the end of a dimension line, meters."""


def write_plan(layout: Layout, path: str | Path) -> Path:
    """Write the dimensioned plan of a layout as PDF or SVG, by the path's suffix, and return the path.

    The sheet has the size of a paper of ISO 216: printed without scaling, the plan has the scale that it names.

    Raises:
        OptionError: the path has another suffix, or the floor is too large for A0 at 1:200.
    """
    path = Path(path)
    if path.suffix not in (".pdf", ".svg"):
        raise OptionError(f"plan {path.name!r} must end in .pdf or .svg")
    return write_bytes(path, picture_bytes(draw_plan(layout), path.suffix[1:]))


def draw_plan(layout: Layout) -> Figure:
    """Return the dimensioned plan of a layout as a figure of matplotlib.

    It shows walls, openings with the swing of doors, objects with their ids, the inner lengths of outer sides, the
    widths of openings and the narrowest widths of aisles, with scale bar, title block, legend and key.

    Raises:
        OptionError: the floor is too large for A0 at 1:200.
    """
    from matplotlib.figure import Figure

    area = union(outline(space) for space in layout.floor.spaces)
    x0, y0, x1, y1 = union([walls_in_plan(layout.floor), area]).buffer(MARGIN).bounds
    sheet = sheet_for(x1 - x0, y1 - y0)
    figure = Figure(figsize=(sheet.width / MM_PER_INCH, sheet.height / MM_PER_INCH), facecolor="#ffffff")
    paper = figure.add_axes((0.0, 0.0, 1.0, 1.0), frameon=False, label="sheet")
    paper.set(xlim=(0.0, sheet.width), ylim=(0.0, sheet.height))
    paper.set_axis_off()
    width, height = sheet.length(x1 - x0), sheet.length(y1 - y0)
    left = BORDER + (sheet.width - 2.0 * BORDER - COLUMN - width) / 2.0
    bottom = BORDER + BAR + (sheet.height - 2.0 * BORDER - BAR - height) / 2.0
    place = (left / sheet.width, bottom / sheet.height, width / sheet.width, height / sheet.height)
    axes = figure.add_axes(place, frameon=False, label="plan")
    axes.set(xlim=(x0, x1), ylim=(y0, y1))
    axes.set_axis_off()
    _draw_floor(axes, layout.floor)
    numbered = _draw_objects(axes, layout, sheet)
    for dimension in dimensions(layout):
        _draw_dimension(axes, dimension)
    corners = np.array([(0, 0), (1, 0), (1, 1), (0, 1), (0, 0)]) * (
        sheet.width - 2.0 * BORDER,
        sheet.height - 2.0 * BORDER,
    )
    paper.plot(*(corners + BORDER).T, color=palette.INK, linewidth=1.0)
    draw_scale_bar(paper, sheet, BORDER + 8.0, BORDER + 5.0)
    column = SheetColumn(paper, sheet)
    column.title(layout, sheet, area.area)
    column.legend(layout)
    column.key(numbered)
    return figure


def _draw_floor(axes: Axes, floor: Floor) -> None:
    """Draw floors, walls, openings, columns, keep-outs, services, and names of several spaces."""
    from matplotlib.patches import PathPatch
    from matplotlib.patches import Polygon as Patch
    from matplotlib.path import Path as Outline

    for space in floor.spaces:
        region = outline(space)
        for part in polygons(region):
            axes.add_patch(Patch(np.array(part.exterior.coords), facecolor=palette.FLOOR, edgecolor="none", zorder=1))
        if len(floor.spaces) > 1:
            x, y = region.representative_point().coords[0]
            label = f"{space.id}\n{space.use}, {region.area:.1f} m²"
            axes.text(x, y, label, fontsize=7.0, family=FONT, color=palette.MUTED, ha="center", va="center", zorder=30)
    for part in polygons(walls_in_plan(floor)):
        rings = [part.exterior, *part.interiors]
        path = Outline.make_compound_path(*(Outline(np.array(ring.coords), closed=True) for ring in rings))
        axes.add_patch(PathPatch(path, facecolor=palette.WALL, edgecolor=palette.WALL, linewidth=0.4, zorder=5))
    for opening in openings(floor):
        _draw_opening(axes, opening)
    for column in floor.columns:
        corners = _box(column.x, column.y, column.width, column.depth, column.yaw)
        axes.add_patch(Patch(corners, facecolor=palette.WALL, edgecolor=palette.WALL, zorder=5))
    for keep_out in floor.keep_outs:
        corners = _box(keep_out.x, keep_out.y, keep_out.width, keep_out.depth, keep_out.yaw)
        axes.add_patch(Patch(corners, zorder=2, **KEEP_OUT))
    for service in floor.services:
        axes.plot(service.x, service.y, "o", markersize=5.5, zorder=32, **SERVICE)
        text: dict[str, Any] = {"fontsize": 4.0, "family": FONT, "ha": "center", "va": "center_baseline"}
        axes.text(service.x, service.y, service.kind[0].upper(), zorder=33, **text)


def _draw_opening(axes: Axes, placed: PlacedOpening) -> None:
    """Draw a door with its leaf and swing, or the lines of a window or passage."""
    half, opening = placed.opening.width / 2.0, placed.opening
    if opening.kind == "door":
        angles = np.linspace(0.0, math.pi / 2.0, 24)
        sweep = np.array([placed.leaf(float(angle)) for angle in angles])
        axes.plot(*sweep.T, color=palette.DOOR, linewidth=0.6, linestyle=(0, (3, 2)), zorder=6)
        leaf = np.array([placed.hinge, placed.leaf(math.pi / 2.0)])
        axes.plot(*leaf.T, color=palette.DOOR, linewidth=1.6, solid_capstyle="butt", zorder=6)
        return
    across = (-0.5, 0.5) if opening.kind == "passage" else (-0.5, 0.0, 0.5)
    style: dict[str, Any] = {"linestyle": (0, (2, 2))} if opening.kind == "passage" else {}
    for share in across:
        ends = np.array([placed.point(along, share * placed.thickness) for along in (-half, half)])
        axes.plot(*ends.T, color=palette.INK, linewidth=0.5, zorder=6, **style)


def _draw_objects(axes: Axes, layout: Layout, sheet: Sheet) -> list[str]:
    """Draw the objects that are visible from above, lower ones first; return the ids of those with a number."""
    from matplotlib.patches import Polygon as Patch
    from matplotlib.patheffects import withStroke

    numbered: list[str] = []
    for placement in sorted(layout.placements, key=lambda p: (p.support != FLOOR, layout.box(p.id).z1, p.id)):
        asset, box = layout.asset(placement.id), layout.box(placement.id)
        carried = placement.support not in (FLOOR, WALL)
        if carried and (asset.kind == "reagent" or layout.asset(placement.support).storage_class is not None):
            continue
        look = palette.swatch(asset)
        style: dict[str, Any] = {"facecolor": look.fill, "edgecolor": look.edge, "linewidth": 0.35, "zorder": 12}
        if placement.support == FLOOR:
            style |= {"linewidth": 0.7, "zorder": 8}
        elif placement.support == WALL:
            style |= {"facecolor": "none", "edgecolor": palette.MUTED, "linestyle": (0, (2, 1.5)), "zorder": 14}
        for part in layout.open_parts(placement.id):
            axes.add_patch(Patch(part.corners(), **{**style, "zorder": style["zorder"] - 1}))
        axes.add_patch(Patch(box.corners(), **style))
        if placement.support == FLOOR:
            corners = box.corners()
            axes.plot(*corners[[3, 2]].T, color=look.edge, linewidth=1.8, solid_capstyle="butt", zorder=9)
            label = id_label(placement.id, box, sheet.points_per_meter)
            if label is None:
                numbered.append(placement.id)
                label = IdLabel(str(len(numbered)), 5.0, 0.0)
            weight = "bold" if numbered[-1:] == [placement.id] else "normal"
            halo = [withStroke(linewidth=1.4, foreground=look.fill)]
            _write(
                axes, box.x, box.y, label.text, label.size, label.rotation, zorder=30, weight=weight, path_effects=halo
            )
    return numbered


def _draw_dimension(axes: Axes, dimension: Dimension) -> None:
    """Draw a dimension line with its extension lines, ticks and length."""
    color = AISLE if dimension.kind == "aisle" else DIMENSION
    (x0, y0), (x1, y1) = dimension.line
    axes.plot([x0, x1], [y0, y1], color=color, linewidth=0.5, zorder=34)
    tick = dimension.yaw + math.pi / 4.0
    dx, dy = TICK * math.cos(tick), TICK * math.sin(tick)
    for (x, y), measured in (((x0, y0), dimension.start), ((x1, y1), dimension.end)):
        axes.plot([x - dx, x + dx], [y - dy, y + dy], color=color, linewidth=0.8, zorder=34)
        if abs(dimension.offset) > 0.4:
            axes.plot([measured[0], x], [measured[1], y], color=color, linewidth=0.3, zorder=4)
    angle = dimension.yaw
    if math.cos(angle) < -1e-6 or (abs(math.cos(angle)) <= 1e-6 and math.sin(angle) < 0.0):
        angle += math.pi
    x, y = dimension.middle
    size = 6.5 if dimension.kind == "side" else 5.5
    _write(axes, x, y, f"{dimension.length:.2f}", size, angle, zorder=35, color=color, backdrop=True)


def _write(
    axes: Axes, x: float, y: float, text: str, size: float, rotation: float, backdrop: bool = False, **style: Any
) -> None:
    box = {"boxstyle": "square,pad=0.12", "facecolor": "#ffffff", "edgecolor": "none"} if backdrop else None
    place: dict[str, Any] = {"ha": "center", "va": "center", "rotation": math.degrees(rotation)}
    place |= {"rotation_mode": "anchor", "linespacing": 1.0, "bbox": box, "family": FONT, "fontsize": size}
    axes.text(x, y, text, **{"color": palette.INK, **style, **place})


def _box(x: float, y: float, width: float, depth: float, yaw: float) -> Any:
    from labgym.geometry import OrientedBox

    return OrientedBox(x, y, width, depth, yaw).corners()
