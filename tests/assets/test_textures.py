"""Textures repeat without a seam, keep the color of their material, and are the same in every process."""

from __future__ import annotations

import hashlib
import io
import os
import subprocess
import sys

import numpy as np
import pytest
from PIL import Image

from labgym.assets.shapes import MATERIALS
from labgym.assets.textures import decoded, encoded, surface_coordinates, texture
from labgym.assets.textures.patterns import brushed_metal, chips, cloud, relief, speckles, wood
from labgym.assets.textures.texture import RECIPES, image

JOINTED = ("floor_tile", "ceiling")
"""Textures whose edges lie in a joint."""


def linear(channel: np.ndarray) -> np.ndarray:
    """sRGB from 0 to 1 to linear light by the formula of IEC 61966-2-1."""
    return np.where(channel <= 0.04045, channel / 12.92, ((channel + 0.055) / 1.055) ** 2.4)


@pytest.mark.cases(12)
@pytest.mark.parametrize("name", RECIPES)
def test_the_mean_of_a_texture_is_the_color_of_its_material(name: str) -> None:
    picture = texture(name)
    assert picture is not None
    assert picture.pixels.dtype == np.uint8
    size = len(picture.pixels)
    assert picture.pixels.shape == (size, size, 3)
    assert size & (size - 1) == 0
    assert 0.1 <= picture.period <= 5.0
    color = linear(np.array(MATERIALS[name].rgba[:3]))
    assert 0.0 <= picture.linear.min() <= picture.linear.max() <= 1.0
    assert linear(picture.pixels / 255.0).mean(axis=(0, 1)) == pytest.approx(color, rel=0.01)


@pytest.mark.parametrize("name", RECIPES)
def test_opposite_edges_of_a_texture_match(name: str) -> None:
    """Neighbors across the seam differ no more than neighbors anywhere else in the same direction."""
    picture = texture(name)
    assert picture is not None
    pixels = picture.pixels.astype(float)
    for axis in (0, 1):
        inner = np.abs(np.diff(pixels, axis=axis)).mean(axis=(1 - axis, 2))
        seam = np.abs(np.take(pixels, 0, axis=axis) - np.take(pixels, -1, axis=axis)).mean()
        assert seam <= inner.max() + 1.0
        if name not in JOINTED:
            assert seam <= 2.0 * inner.mean() + 1.0


def test_textures_have_the_same_bytes_in_another_process() -> None:
    names = ["floor_terrazzo", "oak", "wall_paint"]
    program = (
        "import sys, hashlib; from labgym.assets.textures import texture;"
        "print(hashlib.sha256(b''.join(texture(name).png for name in sys.argv[1:])).hexdigest())"
    )
    environment = {**os.environ, "PYTHONHASHSEED": "4321"}
    command = [sys.executable, "-c", program, *names]
    there = subprocess.run(command, check=True, capture_output=True, text=True, env=environment, timeout=600)
    here = hashlib.sha256(b"".join(texture(name).png for name in names)).hexdigest()  # type: ignore[union-attr]
    assert there.stdout.strip() == here


def test_a_texture_is_small_as_a_file_and_reads_back_as_its_pixels() -> None:
    for name in ("floor_vinyl", "floor_terrazzo", "oak", "stainless"):
        picture = texture(name)
        assert picture is not None
        content = picture.png
        assert len(content) < 150_000
        assert (np.asarray(Image.open(io.BytesIO(content))) == picture.pixels).all()


def test_materials_without_a_recipe_have_no_texture() -> None:
    assert texture("borosilicate") is None
    assert set(RECIPES) <= set(MATERIALS)


def test_a_pattern_brighter_than_white_is_cut_off_without_changing_the_mean() -> None:
    color = np.array([0.9, 0.5, 0.02])
    pixels = image(wood, np.random.default_rng(1), 128, color, contrast=3.0)
    assert linear(pixels / 255.0).mean(axis=(0, 1)) == pytest.approx(color, rel=0.02)


def test_colors_survive_the_round_trip_to_linear_light() -> None:
    values = np.arange(256.0)
    assert decoded(values) == pytest.approx(linear(values / 255.0), abs=1e-12)
    assert encoded(decoded(values)) * 255.0 == pytest.approx(values, abs=1e-9)


def test_noise_has_the_scale_and_the_share_that_it_is_given() -> None:
    generator = np.random.default_rng(5)
    long, short = cloud(generator, 128, 0.1), cloud(generator, 128, 0.02)
    for field in (long, short):
        assert (field.mean(), field.std()) == pytest.approx((0.0, 1.0), abs=1e-9)
    assert np.abs(np.diff(long, axis=1)).mean() < 0.4 * np.abs(np.diff(short, axis=1)).mean()
    assert speckles(generator, 128, 0.02, 0.1).mean() == pytest.approx(0.1, abs=0.005)
    assert relief(long, 0.05).mean() == pytest.approx(1.0, abs=1e-9)
    cells, edge = chips(generator, 64, 40)
    assert set(np.unique(cells)) <= set(range(40))
    assert edge.min() >= 0.0


def test_metal_is_brushed_along_the_rows() -> None:
    field = brushed_metal(np.random.default_rng(2), 128)
    assert np.abs(np.diff(field, axis=1)).mean() < 0.3 * np.abs(np.diff(field, axis=0)).mean()


def test_texture_coordinates_are_lengths_on_the_surface() -> None:
    """Two points of a plane are as far apart in the texture as in space, whichever way the plane looks."""
    rng = np.random.default_rng(3)
    for normal in ((0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (0.6, 0.8, 0.0), (-1.0, 0.0, 0.0)):
        towards = np.array(normal)
        points = rng.normal(size=(2, 50, 3))
        points -= (points @ towards)[..., None] * towards
        for upright in (False, True):
            first, second = (surface_coordinates(p, np.tile(towards, (50, 1)), upright) for p in points)
            apart = np.linalg.norm(points[0] - points[1], axis=1)
            assert np.linalg.norm(first - second, axis=1) == pytest.approx(apart)


def test_the_grain_of_upright_textures_runs_upwards() -> None:
    points, normals = np.array([[0.3, 0.0, 1.2]]), np.array([[0.0, -1.0, 0.0]])
    assert surface_coordinates(points, normals)[0] == pytest.approx([0.3, 1.2])
    assert surface_coordinates(points, normals, upright=True)[0] == pytest.approx([1.2, 0.3])
