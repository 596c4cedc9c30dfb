"""Surroundings of a scene in ray-traced pictures: a studio outside, a landscape behind windows inside."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labgym.layouts.floor import Floor
from labgym.scenes.patches import Patch

Floats = NDArray[np.float32]

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
"""Brightness of what is seen through windows: a camera that is set for a room overexposes it."""
DAYLIGHT = 1.1
"""Brightness of the sky that enters through windows, relative to what the camera sees of it."""


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
