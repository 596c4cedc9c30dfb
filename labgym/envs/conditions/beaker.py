"""A beaker of liquid on the robot's deck, and the linear model of its surface.

The first mode of the surface of a liquid in an upright cylinder is a damped oscillator for each horizontal axis. It was
validated against measurements by Di Leva et al. (2022, doi 10.1007/s11044-022-09841-0).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from labgym.envs.checks import positive
from labgym.envs.conditions.bodies import BodyShape
from labgym.envs.robot import DECK
from labgym.scenes.mesh import MATERIAL_NAMES, ROOM, SceneMesh
from labgym.scenes.patches import join

GRAVITY = 9.81
"""Acceleration of gravity, m/s2."""
ROOT = 1.841
"""First root of the derivative of the Bessel function J1."""
RISE = 0.837
"""Factor of the surface's rise at the wall: 2 / (ROOT^2 - 1)."""


@dataclass(frozen=True)
class Beaker:
    """A cylinder of liquid; the defaults are a 1 L beaker, filled to 10 mm below its rim.

    Attributes:
        radius: of the surface, meters. depth: of the liquid, meters.
        freeboard: height of the rim above the surface at rest, meters.
        damping: ratio of the first mode.
    """

    radius: float = 0.052
    depth: float = 0.115
    freeboard: float = 0.010
    damping: float = 0.005

    def __post_init__(self) -> None:
        positive(self, "radius", "depth", "freeboard")
        positive(self, "damping", zero=True)

    @property
    def frequency(self) -> float:
        """Angular frequency of the first mode, rad/s."""
        return math.sqrt(ROOT * GRAVITY / self.radius * math.tanh(ROOT * self.depth / self.radius))

    def rise(self, displacement: float) -> float:
        """Return the rise of the surface at the wall, meters, for a displacement of the oscillator, meters."""
        return RISE * self.radius * self.frequency**2 * displacement / GRAVITY


BEHIND = 0.185
"""Distance of the beaker from the robot's axis, meters: the column stands on the axis."""
WALL = 0.003
SECTIONS = 32


@lru_cache(maxsize=16)
def beaker_shape(beaker: Beaker) -> BodyShape:
    """Return a beaker in the robot frame, its origin on the floor at the robot's axis."""
    import trimesh

    height, radius = beaker.depth + beaker.freeboard, beaker.radius
    create = trimesh.creation
    wall = create.annulus(r_min=radius, r_max=radius + WALL, height=height, sections=SECTIONS)
    liquid = create.cylinder(radius=radius, height=beaker.depth, sections=SECTIONS)
    liquid.apply_translation((0.0, 0.0, -beaker.freeboard / 2.0))
    parts = [(wall, "borosilicate"), (liquid, "blue_liquid")]
    vertices, faces = join([(np.asarray(each.vertices), np.asarray(each.faces)) for each, _ in parts])
    material = np.concatenate([np.full(len(each.faces), MATERIAL_NAMES.index(name)) for each, name in parts])
    placed = vertices + np.array([-BEHIND, 0.0, DECK + height / 2.0])
    return BodyShape(SceneMesh(placed, faces, material, np.full(len(faces), ROOM)))
