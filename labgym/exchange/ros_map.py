"""Files for a robot with ROS 2 and Nav2: a layout as maps and masks, the waypoints of its protocols, the robot."""

from __future__ import annotations

import io
import math
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from labgym.errors import OptionError
from labgym.exchange.structure import WAYS, joined_pieces, outline, polygon
from labgym.exchange.urdf import robot_urdf
from labgym.geometry import OrientedBox, compose, rotate
from labgym.geometry.frames import PlanarPose
from labgym.geometry.polygons import grown, union
from labgym.layouts import Layout
from labgym.layouts.placement import FLOOR
from labgym.navigation.goals import location_pose, same_place
from labgym.protocols import Protocol
from labgym.scenes.folders import whole_folder

if TYPE_CHECKING:
    from shapely import Geometry

IMAGE, METADATA = "map.png", "map.yaml"
KEEP_OUT, SPEED, WAYPOINTS, PARAMETERS, ROBOT = "keepout", "speed", "waypoints", "nav2.yaml", "robot.urdf"
ENTRIES = (
    *(f"{name}.{suffix}" for name in ("map", KEEP_OUT, SPEED) for suffix in ("png", "yaml")),
    WAYPOINTS,
    PARAMETERS,
    ROBOT,
)
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
SLOW_PERCENT = 50
"""Speed limit near doors and where people work, percent of the greatest speed."""
NEAR_DOORS_M = 1.0
"""Distance from a doorway within which the speed is limited."""
FILTERS = """\
# Parameters of Nav2 for the masks in this folder. In the costmaps, add the filters keepout_filter and speed_filter with
# filter_info_topic /keepout_filter_info and /speed_filter_info.
map_server: {ros__parameters: {yaml_filename: map.yaml}}
keepout_mask_server: {ros__parameters: {yaml_filename: keepout.yaml, topic_name: /keepout_mask, frame_id: map}}
keepout_filter_info_server:
  ros__parameters:
    {type: 0, filter_info_topic: /keepout_filter_info, mask_topic: /keepout_mask, base: 0.0, multiplier: 1.0}
speed_mask_server: {ros__parameters: {yaml_filename: speed.yaml, topic_name: /speed_mask, frame_id: map}}
speed_filter_info_server:
  ros__parameters:
    {type: 1, filter_info_topic: /speed_filter_info, mask_topic: /speed_mask, base: 100.0, multiplier: -1.0}
"""


@dataclass(frozen=True)
class _Grid:
    """Cells along the axes of the map's frame: the cell with the least x and y by number, and rows and columns."""

    resolution: float
    low: tuple[int, int]
    shape: tuple[int, int]

    @property
    def origin(self) -> tuple[float, float]:
        """Position of the outer corner of cell [0, 0], meters."""
        return round(self.low[0] * self.resolution, 6), round(self.low[1] * self.resolution, 6)

    def centers(self, area: Geometry) -> NDArray[np.bool_]:
        """Return the cells whose center lies in an area, (rows, columns)."""
        import shapely

        x, y = ((low + np.arange(n) + 0.5) * self.resolution for low, n in zip(self.low, self.shape[::-1], strict=True))
        return np.asarray(shapely.contains_xy(area, *np.meshgrid(x, y)))

    def overlapping(self, solids: Iterable[Geometry]) -> NDArray[np.bool_]:
        """Return the cells that overlap convex solids, (rows, columns); touching does not count."""
        import shapely

        cells = np.zeros(self.shape, dtype=np.bool_)
        low, size = np.array(self.low), self.resolution
        for solid in solids:
            x0, y0, x1, y1 = solid.bounds
            inside = ((0, 0), self.shape[::-1])
            c0, r0 = np.clip(np.floor(np.array([x0, y0]) / size + ROUNDING).astype(int) - low, *inside)
            c1, r1 = np.clip(np.ceil(np.array([x1, y1]) / size - ROUNDING).astype(int) - low, *inside)
            x, y = np.meshgrid((low[0] + np.arange(c0, c1)) * size, (low[1] + np.arange(r0, r1)) * size)
            squares = shapely.box(x, y, x + size, y + size)
            cells[r0:r1, c0:c1] |= shapely.intersects(solid.buffer(-ROUNDING * size), squares)
        return cells


def write_ros_map(
    layout: Layout, folder: str | Path, resolution: float = RESOLUTION, below: float = ROBOT_HEIGHT
) -> Path:
    """Write a layout as a folder for ROS 2 and Nav2, and return the path of its `map.yaml`.

    - `map.png`, `map.yaml`: for map_server. A cell is occupied if it overlaps a wall, a window, a column or furniture,
      free if its center lies in a space or a doorway, and unknown otherwise. Doors are drawn open and without their
      leaves, as in a map that a robot records.
    - `keepout.png`, `keepout.yaml`: the robot must stay out of what is not free, and of the exits.
    - `speed.png`, `speed.yaml`: half speed within 1 m of doorways and in the clear areas in front of furniture.
    - `waypoints`: the poses of each protocol's steps, in the form of the Nav2 panel of RViz.
    - `nav2.yaml`: parameters of the map and filter servers. `robot.urdf`: the robot.

    The frame is that of the drawing or map that the floor was read from, otherwise the floor's.

    Args:
        resolution: side of a cell, meters.
        below: objects whose bottom is above this height are left out, meters.

    Raises:
        OptionError: the resolution is not positive, or gives more than 25 million cells.
        LabgymError: the folder exists and holds other files.
    """
    folder = Path(folder)
    grid, values = _map(layout, resolution, below)
    with whole_folder(folder, ENTRIES, "ROS map") as fresh:
        _write_image(fresh, "map", grid, values, ("trinary", OCCUPIED_ABOVE, FREE_BELOW))
        barred = (values != FREE) | grid.overlapping(_in_file(layout, _exits(layout)))
        keep_out = np.where(barred, OCCUPIED, FREE).astype(np.uint8)
        _write_image(fresh, KEEP_OUT, grid, keep_out, ("trinary", OCCUPIED_ABOVE, FREE_BELOW))
        slow = (values == FREE) & grid.centers(union(_in_file(layout, _slow_areas(layout))))
        # The mask's value is the reduction in percent: map_server reads 100 (1 - gray / 255).
        gray = np.where(slow, round(255 * SLOW_PERCENT / 100), 255).astype(np.uint8)
        _write_image(fresh, SPEED, grid, gray, ("scale", 1.0, 0.0))
        (fresh / WAYPOINTS).mkdir()
        for protocol in layout.protocols:
            path = fresh / WAYPOINTS / f"{protocol.id}.yaml"
            path.write_text(_waypoints(layout, protocol), encoding="utf-8")
        (fresh / PARAMETERS).write_text(FILTERS, encoding="utf-8")
        (fresh / ROBOT).write_text(robot_urdf(), encoding="utf-8")
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
    grid, values = _map(layout, resolution, below)
    return values, grid.origin


def _map(layout: Layout, resolution: float, below: float) -> tuple[_Grid, NDArray[np.uint8]]:
    floor = layout.floor
    solids = _in_file(layout, _solids(layout, below))
    ways = [wall.piece(*each.span, 0.0, 1.0) for wall in floor.walls for each in wall.openings if each.kind in WAYS]
    free = union(_in_file(layout, [*(outline(space) for space in floor.spaces), *map(polygon, ways)]))
    x0, y0, x1, y1 = union([free, *solids]).bounds
    if not resolution > 0.0 or (x1 - x0) * (y1 - y0) / resolution**2 > MAX_CELLS:
        raise OptionError(f"resolution {resolution} m must be positive and give at most {MAX_CELLS} cells")
    low = np.floor(np.array([x0, y0]) / resolution + ROUNDING).astype(int) - MARGIN
    high = np.ceil(np.array([x1, y1]) / resolution - ROUNDING).astype(int) + MARGIN
    nx, ny = (int(extent) for extent in high - low)
    grid = _Grid(resolution, (int(low[0]), int(low[1])), (ny, nx))
    values = np.where(grid.centers(free), FREE, UNKNOWN)
    values[grid.overlapping(solids)] = OCCUPIED
    return grid, values.astype(np.uint8)


def _in_file(layout: Layout, shapes: Iterable[Geometry]) -> list[Geometry]:
    """Return shapes of the floor's frame in that of the file that the floor was read from."""
    from shapely.affinity import rotate, translate

    x, y, yaw = layout.floor.origin
    if not any(layout.floor.origin):
        return list(shapes)
    return [translate(rotate(shape, yaw, (0.0, 0.0), use_radians=True), x, y) for shape in shapes]


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


def _exits(layout: Layout) -> list[Geometry]:
    return [polygon(way.floor) for way in layout.floor.doorways if way.exit]


def _slow_areas(layout: Layout) -> list[Geometry]:
    """Return the surroundings of doorways, and the clear areas in front of furniture, at which people work."""
    areas = [grown(polygon(way.floor), NEAR_DOORS_M) for way in layout.floor.doorways]
    for placement in layout.placements:
        clear = layout.asset(placement.id).clearance
        if placement.support == FLOOR and clear > 0.0:
            box = layout.box(placement.id)
            dx, dy = rotate(0.0, (box.depth + clear) / 2.0, box.yaw)
            areas.append(polygon(OrientedBox(box.x + dx, box.y + dy, box.width, clear, box.yaw)))
    return areas


def _waypoints(layout: Layout, protocol: Protocol) -> str:
    """Return the poses at which the robot carries out the steps of a protocol, in their order."""
    lines: list[str] = []
    last: PlanarPose | None = None
    for location in protocol.route:
        if layout.find(location) is None:
            lines.append(f"  # {location}: not in the layout")
            continue
        pose = location_pose(layout, location)
        if last is None or not same_place(last, pose):
            x, y, yaw = compose(layout.floor.origin, pose)
            count = sum("waypoint" in line for line in lines)
            lines += [f"  waypoint{count}:  # {location}", f"    pose: [{x:.4f}, {y:.4f}, 0.0]"]
            w, z = math.cos(yaw / 2.0), math.sin(yaw / 2.0)
            lines.append(f"    orientation: [{w:.6f}, 0.0, 0.0, {z:.6f}]  # w, x, y, z")
        last = pose
    lines.insert(0, "waypoints:" if last else "waypoints: {}")
    return "\n".join(lines) + "\n"


def _write_image(
    folder: Path, name: str, grid: _Grid, values: NDArray[np.uint8], reading: tuple[str, float, float]
) -> None:
    """Write gray values as a picture, with row 0 on the far side, and how map_server reads it."""
    from PIL import Image

    stream = io.BytesIO()
    Image.fromarray(values[::-1]).save(stream, "png", optimize=True)
    (folder / f"{name}.png").write_bytes(stream.getvalue())
    (mode, occupied_above, free_below), (x, y) = reading, grid.origin
    lines = (
        f"image: {name}.png",
        f"mode: {mode}",
        f"resolution: {grid.resolution:g}",
        f"origin: [{x!r}, {y!r}, 0.0]",
        "negate: 0",
        f"occupied_thresh: {occupied_above}",
        f"free_thresh: {free_below}",
    )
    (folder / f"{name}.yaml").write_text("\n".join(lines) + "\n", encoding="utf-8")
