"""Glass in ray-traced pictures: what translucent surfaces add to a ray and what they let through."""

from __future__ import annotations

import numpy as np

from labgym.scenes.surfaces import Floats, Scene

LAYERS = 5
"""Largest number of translucent surfaces that a ray passes."""
NUDGE = np.float32(2e-4)
"""Distance behind a translucent surface at which the ray goes on, meters."""
NORMAL_REFLECTANCE = 0.04
"""Share of light that glass mirrors at normal incidence (refractive index 1.5)."""
DULL, BRIGHT = np.float32(0.30), np.float32(1.05)
"""Brightness of the mirror images of walls and of the ceiling in glass."""


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
        opacity = look.opacity[material]
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
