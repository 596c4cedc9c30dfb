"""Lights of a stage: ceiling panels, and a dome for the light that walls and ceiling would reflect."""

from __future__ import annotations

import math
from typing import Any

from labgym.layouts import Room

PANEL = (1.2, 0.6)
"""Width and depth of a ceiling panel, meters."""
PITCH = 2.4
"""Largest distance between the centers of neighboring panels, meters; larger if there would be too many panels."""
MOST_PANELS = 64
GAP = 0.02
"""Distance of the panels below the ceiling height, meters."""
ILLUMINANCE = 1000.0
"""Luminous flux of all panels over the floor area, lux: twice the 500 lux that EN 12464-1 requires in laboratories."""
DOME = 500.0
"""Luminance of the dome, nits."""


def write_lights(stage: Any, path: str, room: Room) -> None:
    """Define the lights of a room under a path. Intensities are nits, as UsdLux and path tracers take them."""
    from pxr import Gf, UsdGeom, UsdLux

    UsdGeom.Scope.Define(stage, path)
    UsdLux.DomeLight.Define(stage, f"{path}/Dome").CreateIntensityAttr(DOME)
    columns, rows = panel_grid(room)
    luminance = ILLUMINANCE * room.width * room.depth / (math.pi * PANEL[0] * PANEL[1] * columns * rows)
    for k in range(columns * rows):
        x, y = (k % columns + 0.5) / columns * room.width, (k // columns + 0.5) / rows * room.depth
        light = UsdLux.RectLight.Define(stage, f"{path}/Panel_{k}")
        light.CreateWidthAttr(PANEL[0])
        light.CreateHeightAttr(PANEL[1])
        light.CreateIntensityAttr(round(luminance, 1))
        light.CreateExtentAttr(
            [Gf.Vec3f(-PANEL[0] / 2.0, -PANEL[1] / 2.0, 0.0), Gf.Vec3f(PANEL[0] / 2.0, PANEL[1] / 2.0, 0.0)]
        )
        # A rectangular light shines along its own -z, which points down.
        light.AddTranslateOp().Set(Gf.Vec3d(x, y, room.height - GAP))


def panel_grid(room: Room) -> tuple[int, int]:
    """Return the numbers of ceiling panels along the width and along the depth of a room."""
    pitch = max(PITCH, math.sqrt(room.width * room.depth / MOST_PANELS))
    return max(1, round(room.width / pitch)), max(1, round(room.depth / pitch))
