"""Light on the surfaces of ray-traced pictures: a sun for views from outside, ceiling panels for views from inside."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from labgym.scenes.ceiling import ILLUMINANCE, PANEL, Panel
from labgym.scenes.surfaces import Floats, Scene, norms
from labgym.scenes.surroundings import Surroundings

NUDGE = np.float32(2e-4)
"""Distance between a surface and the origins of the rays that leave it, meters."""
BOUNCE = 0.72
"""Light from a surface that an ambient ray hits, relative to the surface's color."""
CONTACT, DARKEST = 0.5, 0.12
"""Distance within which a surface shades another, meters, and the share of its light at contact."""
UNDERSIDE, TOP = 0.5, 1.35
"""Light from surfaces that look down and up, relative to upright ones."""
PANEL_LIGHT = 1.25
"""Brightness of light from panels at `ILLUMINANCE` lux."""
MOST_PANELS = 24
"""The panels that light a picture: those nearest to its target."""


@dataclass(frozen=True)
class Beam:
    """Light of a lamp at n points.

    Attributes:
        towards: unit vectors to the lamp (n, 3). reach: distances from it, (n,), meters.
        color: light if nothing is in the way, (n, 3).
    """

    towards: Floats
    reach: Floats
    color: Floats


@dataclass(frozen=True)
class Sun:
    """A distant lamp.

    Attributes:
        direction: unit vector towards it. spread: its radius at unit distance; a larger lamp makes softer shadows.
    """

    direction: tuple[float, float, float]
    color: tuple[float, float, float]
    spread: float

    def beam(self, points: Floats, normals: Floats, u: Floats, v: Floats, _: Floats) -> Beam:
        """Return the light from a random point of the lamp."""
        direction = np.array(self.direction)
        side = np.cross(direction, [0.0, 1.0, 0.0])
        side /= np.linalg.norm(side)
        other = np.cross(side, direction)
        radius, angle = np.sqrt(u) * self.spread, 2.0 * math.pi * v
        towards = direction + (radius * np.cos(angle))[:, None] * side + (radius * np.sin(angle))[:, None] * other
        towards = np.asarray(towards / np.linalg.norm(towards, axis=1, keepdims=True), dtype=np.float32)
        facing = np.maximum(np.einsum("ij,ij->i", normals, towards), 0.0)
        color = facing[:, None] * np.array(self.color, dtype=np.float32)
        return Beam(towards, np.full(len(points), 1e4, dtype=np.float32), color)


class Panels:
    """Ceiling panels; each point gets its light from one of them, drawn by their shares."""

    def __init__(self, panels: Sequence[Panel], target: tuple[float, float]) -> None:
        """Use the panels nearest to a target."""
        near = sorted(panels, key=lambda panel: math.hypot(panel.x - target[0], panel.y - target[1]))[:MOST_PANELS]
        self._middle = np.array([(panel.x, panel.y, panel.z) for panel in near], dtype=np.float32)
        self._yaw = np.array([panel.yaw for panel in near], dtype=np.float32)
        area = PANEL[0] * PANEL[1]
        self._strength = np.array(
            [PANEL_LIGHT * panel.luminance * area / ILLUMINANCE for panel in near], dtype=np.float32
        )

    def beam(self, points: Floats, normals: Floats, u: Floats, v: Floats, choice: Floats) -> Beam:
        """Return the light of all panels, from a random point of one of them."""
        towards = self._middle[None] - points[:, None]
        square = np.maximum(np.einsum("ijk,ijk->ij", towards, towards), np.float32(0.04))
        facing = np.maximum(np.einsum("ijk,ik->ij", towards, normals), np.float32(0.0))
        # Both cosines have the distance as a factor.
        share = self._strength * facing * np.maximum(towards[:, :, 2], np.float32(0.0)) / square**2
        total = np.cumsum(share, axis=1)
        light = total[:, -1]
        index = np.minimum((total < (choice * light)[:, None]).sum(axis=1), len(self._middle) - 1)
        x, y = (u - np.float32(0.5)) * np.float32(PANEL[0]), (v - np.float32(0.5)) * np.float32(PANEL[1])
        cosine, sine = np.cos(self._yaw[index]), np.sin(self._yaw[index])
        aside = np.stack([x * cosine - y * sine, x * sine + y * cosine, np.zeros_like(x)], axis=1)
        way = self._middle[index] + aside - points
        reach = norms(way)
        color = light[:, None] * np.array([1.0, 0.985, 0.955], dtype=np.float32)
        return Beam(way / reach, reach[:, 0] * np.float32(0.98), color)


Lamps = Sun | Panels


def direct_light(
    scene: Scene, lamps: Lamps, points: Floats, normals: Floats, u: Floats, v: Floats, choice: Floats
) -> Floats:
    """Return the light of the lamps by one shadow ray, shape (n, 3)."""
    beam = lamps.beam(points, normals, u, v, choice)
    light = np.zeros_like(points)
    lit = np.flatnonzero(beam.color.max(axis=1) > 1e-4)
    towards = np.ascontiguousarray(beam.towards[lit], dtype=np.float32)
    open_ = lit[~scene.opaque.blocked(points[lit], towards, beam.reach[lit])]
    light[open_] = beam.color[open_]
    return light


def ambient_light(scene: Scene, around: Surroundings, points: Floats, normals: Floats, u: Floats, v: Floats) -> Floats:
    """Return the ambient light by one cosine-distributed ray: the sky, or the surface that hides it, shape (n, 3).

    Surfaces that are near get little light themselves, so that contacts are dark.
    """
    towards = _around(normals, u, v)
    hits = scene.opaque.cast(points, towards, smooth=False)
    near = np.minimum(hits.distance / np.float32(CONTACT), np.float32(1.0))
    close = DARKEST + (1.0 - DARKEST) * near * (2.0 - near)
    rise = hits.normal[:, 2]
    tilt = 1.0 + rise * np.where(rise > 0.0, np.float32(TOP - 1.0), np.float32(1.0 - UNDERSIDE))
    bounced = scene.look.color[hits.material] * (BOUNCE * close * tilt)[:, None]
    return np.where(hits.hit[:, None], bounced, around.sky(towards)).astype(np.float32)


def _around(normals: Floats, u: Floats, v: Floats) -> Floats:
    """Return cosine-distributed directions about normals: the normal plus a point on the unit sphere."""
    z, angle = 1.0 - 2.0 * u, 2.0 * math.pi * v
    flat = np.sqrt(np.maximum(1.0 - z * z, 0.0))
    towards = normals * 1.0005 + np.stack([flat * np.cos(angle), flat * np.sin(angle), z], axis=1)
    towards /= np.maximum(norms(towards), 1e-6)
    return np.ascontiguousarray(towards, dtype=np.float32)
