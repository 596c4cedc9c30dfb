"""Robot maps: a layout as an occupancy grid of ROS, `map.png` with `map.yaml`."""

from __future__ import annotations

import io
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from labgym.errors import OptionError
from labgym.exchange.structure import WAYS, joined_pieces, outline, polygon
from labgym.geometry import OrientedBox
from labgym.geometry.polygons import union
from labgym.layouts import Layout
from labgym.scenes.folders import whole_folder

if TYPE_CHECKING:
    from shapely import Geometry

IMAGE, METADATA = "map.png", "map.yaml"
OCCUPIED, UNKNOWN, FREE = 0, 205, 254
"""Gray values of the three states, those of map_server's saver."""
OCCUPIED_ABOVE, FREE_BELOW = 0.65, 0.196
"""Thresholds of occupancy. 0.196 is just below the 205 of unknown cells: (255 - 205) / 255 = 0.19608."""
RESOLUTION = 0.05
ROBOT_HEIGHT = 1.2
"""Objects whose bottom is above this height are not drawn, meters."""
MARGIN = 2
"""Unknown cells around the floor."""
MAX_CELLS = 25_000_000
ROUNDING = 1e-6
"""Overlaps below this share of a cell count as touching."""


def write_ros_map(
    layout: Layout, folder: str | Path, resolution: float = RESOLUTION, below: float = ROBOT_HEIGHT
) -> Path:
    """Write a layout as `map.png` and `map.yaml` into a folder, and return the path of the latter.

    The map is read by map_server of ROS and nav2. Its frame is the floor's. A cell is occupied if it overlaps a wall, a
    window, a column or furniture, free if its center lies in a space or a doorway, and unknown otherwise. Doors are
    drawn open and without their leaves, as in a map that a robot records.

    Args:
        resolution: side of a cell, meters.
        below: objects whose bottom is above this height are left out, meters.

    Raises:
        OptionError: the resolution is not positive, or gives more than 25 million cells.
        LabgymError: the folder exists and holds other files.
    """
    from PIL import Image

    values, origin = ros_map(layout, resolution, below)
    stream = io.BytesIO()
    # Row 0 of the picture is the far side of the map.
    Image.fromarray(values[::-1]).save(stream, "png", optimize=True)
    folder = Path(folder)
    with whole_folder(folder, (IMAGE, METADATA), "ROS map") as fresh:
        (fresh / IMAGE).write_bytes(stream.getvalue())
        (fresh / METADATA).write_text(_metadata(resolution, origin), encoding="utf-8")
    return folder / METADATA


def ros_map(
    layout: Layout, resolution: float = RESOLUTION, below: float = ROBOT_HEIGHT
) -> tuple[NDArray[np.uint8], tuple[float, float]]:
    """Return the map of a layout and its origin.

    Returns:
        Gray values (ny, nx), row 0 at the least y, and the position of the outer corner of cell [0, 0], meters.

    Raises:
        OptionError: the resolution is not positive, or gives more than 25 million cells.
    """
    import shapely

    floor = layout.floor
    solids = _solids(layout, below)
    ways = [wall.piece(*each.span, 0.0, 1.0) for wall in floor.walls for each in wall.openings if each.kind in WAYS]
    free = union([*(outline(space) for space in floor.spaces), *map(polygon, ways)])
    x0, y0, x1, y1 = union([free, *solids]).bounds
    if not resolution > 0.0 or (x1 - x0) * (y1 - y0) / resolution**2 > MAX_CELLS:
        raise OptionError(f"resolution {resolution} m must be positive and give at most {MAX_CELLS} cells")
    low = np.floor(np.array([x0, y0]) / resolution + ROUNDING).astype(int) - MARGIN
    high = np.ceil(np.array([x1, y1]) / resolution - ROUNDING).astype(int) + MARGIN
    nx, ny = (int(extent) for extent in high - low)
    values = np.full((ny, nx), UNKNOWN, dtype=np.uint8)
    x, y = (low[0] + np.arange(nx) + 0.5) * resolution, (low[1] + np.arange(ny) + 0.5) * resolution
    values[shapely.contains_xy(free, *np.meshgrid(x, y))] = FREE
    for solid in solids:
        _occupy(values, solid, low, resolution)
    return values, (round(float(low[0] * resolution), 6), round(float(low[1] * resolution), 6))


def _solids(layout: Layout, below: float) -> list[Geometry]:
    """Return what is drawn as occupied: walls, windows, columns, and objects that begin below a height."""
    floor = layout.floor
    boxes = [*joined_pieces(floor)]
    boxes += [
        wall.piece(*each.span, 0.0, 1.0) for wall in floor.walls for each in wall.openings if each.kind not in WAYS
    ]
    boxes += [OrientedBox(each.x, each.y, each.width, each.depth, each.yaw) for each in floor.columns]
    boxes += layout.obstacles(below)
    return [polygon(box) for box in boxes]


def _occupy(values: NDArray[np.uint8], solid: Geometry, low: NDArray[np.int_], resolution: float) -> None:
    """Set the cells that overlap a convex solid; touching it does not count."""
    import shapely

    x0, y0, x1, y1 = solid.bounds
    c0, r0 = np.floor(np.array([x0, y0]) / resolution + ROUNDING).astype(int) - low
    c1, r1 = np.ceil(np.array([x1, y1]) / resolution - ROUNDING).astype(int) - low
    x, y = np.meshgrid((low[0] + np.arange(c0, c1)) * resolution, (low[1] + np.arange(r0, r1)) * resolution)
    cells = shapely.box(x, y, x + resolution, y + resolution)
    shrunk = solid.buffer(-ROUNDING * resolution)
    values[r0:r1, c0:c1][shapely.intersects(shrunk, cells)] = OCCUPIED


def _metadata(resolution: float, origin: tuple[float, float]) -> str:
    lines = (
        f"image: {IMAGE}",
        "mode: trinary",
        f"resolution: {resolution:g}",
        f"origin: [{origin[0]:g}, {origin[1]:g}, 0.0]",
        "negate: 0",
        f"occupied_thresh: {OCCUPIED_ABOVE}",
        f"free_thresh: {FREE_BELOW}",
    )
    return "\n".join(lines) + "\n"
