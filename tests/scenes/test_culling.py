"""Geoms that culling omits cover no pixel of the picture."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from labgym.layouts import Layout
from labgym.scenes import MissingRendererError, make_renderer, to_mjcf
from labgym.scenes.batches import in_view


@pytest.mark.parametrize(("azimuth", "elevation"), [(0.0, -20.0), (100.0, -40.0), (250.0, -75.0)])
def test_every_geom_that_a_picture_shows_is_in_view(laboratory: Layout, azimuth: float, elevation: float) -> None:
    model = to_mjcf(laboratory).compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    camera = mujoco.MjvCamera()
    camera.lookat, camera.distance, camera.azimuth, camera.elevation = (3.0, 2.5, 0.6), 1.5, azimuth, elevation
    try:
        renderer = make_renderer(model, 320, 240, "fast")
    except MissingRendererError as error:
        pytest.skip(str(error))
    with renderer:
        renderer.enable_segmentation_rendering()
        renderer.update_scene(data, camera)
        picture = renderer.render()
    drawn = np.unique(picture[picture[..., 1] == mujoco.mjtObj.mjOBJ_GEOM][:, 0])
    visible = in_view(model, data, camera, 320 / 240)
    assert len(drawn) > 5
    assert visible[drawn].all()
    assert visible.mean() < 0.7
