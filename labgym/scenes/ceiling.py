"""The ceilings of a floor, which only pictures from inside show: their tiles, and the panels of their lamps."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import shapely

from labgym.geometry import to_world
from labgym.layouts.floor import Floor, Space
from labgym.scenes.floor_covering import coverings, flat_mesh, region_outline
from labgym.scenes.patches import Patch, join

CEILING = "ceiling"
"""Name and material of the patches of ceilings."""
PANEL = (1.2, 0.6)
"""Width and depth of a ceiling panel, meters."""
PITCH = 2.4
"""Largest distance between the centers of neighboring panels, meters; larger if there would be too many panels."""
MOST_PANELS = 64
SMALL = 2.0
"""Rectangles of a region below this area have no panels, unless all are small, square meters."""
GAP = 0.02
"""Distance of the panels below the ceiling height, meters."""
ILLUMINANCE = 1000.0
"""Luminous flux of all panels over the floor area, lux: twice the 500 lux that EN 12464-1 requires in laboratories."""


@dataclass(frozen=True)
class CeilingPanel:
    """A ceiling panel: middle and yaw in the floor's frame, meters and radians; luminance in nits."""

    x: float
    y: float
    z: float
    yaw: float
    luminance: float


def panels(space: Space) -> Iterator[CeilingPanel]:
    """Yield the ceiling panels of a space: a grid over each large rectangle of its region."""
    areas = [(r.x1 - r.x0) * (r.y1 - r.y0) for r in space.region]
    lit = [r for r, area in zip(space.region, areas, strict=True) if area >= min(SMALL, max(areas))]
    places: list[tuple[float, float]] = []
    for rectangle in lit:
        width, depth = rectangle.x1 - rectangle.x0, rectangle.y1 - rectangle.y0
        columns, rows = panel_grid(width, depth, max(1, MOST_PANELS // len(lit)))
        for k in range(columns * rows):
            x, y = (k % columns + 0.5) / columns * width, (k // columns + 0.5) / rows * depth
            places.append((rectangle.x0 + x, rectangle.y0 + y))
    area = areas[0] if len(areas) == 1 else region_outline(space.boxes).area
    luminance = ILLUMINANCE * area / (math.pi * PANEL[0] * PANEL[1] * len(places))
    for x, y in to_world(places, space.frame).tolist():
        yield CeilingPanel(x, y, space.ceiling - GAP, space.yaw, luminance)


def panel_grid(width: float, depth: float, most: int = MOST_PANELS) -> tuple[int, int]:
    """Return the numbers of ceiling panels along the width and along the depth of a rectangle."""
    pitch = max(PITCH, math.sqrt(width * depth / most))
    return max(1, round(width / pitch)), max(1, round(depth / pitch))


def ceiling_patches(floor: Floor) -> Iterator[Patch]:
    """Yield the ceilings of all spaces, and the panels below them."""
    for space, outline in zip(floor.spaces, coverings(floor), strict=True):
        vertices, faces = join([flat_mesh(piece) for piece in shapely.get_parts(outline)])
        vertices[:, 2] = space.ceiling
        yield Patch(CEILING, f"{CEILING}/{space.id}", CEILING, vertices, faces[:, ::-1])
        meshes = []
        for panel in panels(space):
            corners = [(sx * PANEL[0] / 2.0, sy * PANEL[1] / 2.0) for sx, sy in ((-1, -1), (-1, 1), (1, 1), (1, -1))]
            ring = to_world(corners, (panel.x, panel.y, panel.yaw))
            meshes.append((np.column_stack([ring, np.full(4, panel.z)]), np.array([[0, 1, 2], [0, 2, 3]])))
        vertices, faces = join(meshes)
        yield Patch(CEILING, f"{CEILING}/{space.id}/panels", "lamp", vertices, faces)
