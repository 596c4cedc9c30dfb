"""Cameras of a layout."""

from __future__ import annotations

from labgym.errors import UnknownNameError
from labgym.layouts import Layout
from labgym.layouts.placement import FLOOR
from labgym.navigation.clearance import Obstacles
from labgym.scenes.camera import View
from labgym.scenes.clear_overview import clear_overview
from labgym.scenes.floor_views import floor_views, inside

__all__ = ["View", "picture_view", "view", "views"]

TALL = 1.9
"""Furniture higher than this hides a space from a camera under the ceiling, meters."""


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
    if name not in cameras:
        raise UnknownNameError("camera", name, cameras)
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
