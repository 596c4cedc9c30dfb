"""A camera: where it is, where it looks, and how wide."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

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
