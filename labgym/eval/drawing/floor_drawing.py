"""A floor from above: coverings, walls with their openings, swings of doors, columns, and the names of its spaces."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import Polygon

from labgym.eval.drawing import palette
from labgym.eval.drawing.plan_labels import FONT, text_extent
from labgym.geometry import OrientedBox
from labgym.geometry.polygons import difference, polygons, union
from labgym.layouts.floor import Floor, Opening, Space, Wall

if TYPE_CHECKING:
    from matplotlib.axes import Axes

GRID_STEP = 1.0
"""Spacing of the grid, meters."""
SWEEP_POINTS = 24
NAME_SIZES = (9.0, 7.5, 6.0)
"""Font sizes of the names of spaces, points; the largest that covers no furniture is taken."""
BOLD = 1.15
"""Width of bold text relative to regular text."""
PLACES = 25
"""Places along each axis at which a name is tried."""
SERVICES = {"water": "W", "gas": "G", "exhaust": "E", "power": "P"}

Array = NDArray[np.float64]
Rectangle = tuple[float, float, float, float]


def draw_floor(axes: Axes, floor: Floor) -> None:
    """Draw the coverings, walls, openings, columns, services and keep-outs of a floor, and a meter grid."""
    from labgym.scenes.floor_covering import coverings, region_outline

    outlines = coverings(floor)
    ways = [wall.piece(*opening.span, 0.0, opening.top) for wall in floor.walls for opening in wall.openings]
    solid = region_outline([part.box for part in floor.parts if part.kind in ("wall", "column")])
    _fill(axes, union(outlines), palette.FLOOR, 2)
    _draw_grid(axes, floor, outlines)
    _fill(axes, difference(solid, region_outline(ways)), palette.WALL, 4)
    _fill(axes, region_outline(ways), "#ffffff", 3)
    for wall in floor.walls:
        for opening in wall.openings:
            _draw_opening(axes, wall, opening)
    for area in floor.keep_outs:
        _draw_keep_out(axes, area.box)
    for service in floor.services:
        axes.text(service.x, service.y, SERVICES[service.kind], **service_style())


def service_style() -> dict[str, Any]:
    """Return the text style of the mark of a service."""
    disc = {"boxstyle": "circle,pad=0.2", "facecolor": palette.MUTED, "linewidth": 0.0}
    font = {"fontsize": 5.0, "family": FONT, "weight": "bold", "color": "#ffffff"}
    return {**font, "bbox": disc, "ha": "center", "va": "center", "zorder": 32}


def swings(floor: Floor) -> list[Rectangle]:
    """Return bounds (x0, y0, x1, y1) of the floor that the leaves of doors sweep."""
    bounds = []
    for wall in floor.walls:
        for opening in wall.openings:
            if opening.kind == "door":
                points = sweep(wall, opening, max(math.pi / 2.0, opening.angle))
                (x0, y0), (x1, y1) = points.min(axis=0).tolist(), points.max(axis=0).tolist()
                bounds.append((x0, y0, x1, y1))
    return bounds


def draw_names(axes: Axes, floor: Floor, scale: float, furniture: Iterable[OrientedBox]) -> list[Rectangle]:
    """Write the name of each space where it covers no furniture, or in the middle of the space.

    Returns the bounds (x0, y0, x1, y1) of the names.

    Args:
        scale: points of the picture per meter.
        furniture: boxes that names should not cover.
    """
    from matplotlib.patheffects import withStroke

    from labgym.scenes.floor_covering import coverings, region_outline

    taken = region_outline([*furniture, *(part.box for part in floor.parts)])
    bounds: list[Rectangle] = []
    for space, outline in zip(floor.spaces, coverings(floor), strict=True):
        free = difference(outline, taken)
        x, y, size = _name_place(space, free, scale)
        style: dict[str, Any] = {"fontsize": size, "family": FONT, "color": palette.MUTED, "weight": "bold"}
        halo = [withStroke(linewidth=2.0, foreground=palette.FLOOR)]
        axes.text(x, y, _title(space), **style, ha="center", va="center", zorder=30, path_effects=halo)
        width, height = _half_extent(space, size, scale)
        bounds.append((x - width, y - height, x + width, y + height))
    return bounds


def _name_place(space: Space, free: shapely.Geometry, scale: float) -> tuple[float, float, float]:
    """Return the middle and the font size of a space's name."""
    middle = union(Polygon(box.corners()) for box in space.boxes).centroid
    x0, y0, x1, y1 = free.bounds if not free.is_empty else middle.buffer(0.1).bounds
    shapely.prepare(free)
    x, y = (grid.ravel() for grid in np.meshgrid(np.linspace(x0, x1, PLACES), np.linspace(y0, y1, PLACES)))
    for size in NAME_SIZES:
        width, height = _half_extent(space, size, scale)
        names = shapely.box(x - width, y - height, x + width, y + height)
        fits = shapely.contains(free, names)
        if fits.any():
            distance = np.where(fits, np.hypot(x - middle.x, y - middle.y), np.inf)
            best = int(distance.argmin())
            return float(x[best]), float(y[best]), size
    return float(middle.x), float(middle.y), NAME_SIZES[-1]


def _half_extent(space: Space, size: float, scale: float) -> tuple[float, float]:
    """Return half of the width and half of the height of a space's name, meters."""
    width, height = text_extent(_title(space), size)
    return BOLD * width / scale / 2.0, height / scale / 2.0


def _title(space: Space) -> str:
    return space.id.replace("_", " ")


def _draw_grid(axes: Axes, floor: Floor, outlines: Sequence[shapely.Geometry]) -> None:
    """Draw the lines of the meter grid inside the spaces."""
    from matplotlib.collections import LineCollection

    x0, y0, x1, y1 = floor.bounds
    xs, ys = np.arange(math.ceil(x0), x1, GRID_STEP), np.arange(math.ceil(y0), y1, GRID_STEP)
    lines = [shapely.LineString([(x, y0), (x, y1)]) for x in xs] + [shapely.LineString([(x0, y), (x1, y)]) for y in ys]
    inside = shapely.intersection(shapely.MultiLineString(lines), union(outlines))
    segments = [np.array(line.coords) for line in shapely.get_parts(inside) if line.geom_type == "LineString"]
    axes.add_collection(LineCollection(segments, colors=palette.GRID, linewidths=0.6, zorder=3))


def _draw_opening(axes: Axes, wall: Wall, opening: Opening) -> None:
    """Draw panes as lines, and doors as a leaf and its sweep; a closed inner door lies in its opening."""
    from matplotlib.patches import Polygon as Outline

    if opening.kind in ("window", "glazing"):
        box = wall.piece(*opening.span, 0.0, opening.top)
        axes.add_patch(Outline(box.corners(), fill=False, edgecolor=palette.WALL, linewidth=0.6, zorder=5))
        ends = np.array([wall.point(u) for u in opening.span])
        axes.plot(*ends.T, color=palette.WALL, linewidth=0.8 if opening.kind == "window" else 2.0, zorder=5)
    elif opening.kind == "door":
        turn = opening.angle if opening.state == "open" else math.pi / 2.0
        points = sweep(wall, opening, turn)
        axes.plot(*points[1:].T, color=palette.DOOR, linewidth=0.7, linestyle=(0, (3, 2)), zorder=5)
        leaf = points[[0, -1]]
        axes.plot(*leaf.T, color=palette.DOOR, linewidth=2.0, solid_capstyle="butt", zorder=6)


def sweep(wall: Wall, opening: Opening, angle: float) -> Array:
    """Return the hinge of a door and the points that the free edge of its leaf passes, from closed to an angle."""
    side = 1.0 if opening.swing == "left" else -1.0
    low, high = opening.span
    edge, toward = (low, 1.0) if opening.hinge == "start" else (high, -1.0)
    angles = np.linspace(0.0, angle, SWEEP_POINTS)
    along = edge + toward * opening.width * np.cos(angles)
    across = side * (wall.thickness / 2.0 + opening.width * np.sin(angles))
    hinge = wall.point(edge, side * wall.thickness / 2.0)
    return np.array([hinge, *(wall.point(float(u), float(v)) for u, v in zip(along, across, strict=True))])


def _draw_keep_out(axes: Axes, box: OrientedBox) -> None:
    from matplotlib.patches import Polygon as Outline

    style: dict[str, Any] = {"edgecolor": palette.MUTED, "linewidth": 0.7, "linestyle": (0, (2, 2)), "hatch": "////"}
    axes.add_patch(Outline(box.corners(), fill=False, alpha=0.5, zorder=4, **style))


def _fill(axes: Axes, shape: shapely.Geometry, color: str, order: float) -> None:
    """Fill a shape, which may have holes."""
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    rings = [np.array(ring.coords)[:, :2] for ring in outlines(shape)]
    if rings:
        outline = Path.make_compound_path(*[Path(ring, closed=True) for ring in rings])
        axes.add_patch(PathPatch(outline, facecolor=color, edgecolor="none", linewidth=0.0, zorder=order))


def outlines(shape: shapely.Geometry) -> Iterator[shapely.LinearRing]:
    """Yield outer rings and holes, which run in opposite directions, so that holes stay empty."""
    for part in polygons(shapely.orient_polygons(shape)):
        yield from (part.exterior, *part.interiors)
