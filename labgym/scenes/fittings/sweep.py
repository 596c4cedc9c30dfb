"""Hoses and cables: round tubes along a path."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from labgym.assets.shapes.parts import UPRIGHT, Part, Vector

SIDES = 7
"""Sides of a hose."""
BEND = 4
"""Pieces of a rounded corner."""

Array = NDArray[np.float64]


def hose(material: str, diameter: float, path: Sequence[Vector]) -> Part:
    """Return a closed tube along a path of at least two different points, as one mesh.

    The cross-section is a regular polygon whose corners lie on the hose's surface; it does not twist.
    """
    points = np.array(path, dtype=np.float64)
    points = points[np.r_[True, np.linalg.norm(np.diff(points, axis=0), axis=1) > 1e-6]]
    along = np.diff(points, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    tangents = np.vstack([along[:1], along[:-1] + along[1:], along[-1:]])
    tangents /= np.maximum(np.linalg.norm(tangents, axis=1, keepdims=True), 1e-9)
    side = _cross(tangents[0], np.eye(3)[np.argmin(np.abs(tangents[0]))])
    angles = 2.0 * math.pi * np.arange(SIDES) / SIDES
    cosines, sines = np.cos(angles), np.sin(angles)
    rings = []
    for point, tangent in zip(points, tangents, strict=True):
        side = side - tangent * float(side @ tangent)
        side /= math.sqrt(float(side @ side))
        across = _cross(tangent, side)
        rings.append(point + diameter / 2.0 * (np.outer(cosines, side) + np.outer(sines, across)))
    vertices = np.vstack([*rings, points[:1], points[-1:]])
    middle = (vertices.min(axis=0) + vertices.max(axis=0)) / 2.0
    size = vertices.max(axis=0) - vertices.min(axis=0)
    return Part(
        "mesh",
        (float(size[0]), float(size[1]), float(size[2])),
        (float(middle[0]), float(middle[1]), float(middle[2])),
        UPRIGHT,
        material,
        triangles=(vertices - middle, _faces(len(points))),
    )


def rounded_path(points: Sequence[Vector], radius: float) -> list[Vector]:
    """Return a path whose corners are replaced by curves that begin at most `radius` meters before each corner."""
    corners = [np.array(point, dtype=np.float64) for point in points]
    path = [corners[0]]
    for before, corner, after in zip(corners, corners[1:], corners[2:], strict=False):
        back, on = before - corner, after - corner
        reach = min(radius, float(np.linalg.norm(back)) / 2.0, float(np.linalg.norm(on)) / 2.0)
        if reach < 1e-6:
            continue
        first = corner + back / np.linalg.norm(back) * reach
        last = corner + on / np.linalg.norm(on) * reach
        path += [_bezier(first, corner, last, k / BEND) for k in range(BEND + 1)]
    return [_vector(point) for point in [*path, corners[-1]]]


def curve(start: Vector, leaving: Vector, arriving: Vector, end: Vector, pieces: int = 14) -> list[Vector]:
    """Return a smooth path from `start` in the direction of the vector `leaving` to `end` along `arriving`.

    It is a cubic Bezier curve; the lengths of the two vectors, in meters, set how far it swings out.
    """
    a, d = np.array(start), np.array(end)
    b, c = a + np.array(leaving), d - np.array(arriving)
    steps = np.linspace(0.0, 1.0, pieces + 1)[:, None]
    rest = 1.0 - steps
    points = rest**3 * a + 3.0 * rest**2 * steps * b + 3.0 * rest * steps**2 * c + steps**3 * d
    return [_vector(point) for point in points]


def _cross(a: Array, b: Array) -> Array:
    """Return the vector product of two vectors (3,); `np.cross` takes ten times as long."""
    (ax, ay, az), (bx, by, bz) = a.tolist(), b.tolist()
    return np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])


def _bezier(first: Array, corner: Array, last: Array, step: float) -> Array:
    rest = 1.0 - step
    return np.asarray(rest * rest * first + 2.0 * rest * step * corner + step * step * last)


def _vector(point: Array) -> Vector:
    x, y, z = point.tolist()
    return x, y, z


def _faces(rings: int) -> NDArray[np.int64]:
    """Faces of a tube with that many rings of vertices, followed by the middles of its two ends."""
    faces: list[tuple[int, int, int]] = []
    first, last = rings * SIDES, rings * SIDES + 1
    for k in range(SIDES):
        after = (k + 1) % SIDES
        for ring in range(rings - 1):
            a, b = ring * SIDES + k, ring * SIDES + after
            faces += [(a, b, b + SIDES), (a, b + SIDES, a + SIDES)]
        end = (rings - 1) * SIDES
        faces += [(first, after, k), (last, end + k, end + after)]
    return np.array(faces, dtype=np.int64)
