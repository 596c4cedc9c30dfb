"""Pictures by MuJoCo's own renderer, without a display."""

from __future__ import annotations

import math
import os
import sys
from collections.abc import Sequence

import mujoco
import numpy as np
from numpy.typing import NDArray

from labgym.assets import Asset
from labgym.errors import LabgymError, OptionError, UnknownNameError
from labgym.layouts import Layout, Room
from labgym.scenes.building import room_patches, walls_between
from labgym.scenes.mjcf import COLLISION_GROUP, SpecBuilder, add_camera, set_looks, to_mjcf
from labgym.scenes.views import View

LARGEST = (2560, 1440)
"""Largest picture, pixels: the off-screen buffer that compiled scenes ask for."""


class MissingRendererError(LabgymError):
    """This machine has no OpenGL that MuJoCo can draw with."""

    def __init__(self, reason: object) -> None:
        super().__init__(
            f"MuJoCo cannot draw here ({' '.join(str(reason).split())[:200]}); install an OpenGL library "
            "(Debian: apt install libegl1 libgl1-mesa-dri), or use labgym.scenes.trace, which needs none"
        )


def make_renderer(model: mujoco.MjModel, width: int, height: int) -> mujoco.Renderer:
    """Return MuJoCo's renderer, off-screen through EGL where there is no display and MUJOCO_GL is not set.

    Close it when done; a renderer belongs to the thread that made it.

    Raises:
        OptionError: the picture is larger than the model's off-screen buffer.
        MissingRendererError: there is no OpenGL.
    """
    largest = (model.vis.global_.offwidth, model.vis.global_.offheight)
    if not (1 <= width <= largest[0] and 1 <= height <= largest[1]):
        raise OptionError(f"picture size {width}x{height} is not between 1x1 and the model's {largest[0]}x{largest[1]}")
    try:
        _prefer_egl()
        return mujoco.Renderer(model, height, width, max_geom=20_000)
    except (ImportError, AttributeError, OSError, RuntimeError, mujoco.FatalError) as error:
        raise MissingRendererError(error) from error


def render(layout: Layout, width: int = 1280, height: int = 720, camera: str = "overview") -> NDArray[np.uint8]:
    """Return a picture of a layout by MuJoCo's renderer, shape (height, width, 3).

    Args:
        camera: a name of `labgym.scenes.views.views`: overview, topdown, door, or a workplace's placement id.

    Raises:
        UnknownNameError: there is no such camera.
        OptionError: larger than 2560 x 1440.
        MissingRendererError: there is no OpenGL.
    """
    model = to_mjcf(layout).compile()
    cameras = [model.camera(k).name for k in range(model.ncam)]
    if camera not in cameras:
        raise UnknownNameError("camera", camera, cameras)
    hidden = walls_between(layout.room, *model.camera(camera).pos[:2])
    for patch in room_patches(layout.room):
        if patch.wall in hidden:
            model.geom(patch.name).group = COLLISION_GROUP
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    with make_renderer(model, width, height) as renderer:
        renderer.update_scene(data, camera=camera)
        picture: NDArray[np.uint8] = renderer.render().copy()
    return picture


def asset_sheet(assets: Sequence[Asset], columns: int = 8, tile: int = 220) -> NDArray[np.uint8]:
    """Return a picture of assets in rows, each filling its tile and with its name, by MuJoCo's renderer.

    Args:
        columns: tiles in a row. tile: side of a tile, pixels.

    Returns:
        A picture of shape (rows * tile, columns * tile, 3).

    Raises:
        OptionError: no assets.
        MissingRendererError: there is no OpenGL.
    """
    if not assets:
        raise OptionError("an asset sheet needs at least one asset")
    model = _sheet_model(assets)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    rows = -(-len(assets) // columns)
    sheet = np.full((rows * tile, columns * tile, 3), 255, dtype=np.uint8)
    with make_renderer(model, tile, tile) as renderer:
        for k, asset in enumerate(assets):
            renderer.update_scene(data, camera=k)
            top, left = k // columns * tile, k % columns * tile
            sheet[top : top + tile, left : left + tile] = renderer.render()
            _write(sheet, asset.name, left + 6, top + tile - 8, tile - 12)
    return sheet


def _sheet_model(assets: Sequence[Asset]) -> mujoco.MjModel:
    """Assets in a row far apart on a white floor, each with a camera."""
    builder = SpecBuilder("assets")
    set_looks(builder.spec, Room(width=8.0, depth=8.0))
    for k, asset in enumerate(assets):
        w, d, h = asset.size.width, asset.size.depth, asset.size.height
        x, reach = 12.0 * k, 0.5 * math.sqrt(w * w + d * d + h * h)
        builder.add_asset(f"asset_{k}", asset, (x, 0.0, 0.0), 0.0)
        eye = (x + 1.6 * reach, 3.0 * reach, h / 2.0 + 1.7 * reach)
        view = View(eye, (x, 0.0, h / 2.0), 30.0)
        add_camera(builder.spec, f"asset_{k}", view)
    spec = builder.spec
    spec.stat.extent = 1.0
    spec.visual.map.znear, spec.visual.map.zfar = 0.002, 50.0
    return spec.compile()


def _write(picture: NDArray[np.uint8], text: str, left: int, base: int, width: int) -> None:
    """Write a line of text into a picture, shrunk to fit a width in pixels."""
    import cv2

    font, scale = cv2.FONT_HERSHEY_SIMPLEX, 0.42
    (length, _), _ = cv2.getTextSize(text, font, scale, 1)
    scale *= min(1.0, width / length)
    cv2.putText(picture, text, (left, base), font, scale, (40, 50, 60), 1, cv2.LINE_AA)


def _prefer_egl() -> None:
    """Let MuJoCo draw through EGL on a Linux machine without a display, unless MUJOCO_GL says otherwise.

    MuJoCo settles its backend when it is first imported, which is long past, so its choice is replaced.
    """
    displays = ("MUJOCO_GL", "DISPLAY", "WAYLAND_DISPLAY")
    if sys.platform == "linux" and not any(os.environ.get(name) for name in displays):
        from mujoco.egl import GLContext
        from mujoco.rendering.classic import gl_context

        gl_context.GLContext = GLContext
