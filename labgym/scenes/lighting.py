"""Light on the surfaces of ray-traced pictures: a sun for views from outside, ceiling panels for views from inside."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from labgym.layouts.floor import Floor
from labgym.scenes.ceiling import ILLUMINANCE, PANEL, CeilingPanel
from labgym.scenes.patches import Patch
from labgym.scenes.surfaces import Floats, Scene, norms

BACKDROP = (np.array([0.80, 0.85, 0.90], dtype=np.float32), np.array([0.46, 0.54, 0.63], dtype=np.float32))
"""Background of views from outside: linear colors at its top and bottom."""
REACH = 60.0
"""How far the ground of the studio extends around a floor, meters."""
DROP = -0.03
"""Height of that ground, meters."""
STUDIO = np.array([0.70, 0.73, 0.78], dtype=np.float32)
"""Ambient light of views from outside."""
ZENITH, HORIZON = np.array([0.30, 0.52, 0.92], dtype=np.float32), np.array([0.86, 0.93, 1.0], dtype=np.float32)
"""Colors of the sky."""
LAWN, FAR_LAWN = np.array([0.24, 0.38, 0.13], dtype=np.float32), np.array([0.52, 0.62, 0.36], dtype=np.float32)
WOOD, HILLS = np.array([0.13, 0.23, 0.12], dtype=np.float32), np.array([0.55, 0.66, 0.72], dtype=np.float32)
"""Colors of the ground near and far, of the row of trees, and of the hills at the horizon."""
PAVING = np.array([0.52, 0.51, 0.48], dtype=np.float32)
"""Color of the paths on the lawn."""
FLOOR_ABOVE = 4.5
"""Height of the camera above the ground outside, meters."""
BRIGHTER = np.float32(1.5)
"""Brightness of the landscape behind windows, which a camera with the exposure of a room overexposes."""
DAYLIGHT = 1.1
"""Brightness of the sky that enters through windows, relative to what the camera sees of it."""
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
class Surroundings:
    """Light and color of rays that hit nothing.

    Attributes:
        inside: whether the camera is in a room.
    """

    inside: bool

    def sky(self, directions: Floats) -> Floats:
        """Return the light from directions (n, 3), shape (n, 3)."""
        if self.inside:
            return np.asarray(DAYLIGHT * self.color(directions), dtype=np.float32)
        rise = np.clip(directions[:, 2] * 4.0 + 0.4, 0.25, 1.0)
        return np.asarray(rise[:, None] * STUDIO, dtype=np.float32)

    def color(self, directions: Floats) -> Floats:
        """Return what the camera sees in directions (n, 3), shape (n, 3)."""
        if self.inside:
            return np.asarray(BRIGHTER * _landscape(directions), dtype=np.float32)
        top, bottom = BACKDROP
        share = np.clip(directions[:, 2:] * 1.4 + 0.75, 0.0, 1.0)
        return np.asarray(bottom + (top - bottom) * share, dtype=np.float32)


def studio(floor: Floor) -> Patch:
    """Return the ground on which a floor stands in views from outside."""
    x0, y0, x1, y1 = floor.bounds
    a, b, c, d = x0 - REACH, y0 - REACH, x1 + REACH, y1 + REACH
    corners = np.array([(a, b, DROP), (c, b, DROP), (c, d, DROP), (a, d, DROP)])
    return Patch("studio", "studio", "studio", corners, np.array([[0, 1, 2], [0, 2, 3]]))


def _landscape(directions: Floats) -> Floats:
    """Return a hazy sky above hills, trees and a lawn."""
    rise = directions[:, 2] / np.maximum(np.hypot(directions[:, 0], directions[:, 1]), 1e-6)
    azimuth = np.arctan2(directions[:, 1], directions[:, 0])
    share = np.clip(rise / 1.1, 0.0, 1.0)[:, None]
    sky = HORIZON + (ZENITH - HORIZON) * share**0.8
    clouds = sum(np.sin(k * azimuth + p) * np.sin(m * rise + q) for k, m, p, q in WAVES) / len(WAVES)
    sky = sky + (np.clip(clouds * 2.5, 0.0, 1.0) * np.exp(-np.abs(rise - 0.35) * 3.0))[:, None] * (1.15 - sky)
    hills = 0.055 + 0.018 * np.sin(3.0 * azimuth + 0.7) + 0.010 * np.sin(7.0 * azimuth + 2.0)
    crowns = 0.004 + sum(np.abs(np.sin(k * azimuth + p)) * 0.028 / (1.0 + j) for j, (k, _, p, _) in enumerate(TREES))
    leaves = 0.75 + 6.0 * rise + 0.12 * np.sin(151.0 * azimuth) * np.sin(223.0 * rise + 3.0 * np.sin(29.0 * azimuth))
    near = np.clip(-rise * 2.5, 0.0, 1.0)[:, None]
    reach = FLOOR_ABOVE / np.maximum(-rise, 0.02)
    x, y = reach * np.cos(azimuth), reach * np.sin(azimuth)
    paved = (np.abs(np.mod(x + 3.0 * np.sin(y / 19.0), 26.0) - 13.0) < 2.6)[:, None]
    grown = (0.85 + 0.12 * np.sin(1.7 * x) * np.sin(2.3 * y) + 0.08 * np.sin(0.31 * x + 0.23 * y))[:, None]
    ground = np.where(paved, PAVING, FAR_LAWN + (LAWN * grown - FAR_LAWN) * near)
    color = np.where((rise < hills)[:, None], HILLS, sky)
    color = np.where((rise < crowns)[:, None], WOOD * leaves[:, None], color)
    return np.asarray(np.where((rise < 0.0)[:, None], ground, color), dtype=np.float32)


WAVES = ((5.0, 9.0, 0.3, 1.0), (11.0, 17.0, 1.9, 0.4), (23.0, 31.0, 4.0, 2.2), (47.0, 53.0, 2.6, 5.1))
TREES = ((4.0, 0.0, 0.5, 0.0), (9.0, 0.0, 1.7, 0.0), (21.0, 0.0, 0.2, 0.0), (46.0, 0.0, 2.9, 0.0))
"""Frequencies and phases along azimuth and rise of clouds and of the crowns of trees."""


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

    def __init__(self, panels: Sequence[CeilingPanel], target: tuple[float, float]) -> None:
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
