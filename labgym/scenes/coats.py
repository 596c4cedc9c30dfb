"""Textures of ray-traced pictures, filtered to the size of a pixel, and light through glass."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from labgym.assets.textures import Texture, surface_coordinates, texture
from labgym.layouts import Placement
from labgym.scenes.surfaces import Floats, Scene

GAMMA = np.float32(2.2)
"""Exponent between colors and linear light in ray-traced pictures."""
LAYERS = 5
"""Largest number of translucent surfaces that a ray passes."""
NUDGE = np.float32(2e-4)
"""Distance behind a translucent surface at which the ray goes on, meters."""
NORMAL_REFLECTANCE = 0.04
"""Share of light that glass mirrors at normal incidence (refractive index 1.5)."""
DULL, BRIGHT = np.float32(0.30), np.float32(1.05)
"""Brightness of the mirror images of walls and of the ceiling in glass."""


def placement_frames(placements: Sequence[Placement]) -> Floats:
    """Return position and yaw (x, y, z, yaw) of placements, shape (n + 1, 4).

    The last row, which the owner `ROOM` selects, is the floor's frame.
    """
    rows = [(*placement.position, placement.yaw) for placement in placements]
    return np.array([*rows, (0.0, 0.0, 0.0, 0.0)], dtype=np.float32)


class Coats:
    """Colors of textured materials at points of their surfaces."""

    def __init__(self, materials: Sequence[str], used: NDArray[np.integer], frames: Floats) -> None:
        """Prepare the textures of the materials whose indices are in `used`."""
        self._frames = frames
        textures = {int(index): texture(materials[index]) for index in used}
        self._pyramids = {index: _Pyramid(each) for index, each in textures.items() if each is not None}

    def paint(
        self,
        color: Floats,
        points: Floats,
        normals: Floats,
        material: NDArray[np.int64],
        owner: NDArray[np.int64],
        footprint: Floats,
    ) -> None:
        """Replace colors (n, 3) of textured materials by those at points (n, 3) on surfaces with normals (n, 3).

        Args:
            material, owner: indices (n,) of materials and of frames.
            footprint: sides of the squares that pixels cover on the surfaces, (n,), meters.
        """
        for index, pyramid in self._pyramids.items():
            at = np.flatnonzero(material == index)
            if len(at) == 0:
                continue
            frame = self._frames[owner[at]]
            local = points[at] - frame[:, :3]
            cosine, sine = np.cos(frame[:, 3]), np.sin(frame[:, 3])
            local, facing = _turned(local, cosine, sine), _turned(normals[at], cosine, sine)
            place = surface_coordinates(local, facing, pyramid.upright).astype(np.float32)
            color[at] = pyramid.color(place, footprint[at])


class _Pyramid:
    """A texture in halving sizes, in linear light."""

    def __init__(self, image: Texture) -> None:
        self.upright = image.upright
        self._period = np.float32(image.period)
        levels = [(image.pixels[::-1].astype(np.float32) / np.float32(255.0)) ** GAMMA]
        while len(levels[-1]) > 1:
            fine = levels[-1]
            levels.append((fine[::2, ::2] + fine[1::2, ::2] + fine[::2, 1::2] + fine[1::2, 1::2]) / np.float32(4.0))
        self._sizes = np.array([len(level) for level in levels])
        self._first = np.concatenate([[0], np.cumsum(self._sizes**2)[:-1]])
        self._texels = np.concatenate([level.reshape(-1, 3) for level in levels])

    def color(self, place: Floats, footprint: Floats) -> Floats:
        """Return the colors (n, 3) at places (n, 2) in meters for footprints (n,) in meters."""
        texel = self._period / np.float32(self._sizes[0])
        level = np.clip(np.rint(np.log2(np.maximum(footprint / texel, 1.0))), 0, len(self._sizes) - 1).astype(np.int64)
        size = self._sizes[level]
        share = np.mod(place / self._period, np.float32(1.0))
        column = np.minimum((share[:, 0] * size).astype(np.int64), size - 1)
        row = np.minimum((share[:, 1] * size).astype(np.int64), size - 1)
        return np.asarray(self._texels[self._first[level] + row * size + column])


def _turned(vectors: Floats, cosine: Floats, sine: Floats) -> Floats:
    """Return vectors (n, 3) in frames that are turned about z."""
    x, y, z = vectors.T
    return np.stack([x * cosine + y * sine, y * cosine - x * sine, z], axis=1)


def veiled(scene: Scene, origins: Floats, directions: Floats, reach: Floats) -> tuple[Floats, Floats]:
    """Return the light that translucent surfaces before a distance add (n, 3), and their transmittance (n,).

    A surface mirrors more of its surroundings the more it is seen edge on (Schlick), which draws the rims of glass.
    """
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
        facing = np.minimum(np.abs(np.einsum("ij,ij->i", normals, directions[rays])), np.float32(1.0))
        edge = (1.0 - facing) ** 3
        opacity = scene.opacity(hits)[struck]
        opacity = opacity + (1.0 - opacity) * 0.45 * edge
        shade = 0.60 + 0.30 * np.maximum(normals[:, 2], 0.0) + 0.15 * edge
        mirror = NORMAL_REFLECTANCE + (1.0 - NORMAL_REFLECTANCE) * (1.0 - facing) ** 5
        rise = directions[rays, 2] + 2.0 * facing * normals[:, 2]
        image = DULL + (BRIGHT - DULL) * np.clip(rise * 1.5 + 0.2, 0.0, 1.0)
        veil[rays] += (through[rays] * opacity * (1.0 - mirror) * shade)[:, None] * look.color[material]
        veil[rays] += (through[rays] * mirror * image)[:, None]
        through[rays] *= (1.0 - opacity) * (1.0 - mirror)
        start = start[struck] + directions[rays] * (hits.distance[struck] + NUDGE)[:, None]
        left = left[struck] - hits.distance[struck] - NUDGE
        alive = rays
    return veil, through
