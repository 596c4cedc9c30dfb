"""The overview of a furnished floor: it looks at fronts, and is as steep as it takes to see all furniture."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from labgym.layouts import Layout
from labgym.layouts.placement import FLOOR
from labgym.scenes.camera import WIDE, View
from labgym.scenes.cutaway import hidden_walls
from labgym.scenes.mesh import ROOM, SceneMesh, scene_mesh
from labgym.scenes.overview import PITCHES, best_bearing, overview_from
from labgym.scenes.surfaces import Surfaces

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
    counts = [int((eyes.pixels(view, HEIGHT, len(layout.placements))[furniture] >= FEWEST).sum()) for view in views]
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
    """Counts what is seen of a mesh."""

    def __init__(self, mesh: SceneMesh) -> None:
        flat = np.zeros((len(mesh.faces), 3, 3), dtype=np.float32)
        self._surfaces = Surfaces(mesh, np.arange(len(mesh.faces)), flat)

    def pixels(self, view: View, height: int, owners: int) -> NDArray[np.int64]:
        """Return how many pixels of a wide picture show each of a number of owners, shape (owners,)."""
        width = round(height * WIDE)
        x, y = np.meshgrid((np.arange(width) + 0.5) / width * 2.0 - 1.0, 1.0 - (np.arange(height) + 0.5) / height * 2.0)
        tall = math.tan(math.radians(view.fovy) / 2.0)
        right, up, backward = view.axes()
        rays = x.reshape(-1, 1) * tall * WIDE * right + y.reshape(-1, 1) * tall * up - backward
        rays /= np.linalg.norm(rays, axis=1, keepdims=True)
        eye = np.tile(np.array(view.position, dtype=np.float32), (len(rays), 1))
        hits = self._surfaces.cast(eye, np.ascontiguousarray(rays, dtype=np.float32), smooth=False)
        seen = hits.owner[hits.hit & (hits.owner != ROOM)]
        return np.bincount(seen, minlength=owners)
