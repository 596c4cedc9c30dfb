"""Cameras of a layout."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labgym.errors import UnknownNameError
from labgym.layouts import Layout
from labgym.layouts.model import FLOOR

Array = NDArray[np.float64]
Point = tuple[float, float, float]
EYE_HEIGHT = 1.6
"""Height of a standing person's eyes, meters."""
WIDE = 16.0 / 9.0
"""Aspect ratio of the pictures that the overview is fitted to: width over height."""


@dataclass(frozen=True)
class View:
    """A camera in the room frame.

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


def views(layout: Layout) -> dict[str, View]:
    """Return the cameras of a layout by name.

    `overview` looks into the room over a front corner, `topdown` from far above, and `door`, `door_2`, ... from the
    doorways. Each placement on the floor that has surfaces has a camera with its id in front of it.
    """
    room = layout.room
    w, d = room.width, room.depth
    cameras = {
        "overview": _overview(w, d, room.height),
        "topdown": View((w / 2.0, d / 2.0, 40.0), (w / 2.0, d / 2.0, 0.0), _subtended(max(d, w * 0.6) + 0.6, 40.0)),
    }
    for k, door in enumerate(room.doors):
        x, y, inward = {
            "front": (door.offset, 0.0, (0.0, 1.0)),
            "back": (door.offset, d, (0.0, -1.0)),
            "left": (0.0, door.offset, (1.0, 0.0)),
            "right": (w, door.offset, (-1.0, 0.0)),
        }[door.wall]
        start = (x + 0.15 * inward[0], y + 0.15 * inward[1], EYE_HEIGHT)
        # From a doorway near a corner, look towards the middle of the room rather than along the wall.
        middle = ((x + 4.0 * inward[0] + w / 2.0) / 2.0, (y + 4.0 * inward[1] + d / 2.0) / 2.0, 1.0)
        cameras["door" if k == 0 else f"door_{k + 1}"] = View(start, middle, 62.0)
    for placement in layout.placements:
        if placement.support == FLOOR and layout.asset(placement.id).surfaces:
            cameras.setdefault(placement.id, _frontal(layout, placement.id))
    return cameras


def view(layout: Layout, name: str) -> View:
    """Return a camera by name.

    Raises:
        UnknownNameError: no camera has that name.
    """
    cameras = views(layout)
    if name not in cameras:
        raise UnknownNameError("camera", name, cameras)
    return cameras[name]


def _overview(width: float, depth: float, height: float) -> View:
    """Return the view over the front right corner, as near as floor and far walls fit into a wide picture."""
    bearing, pitch, fovy = math.radians(-62.0), math.radians(38.0), 34.0
    target = np.array([width * 0.5, depth * 0.5, height * 0.27])
    back = np.array([math.cos(bearing) * math.cos(pitch), math.sin(bearing) * math.cos(pitch), math.sin(pitch)])
    axes = View((float(back[0]), float(back[1]), float(back[2])), (0.0, 0.0, 0.0), fovy).axes()
    floor = [(x, y, 0.0) for x in (0.0, width) for y in (0.0, depth)]
    far = [(0.0, 0.0, height), (0.0, depth, height), (width, depth, height)]
    local = (np.array(floor + far) - target) @ axes.T
    tall = math.tan(math.radians(fovy / 2.0)) * 0.96
    distance = float(np.max(np.maximum(np.abs(local[:, 0]) / (tall * WIDE), np.abs(local[:, 1]) / tall) + local[:, 2]))
    x, y, z = (target + distance * back).tolist()
    return View((x, y, z), (float(target[0]), float(target[1]), float(target[2])), fovy)


def _subtended(length: float, distance: float) -> float:
    return math.degrees(2.0 * math.atan2(length / 2.0, distance))


def _frontal(layout: Layout, placement_id: str) -> View:
    box, asset = layout.box(placement_id), layout.asset(placement_id)
    surface = asset.surfaces[0]
    workplace = surface.z >= 0.7
    z = box.z0 + (min(surface.z + 0.22, asset.size.height) if workplace else asset.size.height / 2.0)
    reach = asset.size.depth / 2.0 + max(1.2, asset.size.width * 0.85, 0.0 if workplace else asset.size.height * 1.1)
    aside = 0.35 * asset.size.width
    eye_x, eye_y = box.to_world(aside, reach)
    look_x, look_y = box.to_world(0.0, 0.0)
    return View((eye_x, eye_y, z + 0.55), (look_x, look_y, z), 50.0)
