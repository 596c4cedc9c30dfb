"""Pictures show the scene, are well exposed and reproducible; traced ones need no OpenGL."""

from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest
import trimesh

from labgym.assets import Catalog
from labgym.assets.meshes.normals import corner_normals
from labgym.errors import OptionError, UnknownNameError
from labgym.layouts import Layout, Room
from labgym.scenes import MissingRendererError, asset_sheet, make_renderer, render, to_mjcf
from labgym.scenes.tracing import smooth_light
from labgym.scenes.views import picture_view

WIDTH, HEIGHT = 320, 180


def picture(layout: Layout, camera: str, renderer: str) -> np.ndarray:
    """A picture, or a skip where OpenGL is asked for and there is none."""
    try:
        return render(layout, WIDTH, HEIGHT, camera, renderer)  # type: ignore[arg-type]
    except MissingRendererError as error:
        pytest.skip(str(error))


def pixel(layout: Layout, camera: str, point: tuple[float, float, float]) -> tuple[int, int]:
    """Row and column where a pinhole camera shows a point."""
    view = picture_view(layout, camera)
    x, y, z = view.axes() @ (np.array(point) - np.array(view.position))
    scale = HEIGHT / 2.0 / math.tan(math.radians(view.fovy / 2.0))
    return round(HEIGHT / 2.0 + scale * y / z), round(WIDTH / 2.0 - scale * x / z)


@pytest.mark.cases(1)
@pytest.mark.parametrize("renderer", ["traced", "opengl"])
@pytest.mark.parametrize("camera", ["overview", "door"])
def test_a_yellow_cabinet_is_yellow_where_it_stands(laboratory: Layout, camera: str, renderer: str) -> None:
    image = picture(laboratory, camera, renderer)
    row, column = pixel(laboratory, camera, (0.46, 2.30, 0.45))
    red, green, blue = image[row - 1 : row + 2, column - 1 : column + 2].reshape(-1, 3).mean(axis=0)
    assert red > 1.1 * green > 1.1 * 2.0 * blue


@pytest.mark.cases(3)
@pytest.mark.parametrize("renderer", ["traced", "opengl"])
@pytest.mark.parametrize("camera", ["overview", "topdown", "door", "bench"])
def test_pictures_are_neither_underexposed_nor_overexposed(laboratory: Layout, camera: str, renderer: str) -> None:
    tone = picture(laboratory, camera, renderer).astype(float).max(axis=2)
    assert np.mean(tone < 12.0) < 0.03
    assert np.mean(tone > 253.0) < 0.06
    assert tone.std() > 12.0


def test_both_renderers_show_the_same_scene(laboratory: Layout) -> None:
    traced, drawn = (
        picture(laboratory, "overview", renderer).astype(float).mean(axis=2) for renderer in ("traced", "opengl")
    )
    assert np.corrcoef(traced.ravel(), drawn.ravel())[0, 1] > 0.85


def test_the_same_layout_gives_the_same_picture(laboratory: Layout) -> None:
    assert (render(laboratory, 96, 54) == render(laboratory, 96, 54)).all()


def test_pictures_are_bytes_of_the_requested_size(laboratory: Layout) -> None:
    image = render(laboratory, 97, 41, "topdown")
    assert image.shape == (41, 97, 3)
    assert image.dtype == np.uint8


@pytest.mark.parametrize("renderer", ["traced", "opengl"])
def test_an_unknown_camera_lists_the_cameras(laboratory: Layout, renderer: str) -> None:
    with pytest.raises(UnknownNameError, match=r"'overvew' not found; nearest: overview"):
        render(laboratory, WIDTH, HEIGHT, "overvew", renderer)  # type: ignore[arg-type]


def test_unknown_renderers_and_empty_pictures_are_refused(laboratory: Layout) -> None:
    with pytest.raises(UnknownNameError, match="traced"):
        render(laboratory, renderer="ray-traced")  # type: ignore[arg-type]
    for width in (0, 100_000):
        with pytest.raises(OptionError, match="between 1x1 and 3840x2160"):
            render(laboratory, width=width)


def test_without_opengl_the_error_names_the_remedy(laboratory: Layout, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise ImportError("libEGL.so.1: cannot open shared object file")

    monkeypatch.setattr(mujoco, "Renderer", refuse)
    model = to_mjcf(laboratory).compile()
    with pytest.raises(MissingRendererError, match=r"libEGL.*apt install.*traced renderer"):
        make_renderer(model, 64, 64)


def test_pictures_beyond_the_off_screen_buffer_are_refused(laboratory: Layout) -> None:
    with pytest.raises(OptionError, match="2560x1440"):
        make_renderer(to_mjcf(laboratory).compile(), 4000, 100)


def test_the_middle_of_a_floor_is_brighter_than_its_edge_at_a_wall() -> None:
    """Ambient light falls towards the foot of a wall, and evenly so along it."""
    room = Layout(id="empty", floor=Room(width=8.0, depth=8.0, doors=()).floor, placements=())
    light = render(room, WIDTH, HEIGHT, "topdown").astype(float).mean(axis=2)
    middle, scale = HEIGHT / 2.0, HEIGHT / 8.6
    inner = light[
        round(middle - scale) : round(middle + scale), round(WIDTH / 2.0 - scale) : round(WIDTH / 2.0 + scale)
    ]
    foot = light[round(middle - scale) : round(middle + scale), round(WIDTH / 2.0 - 3.8 * scale)]
    assert np.median(inner) > np.median(foot) + 5.0


def test_asset_sheets_have_a_tile_for_each_asset() -> None:
    catalog = Catalog.load()
    sheet = asset_sheet([catalog.get(name) for name in ("Beaker", "FumeHood", "Acetone")], columns=2, tile=64)
    assert sheet.shape == (128, 128, 3)
    assert (sheet[64:, 64:] == 255).all()
    assert len(np.unique(sheet[:64, :64].reshape(-1, 3), axis=0)) > 50
    with pytest.raises(OptionError, match="at least one"):
        asset_sheet([])


def test_smoothing_keeps_even_light_and_edges_and_reduces_noise() -> None:
    rng = np.random.default_rng(1)
    normal = np.zeros((60, 80, 3), dtype=np.float32)
    normal[:, :40, 2], normal[:, 40:, 0] = 1.0, 1.0
    distance = np.full((60, 80), 3.0, dtype=np.float32)
    even = np.full((60, 80, 3), 0.7, dtype=np.float32)
    assert smooth_light(even, normal, distance) == pytest.approx(even, abs=1e-5)
    step = np.where(np.arange(80) < 40, 0.9, 0.2)[None, :, None] * np.ones((60, 80, 3))
    noisy = (step + rng.normal(0.0, 0.1, (60, 80, 1))).astype(np.float32)
    smooth = smooth_light(noisy, normal, distance)
    assert np.abs(smooth - step).mean() < 0.4 * np.abs(noisy - step).mean()
    assert smooth[:, 39].mean() == pytest.approx(0.9, abs=0.03)
    assert smooth[:, 40].mean() == pytest.approx(0.2, abs=0.03)


def test_corner_normals_follow_a_ball_and_keep_the_edges_of_a_box() -> None:
    ball = trimesh.creation.icosphere(subdivisions=3)
    normals = corner_normals(ball.vertices, ball.faces)
    assert np.abs(normals - ball.vertices[ball.faces]).max() < 0.02
    box = trimesh.creation.box()
    assert corner_normals(box.vertices, box.faces) == pytest.approx(np.repeat(box.face_normals[:, None], 3, axis=1))
