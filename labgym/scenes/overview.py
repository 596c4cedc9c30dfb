"""The camera that shows a whole floor from outside and above."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
import shapely

from labgym.geometry.polygons import GRID_M, union
from labgym.layouts.floor import Floor
from labgym.scenes.camera import WIDE, Array, View, fitted
from labgym.scenes.cutaway import CACHED, near_walls
from labgym.scenes.floor_covering import region_outline
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
