"""Cameras of a layout."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from labgym.errors import check_name
from labgym.geometry import to_world
from labgym.layouts import Layout
from labgym.layouts.floor import Doorway, Floor, Space
from labgym.layouts.placement import FLOOR
from labgym.navigation.clearance import Obstacles
from labgym.scenes.camera import EYE_HEIGHT, WIDE, Array, View, subtended
from labgym.scenes.floor_covering import region_outline
from labgym.scenes.overview import clear_overview, overview

DOOR_FOVY, SPACE_FOVY, WIDEST = 62.0, 64.0, 85.0
"""Vertical fields of view, degrees."""
HIGH = 40.0
"""Least height of the camera that looks straight down, meters."""
CORNER, BELOW = 0.55, 0.6
"""Distances of a space's camera from two walls and from the ceiling, meters."""
CLOSE, SPACE_LENGTH = 1.6, 100.0
"""Distance from tall furniture at which a corner is avoided, and more than the length of any space, meters."""
STEP = 0.05
"""Spacing of the points of a line of sight that must lie in one space, meters."""
NEAREST = 0.3
"""Least distance between a camera and its target, meters."""
__all__ = ["View", "picture_view", "view", "views"]

TALL = 1.9
"""Furniture higher than this hides a space from a camera under the ceiling, meters."""


def floor_views(floor: Floor, tall: Obstacles) -> dict[str, View]:
    """Return the cameras of a floor: overview, topdown, a camera for each exit, and for each space.

    Args:
        tall: the furniture that would hide a space from a camera next to it under the ceiling.
    """
    x0, y0, x1, y1 = floor.bounds
    x, y, width, depth = (x0 + x1) / 2.0, (y0 + y1) / 2.0, x1 - x0, y1 - y0
    high = max(HIGH, 2.0 * math.hypot(width, depth))
    topdown = View((x, y, high), (x, y, 0.0), subtended(max(depth, width / WIDE) + 0.6, high))
    cameras = {"overview": overview(floor), "topdown": topdown}
    exits = [doorway for doorway in floor.doorways if doorway.exit]
    for k, doorway in enumerate(exits):
        cameras["door" if k == 0 else f"door_{k + 1}"] = _from_exit(floor, doorway)
    for space in floor.spaces:
        cameras[f"space/{space.id}"] = _under_ceiling(space, tall)
    return cameras


def inside(floor: Floor, view: View) -> View:
    """Return a view of something in a space from within that space: nearer, and with a wider field, if need be."""
    eye, target = np.array(view.position), np.array(view.target)
    space = floor.space_at(float(target[0]), float(target[1]))
    if space is None:
        return view
    length = float(np.linalg.norm(eye[:2] - target[:2]))
    along = np.arange(NEAREST, length, STEP) / length
    points = target[:2] + along[:, None] * (eye[:2] - target[:2])
    free = space.contains(points)
    if free.all() and space.contains(eye[None, :2])[0]:
        return view
    share = float(along[max(int(free.argmin()) - 3, 0)])
    x, y = (target[:2] + share * (eye[:2] - target[:2])).tolist()
    wider = math.degrees(2.0 * math.atan(math.tan(math.radians(view.fovy) / 2.0) / share))
    return replace(view, position=(x, y, view.position[2]), fovy=min(wider, WIDEST))


def _from_exit(floor: Floor, doorway: Doorway) -> View:
    """Return what a person in an exit sees, who looks between straight ahead and the middle of the space."""
    space = floor.space(doorway.spaces[0])
    x, y, yaw = doorway.side(space.id)
    ahead = np.array([-math.sin(yaw), math.cos(yaw)])
    eye = np.array([x, y]) + 0.15 * ahead
    target = (np.array([x, y]) + 4.0 * ahead + _middle(space)) / 2.0
    return View((float(eye[0]), float(eye[1]), EYE_HEIGHT), (float(target[0]), float(target[1]), 1.0), DOOR_FOVY)


def _under_ceiling(space: Space, tall: Obstacles) -> View:
    """Return the view from a corner under the ceiling far from the middle of a space and from tall furniture."""
    corners = [(x, y) for r in space.region for x in _inset(r.x0, r.x1) for y in _inset(r.y0, r.y1)]
    points, middle = to_world(corners, space.frame), _middle(space)
    blocked = tall.nearest(points) < CLOSE
    eye = points[int((np.linalg.norm(points - middle, axis=1) - SPACE_LENGTH * blocked).argmax())]
    target = (float(middle[0]), float(middle[1]), 0.8)
    return View((float(eye[0]), float(eye[1]), space.ceiling - BELOW), target, SPACE_FOVY)


def _inset(low: float, high: float) -> tuple[float, float]:
    """Return two places at a distance from the ends of an interval, in its middle if it is short."""
    inset = min(CORNER, (high - low) / 2.0)
    return low + inset, high - inset


def _middle(space: Space) -> Array:
    """Return the centroid of a space, shape (2,)."""
    centroid = region_outline(space.boxes).centroid
    return np.array([centroid.x, centroid.y])


def views(layout: Layout) -> dict[str, View]:
    """Return the cameras of a layout by name.

    `overview` looks into the floor from outside and above, `topdown` from far above, and `door`, `door_2`, ... from the
    exits. `space/<id>` looks into each space from under its ceiling. Each placement on the floor that has surfaces has
    a camera with its id in front of it.
    """
    cameras = floor_views(layout.floor, Obstacles(box for box in layout.obstacles(TALL) if box.z1 > TALL))
    for placement in layout.placements:
        if placement.support == FLOOR and layout.asset(placement.id).surfaces:
            cameras.setdefault(placement.id, inside(layout.floor, _frontal(layout, placement.id)))
    return cameras


def view(layout: Layout, name: str) -> View:
    """Return a camera by name.

    Raises:
        UnknownNameError: no camera has that name.
    """
    cameras = views(layout)
    check_name("camera", name, cameras)
    return cameras[name]


def picture_view(layout: Layout, name: str) -> View:
    """Return the camera of a picture by name: that of `views`, but a clearer overview.

    The overview of a scene depends on the floor alone; in pictures it looks at fronts and over tall furniture.

    Raises:
        UnknownNameError: no camera has that name.
    """
    return clear_overview(layout) if name == "overview" else view(layout, name)


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
