"""The views of a layout as USD cameras."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from labgym.scenes.camera import WIDE, View
from labgym.scenes.usd.names import identifiers, write_note

SENSOR = 0.036
"""Width of a camera's sensor, meters."""
NEAR, FAR = 0.05, 200.0
"""Clipping distances, meters."""


def write_cameras(stage: Any, path: str, views: Mapping[str, View]) -> None:
    """Define a 16:9 camera for each view under a path, with the view's vertical field of view."""
    from pxr import Gf, UsdGeom

    UsdGeom.Scope.Define(stage, path)
    height = SENSOR / WIDE
    for identifier, (name, view) in zip(identifiers(list(views)), views.items(), strict=True):
        camera = UsdGeom.Camera.Define(stage, f"{path}/{identifier}")
        # Apertures and focal lengths are in tenths of the stage's unit.
        camera.CreateHorizontalApertureAttr(10.0 * SENSOR)
        camera.CreateVerticalApertureAttr(10.0 * height)
        camera.CreateFocalLengthAttr(10.0 * height / (2.0 * math.tan(math.radians(view.fovy) / 2.0)))
        camera.CreateClippingRangeAttr(Gf.Vec2f(NEAR, FAR))
        rows = [[*map(float, axis), 0.0] for axis in view.axes()]
        camera.AddTransformOp().Set(Gf.Matrix4d(*[value for row in [*rows, [*view.position, 1.0]] for value in row]))
        write_note(camera.GetPrim(), "view", name)
