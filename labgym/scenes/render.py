"""Pictures of layouts and of assets."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from labgym.assets import Asset
from labgym.errors import OptionError, check_name
from labgym.layouts import Layout
from labgym.scenes.mesh import SceneMesh, asset_mesh
from labgym.scenes.opengl import render_opengl
from labgym.scenes.tracing import trace, trace_mesh
from labgym.scenes.views import View

RENDERERS = ("traced", "opengl")


def render(
    layout: Layout,
    width: int = 1280,
    height: int = 720,
    camera: str = "overview",
    renderer: Literal["traced", "opengl"] = "traced",
) -> NDArray[np.uint8]:
    """Return a picture of a layout, shape (height, width, 3).

    Walls between the camera and the room are omitted, together with the placements mounted on them.

    Args:
        camera: a name of `labgym.scenes.views.views`: overview, topdown, door, or a workplace's placement id.
        renderer: "traced" has soft light and needs no OpenGL; "opengl" is MuJoCo's own and faster on a GPU.

    Raises:
        UnknownNameError: the camera or the renderer does not exist.
        OptionError: a size that is not positive, or larger than 3840 x 2160 (OpenGL: 2560 x 1440).
        MissingRendererError: the renderer is "opengl" and OpenGL is not available.
    """
    check_name("renderer", renderer, RENDERERS)
    draw = trace if renderer == "traced" else render_opengl
    return draw(layout, width, height, camera)


def asset_sheet(assets: Sequence[Asset], columns: int = 8, tile: int = 220) -> NDArray[np.uint8]:
    """Return a picture of assets in rows of square tiles, each with its name.

    Args:
        columns: number of tiles in a row. tile: side of a tile, pixels.

    Returns:
        A picture of shape (rows * tile, columns * tile, 3).

    Raises:
        OptionError: no assets.
    """
    if not assets:
        raise OptionError("an asset sheet needs at least one asset")
    rows = -(-len(assets) // columns)
    sheet = np.full((rows * tile, columns * tile, 3), 255, dtype=np.uint8)
    for k, asset in enumerate(assets):
        top, left = k // columns * tile, k % columns * tile
        sheet[top : top + tile, left : left + tile] = _portrait(asset, tile)
        _write(sheet, asset.name, left + 6, top + tile - 8, tile - 12)
    return sheet


def _portrait(asset: Asset, side: int) -> NDArray[np.uint8]:
    """Return a square picture of an asset from the front left and above."""
    w, d, h = asset.size.width, asset.size.depth, asset.size.height
    reach = 0.5 * math.sqrt(w * w + d * d + h * h)
    eye = (1.9 * reach, 3.1 * reach, h / 2.0 + 1.7 * reach)
    local = asset_mesh(asset)
    mesh = SceneMesh(local.vertices, local.faces, local.material, np.zeros(len(local.faces), dtype=np.int64))
    return trace_mesh(mesh, View(eye, (0.0, 0.0, h / 2.0), 28.0), side, side, samples=6)


def _write(picture: NDArray[np.uint8], text: str, left: int, base: int, width: int) -> None:
    """Write a line of text into a picture, shrunk to fit a width in pixels."""
    import cv2

    font, scale = cv2.FONT_HERSHEY_SIMPLEX, 0.42
    (length, _), _ = cv2.getTextSize(text, font, scale, 1)
    scale *= min(1.0, width / length)
    cv2.putText(picture, text, (left, base), font, scale, (40, 50, 60), 1, cv2.LINE_AA)
