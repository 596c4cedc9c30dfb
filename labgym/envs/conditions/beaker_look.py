"""How a beaker looks in pictures: a glass with liquid on the robot's deck, behind the column."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from labgym.envs.conditions.beaker import Beaker
from labgym.envs.conditions.bodies import Shape
from labgym.envs.robot import DECK
from labgym.scenes.mesh import MATERIAL_NAMES, ROOM, SceneMesh
from labgym.scenes.patches import join

BEHIND = 0.185
"""Distance of the beaker from the robot's axis, meters: the column stands on the axis."""
WALL = 0.003
SECTIONS = 32


@lru_cache(maxsize=16)
def beaker_shape(beaker: Beaker) -> Shape:
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
    return Shape(SceneMesh(placed, faces, material, np.full(len(faces), ROOM)))
