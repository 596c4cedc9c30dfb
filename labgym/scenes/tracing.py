"""Pictures by ray tracing on the CPU.

Reasons for a separate ray tracer: documentation and reports need pictures that are reproducible and look good on
machines without OpenGL. MuJoCo's renderer needs OpenGL, its pictures depend on the driver, and it has neither soft
shadows nor ambient occlusion. The tracer needs only Embree, which the sensors use anyway.

Each sample of a pixel follows one ray through glass to the first opaque surface. The light there is the sum of three
terms, one ray each: a lamp with soft shadows (a sun from outside, a ceiling panel from inside); the surroundings, or
one bounce off the surface that hides them (cosine-distributed); and the mirror image on polished surfaces. Light is
filtered, color is not.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labgym.counts import whole_number
from labgym.errors import OptionError
from labgym.layouts import Layout
from labgym.layouts.floor import Floor
from labgym.scenes.ceiling import ceiling_patches, panels
from labgym.scenes.coats import Coats, placement_frames, veiled
from labgym.scenes.cutaway import hidden_walls
from labgym.scenes.ghosts import blank_backs, ghost_faces, outlines
from labgym.scenes.lighting import NUDGE, Lamps, Panels, Sun, Surroundings, ambient_light, direct_light, studio
from labgym.scenes.mesh import MATERIAL_NAMES, SceneMesh, joined, scene_mesh, smooth_normals, with_patches
from labgym.scenes.surfaces import Floats, Scene, norms
from labgym.scenes.views import View, picture_view

KERNEL = ((-2, 1.0 / 16.0), (-1, 1.0 / 4.0), (0, 3.0 / 8.0), (1, 1.0 / 4.0), (2, 1.0 / 16.0))
ROUNDS = 4
NORMAL_SHARPNESS = 24.0
DISTANCE_SHARPNESS = 30.0
LIGHT_SHARPNESS = 2.5
MAX_SAMPLES = 4096
"""Largest number of samples of a pixel."""
LARGEST = (3840, 2160)
"""Largest picture, pixels; a larger one takes gigabytes of memory."""
SUN_COLOR, SUN_SPREAD = (0.98, 0.93, 0.85), 0.12
SUN_ASIDE, SUN_RISE = math.radians(48.0), math.radians(68.0)
"""Color and size of the sun, its angle to the side of the camera, and its height."""
EXPOSURE = 0.84
CHUNK = 1 << 17
LIGHT_EVERY = 2
"""Only every second sample of a pixel adds light, which is filtered; the others smooth edges and textures."""
FARTHEST = 60.0
"""Distance that the filter takes for rays that hit nothing, meters."""


def smooth_light(light: Floats, normal: Floats, distance: Floats) -> Floats:
    """Return light (h, w, 3) smoothed along surfaces given by normals (h, w, 3) and distances (h, w) in meters.

    The kernel is applied along rows and then along columns.
    """
    normal = normal / np.maximum(np.linalg.norm(normal, axis=2, keepdims=True), np.float32(1e-9))
    for k in range(ROUNDS):
        step = 2**k
        for axis in (0, 1):
            light = _pass(light, normal, distance, step, axis, LIGHT_SHARPNESS * 2.0**k if k > 0 else 0.0)
    return light


def _pass(light: Floats, normal: Floats, distance: Floats, step: int, axis: int, sharpness: float) -> Floats:
    total = np.zeros_like(light)
    weights = np.zeros(distance.shape, dtype=np.float32)
    tone = light.mean(axis=2)
    for shift, share in KERNEL:
        here, there = _windows(light.shape[axis], shift * step, axis)
        apart = 1.0 - np.einsum("ijk,ijk->ij", normal[here], normal[there])
        gap = np.abs(distance[here] - distance[there]) / (0.05 + distance[here]) / step
        closeness = NORMAL_SHARPNESS * np.maximum(apart, 0.0) + DISTANCE_SHARPNESS * gap
        if sharpness > 0.0:
            closeness += sharpness * np.abs(tone[here] - tone[there])
        weight = np.float32(share) * np.exp(-closeness).astype(np.float32)
        total[here] += weight[..., None] * light[there]
        weights[here] += weight
    return np.asarray(total / np.maximum(weights, np.float32(1e-20))[..., None], dtype=np.float32)


def _windows(length: int, shift: int, axis: int) -> tuple[tuple[slice, slice], tuple[slice, slice]]:
    """Return slices of the pixels that have a neighbor at distance `shift` along an axis, and of those neighbors."""
    reach = min(abs(shift), length)
    low, high = slice(0, length - reach), slice(reach, length)
    here, there = (low, high) if shift >= 0 else (high, low)
    whole = slice(None)
    return ((here, whole), (there, whole)) if axis == 0 else ((whole, here), (whole, there))


def trace(
    layout: Layout, width: int = 1280, height: int = 720, camera: str = "overview", samples: int = 4
) -> NDArray[np.uint8]:
    """Return a ray-traced picture of a layout, shape (height, width, 3); it needs no OpenGL.

    Args:
        camera: a name of `labgym.scenes.views.views`: overview, topdown, door, or a workplace's placement id.
        samples: rays per pixel; noise falls and time rises with the number.

    Raises:
        UnknownNameError: the camera does not exist.
        OptionError: the size is not between 1x1 and LARGEST, or the number of samples is not positive.
    """
    return trace_view(layout, picture_view(layout, camera), width, height, samples)


def trace_view(
    layout: Layout,
    place: View,
    width: int,
    height: int,
    samples: int = 4,
    added: SceneMesh | None = None,
    hidden: Collection[str] | None = None,
) -> NDArray[np.uint8]:
    """Return a ray-traced picture of a layout from any camera, shape (height, width, 3).

    Args:
        added: what stands in it besides, such as people, in the room frame; its owner is `ROOM`.
        hidden: walls, or upper parts of walls, to leave out; by default those between the camera and the spaces.

    Raises:
        OptionError: as `trace`.
    """
    if not (1 <= width <= LARGEST[0] and 1 <= height <= LARGEST[1]):
        raise OptionError(f"picture size {width}x{height} is not between 1x1 and {LARGEST[0]}x{LARGEST[1]}")
    whole_number("samples", samples, most=MAX_SAMPLES)
    hidden = hidden_walls(layout.floor, place.position) if hidden is None else hidden
    mesh = scene_mesh(layout, hidden)
    mesh = mesh if added is None else joined(mesh, added)
    if not _within(layout.floor, place):
        ghosts = blank_backs(mesh, layout, place.position, hidden)
        base = with_patches(joined(mesh, *outlines(mesh, layout, ghosts)), (studio(layout.floor),))
        scene, lamps = Scene(base, smooth_normals(base, layout), ghost_faces(base, ghosts)), _sun(place)
        coats = _coats(base, placement_frames(layout.placements))
        return _picture(scene, coats, place, lamps, Surroundings(inside=False), (width, height), samples)
    lit = [panel for space in layout.floor.spaces for panel in panels(space)]
    (x0, y0), (x1, y1) = place.position[:2], place.target[:2]
    mesh = with_patches(mesh, ceiling_patches(layout.floor))
    scene, indoors = Scene(mesh, smooth_normals(mesh, layout)), Panels(lit, ((x0 + x1) / 2.0, (y0 + y1) / 2.0))
    coats = _coats(mesh, placement_frames(layout.placements))
    return _picture(scene, coats, place, indoors, Surroundings(inside=True), (width, height), samples)


def trace_mesh(mesh: SceneMesh, place: View, width: int, height: int, samples: int) -> NDArray[np.uint8]:
    """Return a ray-traced picture of a mesh from outside."""
    coats = _coats(mesh, np.zeros((int(mesh.owner.max()) + 2, 4), dtype=np.float32))
    return _picture(Scene(mesh), coats, place, _sun(place), Surroundings(inside=False), (width, height), samples)


def _within(floor: Floor, view: View) -> bool:
    """Return whether a camera is in a room, below its ceiling."""
    x0, y0, x1, y1 = floor.bounds
    x, y, z = view.position
    return x0 <= x <= x1 and y0 <= y <= y1 and z < min(space.ceiling for space in floor.spaces)


def _coats(mesh: SceneMesh, frames: Floats) -> Coats:
    return Coats(MATERIAL_NAMES, np.unique(mesh.material), frames)


def _picture(
    scene: Scene,
    coats: Coats,
    place: View,
    lamps: Lamps,
    around: Surroundings,
    size: tuple[int, int],
    samples: int,
) -> NDArray[np.uint8]:
    width, height = size
    painter = _Painter(scene, coats, lamps, around, 2.0 * math.tan(math.radians(place.fovy) / 2.0) / height)
    image = _Image(width * height)
    for first in range(0, width * height, CHUNK):
        pixels = np.arange(first, min(first + CHUNK, width * height))
        for sample in range(samples):
            noise = _Noise(pixels % width, pixels // width, sample)
            directions = _camera_rays(place, width, height, pixels, noise)
            origins = np.broadcast_to(np.array(place.position, dtype=np.float32), directions.shape)
            lit = sample % LIGHT_EVERY == 0
            painter.sample(image, first, np.ascontiguousarray(origins), directions, noise, lit)
    return _developed(image, width, height, samples)


def _sun(place: View) -> Sun:
    """Return a sun that shines over the shoulder of a camera outside."""
    x, y, _ = np.array(place.position) - np.array(place.target)
    bearing = math.atan2(y, x) - SUN_ASIDE if math.hypot(x, y) > 0.1 else math.radians(-125.0)
    level = math.cos(SUN_RISE)
    direction = (level * math.cos(bearing), level * math.sin(bearing), math.sin(SUN_RISE))
    return Sun(direction, SUN_COLOR, SUN_SPREAD)


class _Image:
    """Sums over the samples of n pixels.

    Colors, light, mirror images, further light and normals (n, 3); distances, and numbers of samples with light, (n,).
    """

    def __init__(self, pixels: int) -> None:
        self.color = np.zeros((pixels, 3), dtype=np.float32)
        self.light = np.zeros((pixels, 3), dtype=np.float32)
        self.mirrored = np.zeros((pixels, 3), dtype=np.float32)
        self.rest = np.zeros((pixels, 3), dtype=np.float32)
        self.normal = np.zeros((pixels, 3), dtype=np.float32)
        self.distance = np.zeros(pixels, dtype=np.float32)
        self.lit = np.zeros(pixels, dtype=np.float32)


class _Noise:
    """Two evenly distributed numbers in [0, 1) for each pixel, sample and purpose, without a random generator."""

    def __init__(self, x: NDArray[np.int64], y: NDArray[np.int64], sample: int) -> None:
        self._x, self._y, self._sample = x.astype(np.float64), y.astype(np.float64), sample

    def pair(self, purpose: int) -> tuple[Floats, Floats]:
        """Return interleaved gradient noise over the picture, shifted from sample to sample by the plastic number."""
        numbers = []
        for axis, step in ((0, 0.7548776662466927), (1, 0.5698402909980532)):
            shift = 5.588238 * (2 * purpose + axis)
            gradient = 52.9829189 * np.modf(0.06711056 * (self._x + shift) + 0.00583715 * (self._y + 1.7 * shift))[0]
            numbers.append(np.modf(gradient + step * self._sample)[0].astype(np.float32))
        return numbers[0], numbers[1]


def _camera_rays(place: View, width: int, height: int, pixels: NDArray[np.int64], noise: _Noise) -> Floats:
    right, up, backward = place.axes()
    across, down = noise.pair(0)
    tall = math.tan(math.radians(place.fovy) / 2.0)
    x = ((pixels % width + across) / width * 2.0 - 1.0) * tall * width / height
    y = (1.0 - (pixels // width + down) / height * 2.0) * tall
    rays = x[:, None] * right + y[:, None] * up - backward
    rays /= norms(rays)
    return np.ascontiguousarray(rays, dtype=np.float32)


@dataclass(frozen=True)
class _Painter:
    """Scene, textures and lamps of a picture.

    Attributes:
        pixel: side of a pixel at unit distance.
    """

    scene: Scene
    coats: Coats
    lamps: Lamps
    around: Surroundings
    pixel: float

    def sample(self, image: _Image, start: int, origins: Floats, directions: Floats, noise: _Noise, lit: bool) -> None:
        """Add one sample of each pixel from `start` on to the image.

        Args:
            lit: whether the sample adds light and mirror images.
        """
        scene, look = self.scene, self.scene.look
        pixels = slice(start, start + len(directions))
        hits = scene.opaque.cast(origins, directions)
        veil, through = veiled(scene, origins, directions, hits.distance)
        image.rest[pixels] += veil
        image.normal[pixels] += hits.normal
        image.distance[pixels] += np.minimum(hits.distance, FARTHEST)
        if hits.hit.all():
            first: slice | NDArray[np.int64] = slice(None)
            here: slice | NDArray[np.int64] = pixels
        else:
            miss = np.flatnonzero(~hits.hit)
            image.rest[start + miss] += through[miss, None] * self.around.color(directions[miss])
            first = np.flatnonzero(hits.hit)
            here = start + first
        side, material, rays, clear = hits.side[first], hits.material[first], directions[first], through[first, None]
        points = origins[first] + rays * hits.distance[first, None] + side * NUDGE
        normals = hits.normal[first]
        color = look.color[material]
        slant = np.abs(np.einsum("ij,ij->i", side, rays))
        footprint = hits.distance[first] * np.float32(self.pixel) / np.sqrt(np.maximum(slant, np.float32(0.05)))
        self.coats.paint(color, points, side, material, hits.owner[first], footprint)
        if lit:
            (u, v), (choice, _), ambient = (tuple(n[: len(points)] for n in noise.pair(k)) for k in (1, 4, 2))
            light = direct_light(scene, self.lamps, points, normals, u, v, choice)
            light += ambient_light(scene, self.around, points, normals, *ambient)
            image.light[here] += light
            image.lit[here] += np.float32(1.0)
            mirrored = self._mirrored(points, normals, rays, material, noise)
            image.mirrored[here] += clear * mirrored
        image.rest[here] += clear * color * look.glow[material][:, None]
        image.color[here] += clear * color * np.where(look.metal[material], np.float32(0.55), np.float32(1.0))[:, None]

    def _mirrored(
        self, points: Floats, normals: Floats, directions: Floats, material: NDArray[np.int64], noise: _Noise
    ) -> Floats:
        """Return the light (n, 3) that polished surfaces mirror, with Schlick's approximation of Fresnel reflection."""
        look = self.scene.look
        mirrored = np.zeros_like(points)
        shiny = np.flatnonzero((look.mirror[material] > 0.0) | look.metal[material])
        normal, ray = normals[shiny], directions[shiny]
        facing = np.einsum("ij,ij->i", normal, ray)
        away = ray - 2.0 * facing[:, None] * normal
        u, v = noise.pair(3)
        away = away + 0.03 * np.stack([u[shiny] - 0.5, v[shiny] - 0.5, u[shiny] - v[shiny]], axis=1)
        away = np.ascontiguousarray(away / norms(away), dtype=np.float32)
        hits = self.scene.opaque.cast(points[shiny], away, smooth=False)
        color = look.color[hits.material] * (0.70 + look.glow[hits.material])[:, None]
        light = np.where(hits.hit[:, None], color, self.around.color(away))
        base = np.where(
            look.metal[material[shiny], None], 0.55 * look.color[material[shiny]], look.mirror[material[shiny], None]
        )
        rise = (1.0 - np.abs(facing))[:, None] ** 5
        mirrored[shiny] = light * (base + 0.35 * (1.0 - base) * rise)
        return mirrored


def _developed(image: _Image, width: int, height: int, samples: int) -> NDArray[np.uint8]:
    """Return the picture of an image: filter its light, multiply by its color, compress highlights, encode as sRGB."""
    shape = (height, width)
    share = np.float32(1.0 / samples)
    normal, distance = image.normal.reshape(*shape, 3), image.distance.reshape(shape) * share
    # A pixel of which no sample has light gets that of a dim surface.
    mean = np.where(image.lit[:, None] > 0.0, image.light / np.maximum(image.lit, 1.0)[:, None], np.float32(0.5))
    light = smooth_light(mean.reshape(*shape, 3), normal, distance)
    rest = image.rest + image.mirrored * (samples / -(-samples // LIGHT_EVERY))
    linear = (image.color.reshape(*shape, 3) * light + rest.reshape(*shape, 3)) / samples
    exposed = np.maximum(linear, 0.0) * EXPOSURE
    # Linear up to the knee, then asymptotic to white.
    knee = 0.62
    bright = knee + (1.0 - knee) * (1.0 - np.exp(-(exposed - knee) / (1.0 - knee)))
    toned = np.where(exposed > knee, bright, exposed)
    return np.asarray(np.rint(255.0 * toned ** (1.0 / 2.2)), dtype=np.uint8)
