"""A camera: where it is, where it looks, and how wide; and cameras in the corners of a space, under its ceiling."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labgym.geometry import to_world
from labgym.layouts.floor import Space
from labgym.navigation.clearance import Obstacles
from labgym.scenes.floor_covering import region_outline

Array = NDArray[np.float64]
Point = tuple[float, float, float]
EYE_HEIGHT = 1.6
"""Height of a standing person's eyes, meters."""
WIDE = 16.0 / 9.0
"""Aspect ratio of the pictures that the overview is fitted to: width over height."""
FILL = 0.96
"""Share of the width or height of a picture that a fitted camera fills."""


@dataclass(frozen=True)
class View:
    """A camera in the floor's frame.

    Attributes:
        position: of the camera. target: the point that it looks at, meters.
        fovy: vertical field of view, degrees.
    """

    position: Point
    target: Point
    fovy: float

    def axes(self) -> Array:
        """Return the camera's right, up and backward unit vectors, shape (3, 3); right is level."""
        backward = np.array(self.position) - np.array(self.target)
        backward /= np.linalg.norm(backward)
        up = np.array([0.0, 1.0, 0.0]) if abs(backward[2]) > 0.9999 else np.array([0.0, 0.0, 1.0])
        right = np.cross(up, backward)
        right /= np.linalg.norm(right)
        return np.stack([right, np.cross(backward, right), backward])

    def project(self, points: Array) -> Array:
        """Return where points (n, 3) are in a picture, shape (n, 2): 1 is half of its height, x right, y up."""
        local = (points - np.array(self.position)) @ self.axes().T
        return np.asarray(local[:, :2] / -local[:, 2:] / math.tan(math.radians(self.fovy) / 2.0))


def subtended(length: float, distance: float) -> float:
    """Return the angle in degrees at which a length appears at a distance."""
    return math.degrees(2.0 * math.atan2(length / 2.0, distance))


def fitted(points: Array, bearing: float, pitch: float, fovy: float, aspect: float = WIDE) -> View:
    """Return the nearest camera that has all points (n, 3) in its field of view.

    Args:
        bearing: direction from the points to the camera in the plane; pitch: its angle above the horizontal, radians.
        fovy: vertical field of view, degrees. aspect: width over height of the picture.
    """
    level = math.cos(pitch)
    back = (level * math.cos(bearing), level * math.sin(bearing), math.sin(pitch))
    axes = View(back, (0.0, 0.0, 0.0), fovy).axes()
    local = points @ axes.T
    tall = math.tan(math.radians(fovy) / 2.0) * FILL
    slopes = np.array([tall * aspect, tall])
    # A point is in view if |p - c| <= slope (distance - depth) along right and up, which is linear in the unknowns.
    high = (local[:, :2] + local[:, 2:] * slopes).max(axis=0)
    low = (-local[:, :2] + local[:, 2:] * slopes).max(axis=0)
    distance = float(((high + low) / (2.0 * slopes)).max())
    aside, up = ((high - low) / 2.0).tolist()
    position = np.array([aside, up, distance]) @ axes
    target = np.array([aside, up, float(local[:, 2].mean())]) @ axes
    (px, py, pz), (tx, ty, tz) = position.tolist(), target.tolist()
    return View((px, py, pz), (tx, ty, tz), fovy)


FOVY = 64.0
"""Vertical field of view, degrees."""
INSET, BELOW = 0.55, 0.6
"""Distances of a camera from two walls and from the ceiling, meters."""
CLOSE = 1.6
"""Distance from tall furniture under which a corner is avoided, meters."""


def corner_views(space: Space, tall: Obstacles, most: int) -> list[View]:
    """Return views from the corners of a space to its middle: free corners first, each far from those before.

    Args:
        tall: the furniture that would hide the space from a camera next to it.
        most: number of views; fewer if the space has fewer corners.
    """
    inset = [
        (_inside(x, r.x0, r.x1), _inside(y, r.y0, r.y1))
        for r in space.region
        for x in (r.x0, r.x1)
        for y in (r.y0, r.y1)
    ]
    corners = to_world(inset, space.frame)
    centroid = region_outline(space.boxes).centroid
    middle = np.array([centroid.x, centroid.y])
    blocked = tall.nearest(corners) < CLOSE
    chosen: list[int] = []
    while len(chosen) < min(most, len(corners)):
        apart = np.linalg.norm(corners - middle, axis=1)
        for index in chosen:
            apart = np.minimum(apart, np.linalg.norm(corners - corners[index], axis=1))
        rank = np.where(blocked, apart - 1e3, apart)
        rank[chosen] = -np.inf
        chosen.append(int(rank.argmax()))
    return [_view(corners[index], middle, space.ceiling - BELOW) for index in chosen]


def _inside(value: float, low: float, high: float) -> float:
    """Return a place between two walls at a distance from the nearer one, in the middle of a narrow space."""
    inset = min(INSET, (high - low) / 2.0)
    return min(max(value, low + inset), high - inset)


def _view(eye: Array, middle: Array, height: float) -> View:
    return View((float(eye[0]), float(eye[1]), height), (float(middle[0]), float(middle[1]), 0.8), FOVY)
