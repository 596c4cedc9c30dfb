"""How people look: a torso in a lab coat with arms and a head, and two legs that swing as they walk.

A leg is 0.12 m wide at the height of the lidar, and the two are 0.22 to 0.30 m apart (assumption, within the 0.1 to
0.25 m of leg detectors for range finders).
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from labgym.envs.conditions.bodies import Body, BodyShape
from labgym.scenes.mesh import MATERIAL_NAMES, ROOM, SceneMesh

if TYPE_CHECKING:
    import trimesh

LEG_APART = 0.11
"""Distance of a leg from the middle, meters."""
SWING = 0.10
"""Greatest displacement of a leg along the heading, meters."""
STRIDE = 1.3
"""Way in which the legs swing once, meters: two steps at 1 m/s."""
LOOKS = (("edge_brown", "worktop_sand"), ("print_black", "front_walnut"), ("front_walnut", "cork"))
"""Materials of hair and skin; all coats are white, and all people share one leg, whose rays are cast at once."""
TROUSERS, SHOES = "powder_dark", "rubber"


def figure(number: int, x: float, y: float, yaw: float, walked: float, moving: bool) -> tuple[Body, ...]:
    """Return the bodies of a person.

    Args:
        number: of the person, from 0; decides on clothes and gait. x, y, yaw: meters and radians.
        walked: way so far, meters; where the legs are. moving: whether the legs swing.
    """
    torso, leg = torso_shape(number % len(LOOKS)), leg_shape()
    swing = SWING * math.sin(2.0 * math.pi * (walked / STRIDE + 0.37 * number)) if moving else 0.0
    cosine, sine = math.cos(yaw), math.sin(yaw)
    name = f"person {number + 1}"
    bodies = [Body(name, torso, (x, y, yaw))]
    for aside, ahead in ((LEG_APART, swing), (-LEG_APART, -swing)):
        bodies.append(Body(name, leg, (x + cosine * ahead - sine * aside, y + sine * ahead + cosine * aside, yaw)))
    return tuple(bodies)


@lru_cache(maxsize=len(LOOKS))
def torso_shape(look: int) -> BodyShape:
    """Return the torso with arms and head of a look, facing along +x."""
    import trimesh

    hair, skin = LOOKS[look]
    create = trimesh.creation
    coat = [
        _prism([(0.40, 0.20, 0.18), (0.95, 0.16, 0.13), (1.38, 0.22, 0.12), (1.48, 0.10, 0.08)], 12),
        *(_prism([(0.80, 0.05, 0.05), (1.40, 0.06, 0.06)], 8, (0.03, side * 0.23)) for side in (1.0, -1.0)),
    ]
    hands = [_prism([(0.70, 0.035, 0.045), (0.80, 0.04, 0.045)], 8, (0.04, side * 0.23)) for side in (1.0, -1.0)]
    face = create.icosphere(subdivisions=1, radius=0.11)
    face.apply_scale((1.0, 0.85, 1.15))
    face.apply_translation((0.02, 0.0, 1.61))
    top = create.icosphere(subdivisions=1, radius=0.115)
    top.apply_scale((1.0, 0.9, 1.1))
    top.apply_translation((-0.015, 0.0, 1.64))
    neck = _prism([(1.44, 0.055, 0.055), (1.55, 0.055, 0.055)], 8)
    parts = [*((each, "plastic_white") for each in coat), *((each, skin) for each in (face, neck, *hands))]
    return _shape([*parts, (top, hair)])


@lru_cache(maxsize=1)
def leg_shape() -> BodyShape:
    """Return a leg up to where the coat hides it, with a shoe along +x."""
    import trimesh

    shoe = trimesh.creation.box((0.26, 0.10, 0.08))
    shoe.apply_translation((0.05, 0.0, 0.04))
    leg = _prism([(0.06, 0.05, 0.05), (0.25, 0.06, 0.06), (0.46, 0.065, 0.065)], 12)
    return _shape([(leg, TROUSERS), (shoe, SHOES)])


def _prism(
    rings: list[tuple[float, float, float]], sides: int, center: tuple[float, float] = (0.0, 0.0)
) -> trimesh.Trimesh:
    """Return a closed surface through elliptic rings (height, half of the width, half of the depth), meters."""
    import trimesh

    angles = 2.0 * math.pi * np.arange(sides) / sides
    points = [
        np.column_stack(
            [center[0] + depth * np.cos(angles), center[1] + width * np.sin(angles), np.full(sides, height)]
        )
        for height, width, depth in rings
    ]
    ends = np.array([(*center, rings[0][0]), (*center, rings[-1][0])])
    faces = []
    for ring in range(len(rings) - 1):
        for k in range(sides):
            a, b = ring * sides + k, ring * sides + (k + 1) % sides
            faces += [(a, b, b + sides), (a, b + sides, a + sides)]
    low, high, last = len(rings) * sides, len(rings) * sides + 1, (len(rings) - 1) * sides
    for k in range(sides):
        after = (k + 1) % sides
        faces += [(low, after, k), (high, last + k, last + after)]
    return trimesh.Trimesh(np.concatenate([*points, ends]), np.array(faces), process=False)


def _shape(parts: list[tuple[trimesh.Trimesh, str]]) -> BodyShape:
    vertices, faces, materials, first = [], [], [], 0
    for mesh, material in parts:
        vertices.append(np.asarray(mesh.vertices, dtype=np.float64))
        faces.append(np.asarray(mesh.faces, dtype=np.int64) + first)
        materials.append(np.full(len(mesh.faces), MATERIAL_NAMES.index(material)))
        first += len(mesh.vertices)
    joined = np.concatenate(faces)
    return BodyShape(SceneMesh(np.concatenate(vertices), joined, np.concatenate(materials), np.full(len(joined), ROOM)))
