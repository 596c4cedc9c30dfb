"""Geoms in the field of view of a free camera; MuJoCo itself draws every geom, also those behind the camera."""

from __future__ import annotations

import math

import mujoco
import numpy as np
from numpy.typing import NDArray


def in_view(model: mujoco.MjModel, data: mujoco.MjData, camera: mujoco.MjvCamera, aspect: float) -> NDArray[np.bool_]:
    """Return which geoms' bounding spheres reach into a free camera's field of view, shape (ngeom,).

    Planes have no bounding sphere and always count as in view.

    Args:
        camera: a free camera; its vertical field of view is the model's `vis.global_.fovy`.
        aspect: width of the picture over its height.
    """
    azimuth, elevation = math.radians(camera.azimuth), math.radians(camera.elevation)
    forward = np.array(
        [math.cos(elevation) * math.cos(azimuth), math.cos(elevation) * math.sin(azimuth), math.sin(elevation)]
    )
    right = np.array([math.sin(azimuth), -math.cos(azimuth), 0.0])
    axes = np.stack([right, np.cross(right, forward), forward])
    eye = np.array(camera.lookat) - camera.distance * forward
    # Coordinates along right, up and forward; the four side planes pass through the eye.
    local = (data.geom_xpos - eye) @ axes.T
    radius = model.geom_rbound
    tall = math.tan(math.radians(model.vis.global_.fovy) / 2.0)
    inside = local[:, 2] > -radius
    for axis, slope in ((0, tall * aspect), (1, tall)):
        inside &= np.abs(local[:, axis]) - local[:, 2] * slope < radius * math.hypot(1.0, slope)
    visible: NDArray[np.bool_] = inside | (model.geom_type == mujoco.mjtGeom.mjGEOM_PLANE)
    return visible
