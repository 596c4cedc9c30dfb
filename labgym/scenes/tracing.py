"""Pictures by ray tracing on the CPU.

Reasons for a separate ray tracer: documentation and reports need pictures that are reproducible and look good on
machines without OpenGL. MuJoCo's renderer needs OpenGL, its pictures depend on the driver, and it has neither soft
shadows nor ambient occlusion. The tracer needs only Embree, which the sensors use anyway.

Each sample of a pixel follows one ray through glass to the first opaque surface. The light there is the sum of three
terms, one ray each: a lamp in the ceiling with soft shadows; the bright ceiling, or one bounce off the surface that
hides it (cosine-distributed); and the mirror image on polished surfaces. Light is filtered, color is not.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from labgym.errors import OptionError
from labgym.layouts import Layout
from labgym.scenes.cutaway import hidden_walls
from labgym.scenes.filtering import smooth_light
from labgym.scenes.finishes import JOINTS
from labgym.scenes.mesh import MATERIAL_NAMES, SceneMesh, scene_mesh
from labgym.scenes.surfaces import Floats, Scene, norms
from labgym.scenes.views import View, picture_view

LARGEST = (3840, 2160)
"""Largest picture, pixels; a larger one takes gigabytes of memory."""

SUN = np.array([-0.20, -0.28, 0.94], dtype=np.float32) / np.float32(np.linalg.norm([-0.20, -0.28, 0.94]))
SUN_COLOR = np.array([0.66, 0.64, 0.60], dtype=np.float32)
SUN_SPREAD = 0.10
"""Radius of the lamp at unit distance; a larger lamp makes softer shadows."""
SKY_COLOR = np.array([0.80, 0.82, 0.85], dtype=np.float32)
BOUNCE = 0.58
"""Light from a surface that an ambient ray hits, relative to the surface's color."""
BACKDROP = (np.array([0.80, 0.85, 0.90], dtype=np.float32), np.array([0.46, 0.54, 0.63], dtype=np.float32))
"""Background of pictures from outside: linear colors at its top and bottom."""
EXPOSURE = 0.84
LAYERS = 5
"""Largest number of translucent surfaces that a ray passes."""
CHUNK = 1 << 17
NUDGE = np.float32(2e-4)
"""Distance between a surface and the origins of the rays that leave it, meters."""


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
    if not (1 <= width <= LARGEST[0] and 1 <= height <= LARGEST[1]):
        raise OptionError(f"picture size {width}x{height} is not between 1x1 and {LARGEST[0]}x{LARGEST[1]}")
    if samples < 1:
        raise OptionError(f"samples must be at least 1, got {samples}")
    place = picture_view(layout, camera)
    hidden = hidden_walls(layout.floor, place.position)
    ceiling = max(space.ceiling for space in layout.floor.spaces)
    return trace_mesh(scene_mesh(layout, hidden), place, width, height, samples, ceiling)


def trace_mesh(
    mesh: SceneMesh, place: View, width: int, height: int, samples: int, ceiling: float = math.inf
) -> NDArray[np.uint8]:
    """Return a ray-traced picture of a mesh; rays that rise above `ceiling` meters hit a ceiling with lamps."""
    scene = Scene(mesh)
    image = _Image(width * height)
    pixels = np.arange(width * height)
    for first in range(0, len(pixels), CHUNK):
        chunk = pixels[first : first + CHUNK]
        for sample in range(samples):
            noise = _Noise(chunk % width, chunk // width, sample)
            directions = _camera_rays(place, width, height, chunk, noise)
            origins = np.broadcast_to(np.array(place.position, dtype=np.float32), directions.shape)
            _sample(scene, image, chunk, np.ascontiguousarray(origins), directions, noise, ceiling)
    return _developed(image, width, height, samples)


class _Image:
    """Sums over the samples of n pixels: color, light, remaining light and normals (n, 3), and distances (n,)."""

    def __init__(self, pixels: int) -> None:
        self.color = np.zeros((pixels, 3), dtype=np.float32)
        self.light = np.zeros((pixels, 3), dtype=np.float32)
        self.rest = np.zeros((pixels, 3), dtype=np.float32)
        self.normal = np.zeros((pixels, 3), dtype=np.float32)
        self.distance = np.zeros(pixels, dtype=np.float32)


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


def _sample(
    scene: Scene,
    image: _Image,
    pixels: NDArray[np.int64],
    origins: Floats,
    directions: Floats,
    noise: _Noise,
    ceiling: float,
) -> None:
    """Add one sample of each pixel to the image."""
    look = scene.look
    hits = scene.opaque.cast(origins, directions)
    veil, through = _glass(scene, origins, directions, hits.distance)
    first = np.flatnonzero(hits.hit)
    points = origins[first] + directions[first] * hits.distance[first, None] + hits.side[first] * NUDGE
    normals, material = hits.normal[first], hits.material[first]
    color, metal = look.color[material] * _joints(points, material)[:, None], look.metal[material]
    light = _lamp_light(scene, points, normals, noise) + _ambient_light(scene, points, normals, noise)
    mirrored = _mirrored(scene, points, normals, directions[first], material, noise, ceiling)
    diffuse = color * np.where(metal, 0.55, 1.0)[:, None]
    rest = _surroundings(origins, directions, ceiling)
    rest[first] = mirrored + color * look.glow[material][:, None]
    image.rest[pixels] += veil + through[:, None] * rest
    image.color[pixels[first]] += through[first, None] * diffuse
    image.light[pixels[first]] += light
    image.normal[pixels] += hits.normal
    image.distance[pixels] += np.minimum(hits.distance, 60.0)


def _joints(points: Floats, material: NDArray[np.int64]) -> Floats:
    """Return the factors (n,) that darken the joints between floor tiles."""
    joint = np.zeros(len(points), dtype=np.bool_)
    for name, tile in JOINTS.items():
        across = np.abs(np.mod(points[:, :2] / tile + 0.5, 1.0) - 0.5).min(axis=1) * tile
        joint |= (material == MATERIAL_NAMES.index(name)) & (across < 0.003)
    return np.where(joint, 0.72, 1.0).astype(np.float32)


def _glass(scene: Scene, origins: Floats, directions: Floats, reach: Floats) -> tuple[Floats, Floats]:
    """Return the light that translucent surfaces before a distance add (n, 3), and their transmittance (n,)."""
    look = scene.look
    veil = np.zeros_like(directions)
    through = np.ones(len(directions), dtype=np.float32)
    alive = np.arange(len(directions))
    start, left = origins, reach
    for _ in range(LAYERS):
        hits = scene.clear.cast(start, directions[alive], left)
        struck = np.flatnonzero(hits.hit)
        if len(struck) == 0:
            break
        rays, normals, material = alive[struck], hits.normal[struck], hits.material[struck]
        facing = np.abs(np.einsum("ij,ij->i", normals, directions[rays]))
        edge = (1.0 - facing) ** 3
        opacity = look.opacity[material]
        opacity = opacity + (1.0 - opacity) * 0.55 * edge
        shade = 0.60 + 0.30 * np.maximum(normals[:, 2], 0.0) + 0.25 * edge
        veil[rays] += (through[rays] * opacity * shade)[:, None] * look.color[material]
        through[rays] *= 1.0 - opacity
        start = start[struck] + directions[rays] * (hits.distance[struck] + NUDGE)[:, None]
        left = left[struck] - hits.distance[struck] - NUDGE
        alive = rays
    return veil, through


def _lamp_light(scene: Scene, points: Floats, normals: Floats, noise: _Noise) -> Floats:
    """Return the light of the lamp by one shadow ray towards a random point on it, shape (n, 3)."""
    u, v = noise.pair(1)
    count = len(points)
    radius, angle = np.sqrt(u[:count]) * SUN_SPREAD, 2.0 * math.pi * v[:count]
    side = np.cross(SUN, [0.0, 1.0, 0.0]).astype(np.float32)
    other = np.cross(side, SUN).astype(np.float32)
    towards = SUN + (radius * np.cos(angle))[:, None] * side + (radius * np.sin(angle))[:, None] * other
    towards = np.ascontiguousarray(towards / norms(towards), dtype=np.float32)
    facing = np.maximum(np.einsum("ij,ij->i", normals, towards), 0.0)
    lit = np.zeros(count, dtype=np.float32)
    front = np.flatnonzero(facing > 0.0)
    lit[front] = ~scene.opaque.blocked(points[front], towards[front])
    return np.asarray((facing * lit)[:, None] * SUN_COLOR, dtype=np.float32)


def _ambient_light(scene: Scene, points: Floats, normals: Floats, noise: _Noise) -> Floats:
    """Return the ambient light by one cosine-distributed ray: the sky, or the surface that hides it, shape (n, 3)."""
    u, v = noise.pair(2)
    towards = _around(normals, u[: len(points)], v[: len(points)])
    hits = scene.opaque.cast(points, towards)
    color = scene.look.color[hits.material] * (BOUNCE + scene.look.glow[hits.material])[:, None]
    return np.where(hits.hit[:, None], color, _sky(towards)).astype(np.float32)


def _mirrored(
    scene: Scene,
    points: Floats,
    normals: Floats,
    directions: Floats,
    material: NDArray[np.int64],
    noise: _Noise,
    ceiling: float,
) -> Floats:
    """Return the light that polished surfaces mirror, with Schlick's approximation of Fresnel reflection, (n, 3)."""
    look = scene.look
    mirrored = np.zeros_like(points)
    shiny = np.flatnonzero((look.mirror[material] > 0.0) | look.metal[material])
    normal, ray = normals[shiny], directions[shiny]
    facing = np.einsum("ij,ij->i", normal, ray)
    away = ray - 2.0 * facing[:, None] * normal
    u, v = noise.pair(3)
    away = away + 0.03 * np.stack([u[shiny] - 0.5, v[shiny] - 0.5, u[shiny] - v[shiny]], axis=1)
    away = np.ascontiguousarray(away / norms(away), dtype=np.float32)
    hits = scene.opaque.cast(points[shiny], away)
    color = look.color[hits.material] * (0.70 + look.glow[hits.material])[:, None]
    light = np.where(hits.hit[:, None], color, _surroundings(points[shiny], away, ceiling))
    base = np.where(
        look.metal[material[shiny], None], 0.55 * look.color[material[shiny]], look.mirror[material[shiny], None]
    )
    rise = (1.0 - np.abs(facing))[:, None] ** 5
    mirrored[shiny] = light * (base + 0.35 * (1.0 - base) * rise)
    return mirrored


def _around(normals: Floats, u: Floats, v: Floats) -> Floats:
    """Return cosine-distributed directions about normals: the normal plus a point on the unit sphere."""
    z, angle = 1.0 - 2.0 * u, 2.0 * math.pi * v
    flat = np.sqrt(np.maximum(1.0 - z * z, 0.0))
    towards = normals * 1.0005 + np.stack([flat * np.cos(angle), flat * np.sin(angle), z], axis=1)
    towards /= np.maximum(norms(towards), 1e-6)
    return np.ascontiguousarray(towards, dtype=np.float32)


def _sky(directions: Floats) -> Floats:
    """Return the light of the sky along directions, shape (n, 3); it is dim below the horizon."""
    rise = np.clip(directions[:, 2] * 4.0 + 0.4, 0.25, 1.0)
    return np.asarray(rise[:, None] * SKY_COLOR, dtype=np.float32)


def _surroundings(origins: Floats, directions: Floats, ceiling: float) -> Floats:
    """Return the color of rays that hit nothing: a ceiling with lamps if they rise from below it, else a backdrop."""
    top, bottom = BACKDROP
    share = np.clip(directions[:, 2:] * 1.4 + 0.75, 0.0, 1.0)
    color = bottom + (top - bottom) * share
    if math.isfinite(ceiling):
        upward = (directions[:, 2] > 1e-3) & (origins[:, 2] < ceiling)
        reach = (ceiling - origins[upward, 2]) / directions[upward, 2]
        across = origins[upward, :2] + directions[upward, :2] * reach[:, None]
        tile = np.abs(np.mod(across / 0.6, 1.0) - 0.5)
        panel = np.mod(np.floor(across / 0.6), (2.0, 4.0))
        lamp = (panel[:, 0] == 0.0) & ((panel[:, 1] == 0.0) | (panel[:, 1] == 1.0))
        tone = np.where(lamp, 1.15, 0.60) * np.where(tile.max(axis=1) > 0.48, 0.72, 1.0)
        color[upward] = tone[:, None] * np.array([1.0, 0.99, 0.97], dtype=np.float32)
    return np.asarray(color, dtype=np.float32)


def _developed(image: _Image, width: int, height: int, samples: int) -> NDArray[np.uint8]:
    """Return the picture of an image: filter its light, multiply by its color, compress highlights, encode as sRGB."""
    shape = (height, width)
    share = np.float32(1.0 / samples)
    normal, distance = image.normal.reshape(*shape, 3), image.distance.reshape(shape) * share
    light = smooth_light(image.light.reshape(*shape, 3) * share, normal, distance)
    linear = (image.color.reshape(*shape, 3) * light + image.rest.reshape(*shape, 3)) / samples
    exposed = np.maximum(linear, 0.0) * EXPOSURE
    # Linear up to the knee, then asymptotic to white.
    knee = 0.62
    bright = knee + (1.0 - knee) * (1.0 - np.exp(-(exposed - knee) / (1.0 - knee)))
    toned = np.where(exposed > knee, bright, exposed)
    return np.asarray(np.rint(255.0 * toned ** (1.0 / 2.2)), dtype=np.uint8)
