"""Lights of a stage: ceiling panels, and a dome for the light that walls and ceiling would reflect."""

from __future__ import annotations

import math
from typing import Any

from labgym.layouts.floor import Floor
from labgym.scenes.ceiling import PANEL, panels

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
