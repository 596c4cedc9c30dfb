"""Cameras of a layout."""

from __future__ import annotations

import math

import numpy as np

from labgym.errors import UnknownNameError
from labgym.layouts import Layout
from labgym.layouts.placement import FLOOR
from labgym.navigation.clearance import Obstacles
from labgym.scenes.camera import EYE_HEIGHT, FILL, WIDE, View, subtended
from labgym.scenes.clear_overview import clear_overview
from labgym.scenes.floor_views import floor_views, inside
from labgym.scenes.overview import overview

__all__ = ["View", "picture_view", "view", "views"]

TALL = 1.9
"""Furniture higher than this hides a space from a camera under the ceiling, meters."""


def views(layout: Layout) -> dict[str, View]:
    """Return the cameras of a layout by name.

    `overview` looks into the floor from outside and above, `topdown` from far above, and `door`, `door_2`, ... from the
    exits. On a floor that is not one rectangular room, `space/<id>` looks into each space from under its ceiling. Each
    placement on the floor that has surfaces has a camera with its id in front of it.
    """
    if not layout.floor.is_rectangle:
        cameras = floor_views(layout.floor, Obstacles(box for box in layout.obstacles(TALL) if box.z1 > TALL))
        for placement in layout.placements:
            if placement.support == FLOOR and layout.asset(placement.id).surfaces:
                frontal = _frontal(layout, placement.id)
                cameras.setdefault(placement.id, inside(layout.floor, frontal))
        return cameras
    room = layout.room
    w, d = room.width, room.depth
    cameras = {
        "overview": _overview(w, d, room.height),
        "topdown": View((w / 2.0, d / 2.0, 40.0), (w / 2.0, d / 2.0, 0.0), subtended(max(d, w * 0.6) + 0.6, 40.0)),
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


def picture_view(layout: Layout, name: str) -> View:
    """Return the camera of a picture by name: that of `views`, but a nearer or clearer overview.

    The overview in the MJCF scene of a rectangular room keeps its place, which leaves half of a picture empty. That of
    any other floor depends on the floor alone; in pictures it looks at fronts and over tall furniture.

    Raises:
        UnknownNameError: no camera has that name.
    """
    if name == "overview":
        return overview(layout.floor) if layout.floor.is_rectangle else clear_overview(layout)
    return view(layout, name)


def _overview(width: float, depth: float, height: float) -> View:
    """Return the view over the front right corner, as near as floor and far walls fit into a wide picture."""
    bearing, pitch, fovy = math.radians(-62.0), math.radians(38.0), 34.0
    target = np.array([width * 0.5, depth * 0.5, height * 0.27])
    back = np.array([math.cos(bearing) * math.cos(pitch), math.sin(bearing) * math.cos(pitch), math.sin(pitch)])
    axes = View((float(back[0]), float(back[1]), float(back[2])), (0.0, 0.0, 0.0), fovy).axes()
    floor = [(x, y, 0.0) for x in (0.0, width) for y in (0.0, depth)]
    far = [(0.0, 0.0, height), (0.0, depth, height), (width, depth, height)]
    local = (np.array(floor + far) - target) @ axes.T
    tall = math.tan(math.radians(fovy / 2.0)) * FILL
    distance = float(np.max(np.maximum(np.abs(local[:, 0]) / (tall * WIDE), np.abs(local[:, 1]) / tall) + local[:, 2]))
    x, y, z = (target + distance * back).tolist()
    return View((x, y, z), (float(target[0]), float(target[1]), float(target[2])), fovy)


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
