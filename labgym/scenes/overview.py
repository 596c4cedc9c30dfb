"""The camera that shows a whole floor from outside and above: of an empty floor, and of a furnished one."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
import shapely
from numpy.typing import NDArray

from labgym.geometry.polygons import GRID_M, union
from labgym.layouts import Layout
from labgym.layouts.floor import Floor
from labgym.layouts.placement import FLOOR
from labgym.scenes.camera import WIDE, Array, View, fitted
from labgym.scenes.cutaway import CACHED, hidden_walls, near_walls
from labgym.scenes.floor_covering import region_outline
from labgym.scenes.mesh import ROOM, SceneMesh, scene_mesh
from labgym.scenes.surfaces import Surfaces
from labgym.scenes.wall_faces import upper, wall_name

BEARINGS = tuple(float(side + aside) for side in (-90, 90, 0, 180) for aside in (28, 15, 7, 0, -7, -15, -28))
"""Directions from the floor to the camera that are tried, degrees, the best first."""
PITCHES = (38.0, 45.0, 52.0, 60.0)
"""Angles above the horizontal from which the camera may look, degrees, the best first."""
FOVY = 34.0
"""Vertical field of view, degrees."""
FRONT, FRONTAL = -90.0, 30.0
"""Direction of the front of a floor, and the angle from it up to which a camera is in front, degrees."""
STRAIGHT, STEEP = 0.10, 0.006
"""Shares of its value that a view loses if it looks along an axis, and for a degree of pitch; the value of a view is
the share of the picture that floor and walls fill."""
ASIDE = 0.08
"""Share that it loses if it looks from elsewhere than the front."""
FRONTS = 0.5
"""How much better a view is that looks at all fronts of the furniture, relative to one that sees them edge on."""
FAR = 1e3
"""Distance of the point from which walls are judged to be near or far, meters."""
LARGE = 0.2
"""Footprint of large furniture, square meters."""
TALL, DEEP = 1.2, 0.25
"""Least height and depth of furniture whose front matters, meters."""
STEEPEST = 68.0
"""Greatest angle above the horizontal from which the camera looks, degrees."""
HEIGHT = 180
"""Height of the picture in which pixels of furniture are counted."""
FEWEST = 3
"""Pixels of that picture from which on a piece is seen."""


@lru_cache(maxsize=CACHED)
def overview(floor: Floor) -> View:
    """Return the view from outside and above in which the floor fills most of a wide picture.

    The upper parts of the walls that would hide a space are not drawn in it.
    """
    outline = _outline(floor)
    best = best_bearing(floor)
    pitch = max(PITCHES, key=lambda pitch: _value(floor, outline, best, pitch))
    return _view(floor, outline, best, pitch)[0]


@lru_cache(maxsize=CACHED)
def best_bearing(floor: Floor, fronts: tuple[tuple[float, float], ...] = ()) -> float:
    """Return the direction from a floor to the camera of its overview, degrees.

    Args:
        fronts: direction and area of the fronts of furniture; a view that looks at them is better.
    """
    outline, total = _outline(floor), sum(area for _, area in fronts)

    def value(bearing: float) -> float:
        turn = math.radians(bearing)
        seen = sum(area * math.cos(front - turn) for front, area in fronts) / total if total else 0.0
        return _value(floor, outline, bearing, PITCHES[0]) * (1.0 + FRONTS * seen)

    return max(BEARINGS, key=value)


def overview_from(floor: Floor, bearing: float, pitch: float) -> View:
    """Return the nearest view in a direction that holds the floor, from a bearing and a pitch in degrees."""
    return _view(floor, _outline(floor), bearing, pitch)[0]


def _outline(floor: Floor) -> shapely.Geometry:
    return region_outline([*(box for space in floor.spaces for box in space.boxes), *(w.box for w in floor.walls)])


def _value(floor: Floor, outline: shapely.Geometry, bearing: float, pitch: float) -> float:
    """Return how good a direction is, at most 1."""
    view, walls = _view(floor, outline, bearing, pitch)
    ground = shapely.transform(outline, lambda points: view.project(_at(points, 0.0)))
    drawn = union([ground, *(shapely.Polygon(view.project(wall)) for wall in walls)], GRID_M)
    loss = STRAIGHT * (bearing % 90.0 == 0.0) + ASIDE * (abs(bearing - FRONT) > FRONTAL)
    return float(drawn.area) / (4.0 * WIDE) * (1.0 - loss - STEEP * (pitch - PITCHES[0]))


def _view(floor: Floor, outline: shapely.Geometry, bearing: float, pitch: float) -> tuple[View, list[Array]]:
    """Return the nearest view in a direction that holds the floor and the walls that it draws to their tops.

    The walls are rectangles (4, 3) along their middle lines.
    """
    x0, y0, x1, y1 = floor.bounds
    turn = math.radians(bearing)
    eye = (x0 + x1) / 2.0 + FAR * math.cos(turn), (y0 + y1) / 2.0 + FAR * math.sin(turn)
    hidden = near_walls(floor, *eye)
    tall = [wall for k, wall in enumerate(floor.walls) if upper(wall_name(k)) not in hidden]
    tops = [_at(wall.box.corners(), wall.height) for wall in tall]
    points = np.concatenate([_at(shapely.get_coordinates(outline), 0.0), *tops])
    ends = [np.array([wall.start, wall.end]) for wall in tall]
    walls = [
        np.concatenate([_at(line, 0.0), _at(line[::-1], wall.height)]) for line, wall in zip(ends, tall, strict=True)
    ]
    return fitted(points, turn, math.radians(pitch), FOVY), walls


def _at(points: Array, z: float) -> Array:
    """Return points (n, 2) of the plane at a height, shape (n, 3)."""
    return np.column_stack([points, np.full(len(points), z)])


def clear_overview(layout: Layout) -> View:
    """Return the overview of a furnished floor.

    It looks at the fronts of most tall furniture. Of several angles it takes the flattest from which the most pieces
    of furniture are seen.
    """
    bearing = best_bearing(layout.floor, _fronts(layout))
    views = [overview_from(layout.floor, bearing, pitch) for pitch in (*PITCHES, STEEPEST)]
    mesh = scene_mesh(layout, hidden_walls(layout.floor, views[0].position))
    eyes = Eyes(mesh)
    furniture = large_furniture(layout)
    size, owners = (round(HEIGHT * WIDE), HEIGHT), len(layout.placements)
    counts = [int((eyes.pixels(view, size, owners)[furniture] >= FEWEST).sum()) for view in views]
    return views[int(np.argmax(counts))]


def large_furniture(layout: Layout) -> list[int]:
    """Return the indices of the placements on the floor that are larger than a stool or a carton."""
    boxes = {k: layout.box(each.id) for k, each in enumerate(layout.placements) if each.support == FLOOR}
    return [k for k, box in boxes.items() if box.width * box.depth > LARGE]


def _fronts(layout: Layout) -> tuple[tuple[float, float], ...]:
    """Return direction and area of the fronts of tall furniture, radians and square meters."""
    boxes = [layout.box(placement.id) for placement in layout.placements if placement.support == FLOOR]
    tall = [box for box in boxes if box.z1 > TALL and box.depth > DEEP]
    return tuple((round(box.yaw + math.pi / 2.0, 3), round(box.width * box.z1, 2)) for box in tall)


class Eyes:
    """Counts what is seen of a mesh; each of its faces is opaque."""

    def __init__(self, mesh: SceneMesh) -> None:
        flat = np.zeros((len(mesh.faces), 3, 3), dtype=np.float32)
        self._surfaces = Surfaces(mesh, np.arange(len(mesh.faces)), flat)

    def pixels(self, view: View, size: tuple[int, int], owners: int) -> NDArray[np.int64]:
        """Return how many pixels of a picture of a size, (width, height), show each of the owners, shape (owners,)."""
        width, height = size
        x, y = np.meshgrid((np.arange(width) + 0.5) / width * 2.0 - 1.0, 1.0 - (np.arange(height) + 0.5) / height * 2.0)
        tall = math.tan(math.radians(view.fovy) / 2.0)
        right, up, backward = view.axes()
        rays = x.reshape(-1, 1) * tall * width / height * right + y.reshape(-1, 1) * tall * up - backward
        rays /= np.linalg.norm(rays, axis=1, keepdims=True)
        eye = np.tile(np.array(view.position, dtype=np.float32), (len(rays), 1))
        hits = self._surfaces.cast(eye, np.ascontiguousarray(rays, dtype=np.float32), smooth=False)
        seen = hits.owner[hits.hit & (hits.owner != ROOM)]
        return np.bincount(seen, minlength=owners)
