"""Parts as triangles; the number of sides of round parts is set here."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from labgym.assets.shapes.parts import Array, Part, Point, Primitive, Vector

if TYPE_CHECKING:
    import trimesh

SECTIONS = 24
"""Sides of a full turn."""

Faces = NDArray[np.int64]


def tessellate(part: Part) -> tuple[Array, Faces]:
    """Return a part's vertices (n, 3) in the asset's frame and its faces (m, 3), wound outwards."""
    vertices, faces = part.triangles or local_mesh(part.primitive, part.size, part.profile)
    return vertices @ part.rotation.T + np.array(part.position), faces


@lru_cache(maxsize=4096)
def local_mesh(primitive: Primitive, size: Vector, profile: tuple[Point, ...] = ()) -> tuple[Array, Faces]:
    """Return vertices and faces of a primitive before rotation and translation. The arrays are read-only."""
    mesh = _mesh(primitive, size, profile)
    vertices, faces = np.array(mesh.vertices, dtype=np.float64), np.array(mesh.faces, dtype=np.int64)
    vertices.setflags(write=False)
    faces.setflags(write=False)
    return vertices, faces


def _mesh(primitive: Primitive, size: Vector, profile: tuple[Point, ...]) -> trimesh.Trimesh:
    import trimesh

    creation = trimesh.creation
    mesh: trimesh.Trimesh
    if primitive == "box":
        mesh = creation.box(extents=size)
    elif primitive == "cylinder":
        mesh = creation.cylinder(radius=size[0] / 2.0, height=size[2], sections=_sections(size[0]))
    elif primitive == "capsule":
        sides = 16 if size[0] > 0.02 else 8
        # trimesh stands the capsule's lower cap center on the origin.
        mesh = creation.capsule(radius=size[0] / 2.0, height=max(size[2] - size[0], 1e-9), count=[sides // 2, sides])
        mesh.apply_translation(-mesh.bounds.mean(axis=0))
    elif primitive in ("sphere", "ellipsoid"):
        large = sorted(size)[1] > 0.05
        ball = creation.uv_sphere(radius=0.5, count=[12, SECTIONS] if large else [6, 12])
        mesh = trimesh.Trimesh(ball.vertices * np.array(size), ball.faces, process=False)
    elif primitive == "revolve":
        mesh = creation.revolve(np.array(profile), sections=_sections(2.0 * max(r for r, _ in profile)))
    else:
        mesh = _prism(np.array(profile), size[2])
    return mesh


def _sections(diameter: float) -> int:
    """Sides of a full turn; a multiple of four, so that all four sides are reached exactly."""
    return SECTIONS if diameter > 0.03 else 16 if diameter > 0.012 else 8


def _prism(outline: Array, length: float) -> trimesh.Trimesh:
    import trimesh

    count = len(outline)
    ring = np.arange(count)
    after = np.roll(ring, -1)
    fan = np.stack([np.zeros(count - 2, dtype=np.int64), ring[1:-1], ring[2:]], axis=1)
    sides = np.concatenate(
        [np.stack([ring, after, after + count], axis=1), np.stack([ring, after + count, ring + count], axis=1)]
    )
    bottom = np.column_stack([outline, np.full(count, -length / 2.0)])
    top = np.column_stack([outline, np.full(count, length / 2.0)])
    faces = np.concatenate([fan[:, ::-1], fan + count, sides])
    return trimesh.Trimesh(np.concatenate([bottom, top]), faces, process=False)
