"""Lights of a stage: ceiling panels, and a dome for the light that walls and ceiling would reflect."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from labgym.geometry import to_world
from labgym.layouts.floor import Floor, Space
from labgym.scenes.floor_covering import region_outline

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
DOME = 500.0
"""Luminance of the dome, nits."""


def write_lights(stage: Any, path: str, floor: Floor) -> None:
    """Define the lights of a floor under a path. Intensities are nits, as UsdLux and path tracers take them."""
    from pxr import Gf, UsdGeom, UsdLux

    UsdGeom.Scope.Define(stage, path)
    UsdLux.DomeLight.Define(stage, f"{path}/Dome").CreateIntensityAttr(DOME)
    for k, panel in enumerate(panel for space in floor.spaces for panel in panels(space)):
        light = UsdLux.RectLight.Define(stage, f"{path}/Panel_{k}")
        light.CreateWidthAttr(PANEL[0])
        light.CreateHeightAttr(PANEL[1])
        light.CreateIntensityAttr(round(panel.luminance, 1))
        light.CreateExtentAttr(
            [Gf.Vec3f(-PANEL[0] / 2.0, -PANEL[1] / 2.0, 0.0), Gf.Vec3f(PANEL[0] / 2.0, PANEL[1] / 2.0, 0.0)]
        )
        # A rectangular light shines along its own -z, which points down.
        light.AddTranslateOp().Set(Gf.Vec3d(panel.x, panel.y, panel.z))
        if panel.yaw:
            light.AddRotateZOp(UsdGeom.XformOp.PrecisionDouble).Set(math.degrees(panel.yaw))


@dataclass(frozen=True)
class Panel:
    """A ceiling panel: middle and yaw in the floor's frame, meters and radians; luminance in nits."""

    x: float
    y: float
    z: float
    yaw: float
    luminance: float


def panels(space: Space) -> Iterator[Panel]:
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
        yield Panel(x, y, space.ceiling - GAP, space.yaw, luminance)


def panel_grid(width: float, depth: float, most: int = MOST_PANELS) -> tuple[int, int]:
    """Return the numbers of ceiling panels along the width and along the depth of a rectangle."""
    pitch = max(PITCH, math.sqrt(width * depth / most))
    return max(1, round(width / pitch)), max(1, round(depth / pitch))
