"""Cameras in the corners of a space, under its ceiling."""

from __future__ import annotations

import numpy as np

from labgym.geometry import to_world
from labgym.layouts.floor import Space
from labgym.navigation.clearance import Obstacles
from labgym.scenes.camera import Array, View
from labgym.scenes.floor_covering import region_outline

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
