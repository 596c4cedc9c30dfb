"""Surfaces of a scene for ray-traced pictures: opaque and translucent, with smooth normals and materials."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from embreex.mesh_construction import TriangleMesh
from numpy.typing import NDArray

from labgym.assets.meshes.normals import corner_normals
from labgym.assets.shapes import MATERIALS
from labgym.scenes.finishes import METALS
from labgym.scenes.mesh import MATERIAL_NAMES, SceneMesh
from labgym.scenes.rays import embree_scene

Floats = NDArray[np.float32]
FAR = np.float32(1e4)
GLOSS = {"floor_vinyl": 0.5, "floor_epoxy": 1.0, "floor_terrazzo": 0.8, "floor_tile": 0.5}
"""Strength of mirror images on floor coverings, relative to the strongest."""
GHOST = np.float32(0.12)
"""Opacity of a face of furniture that would hide what is behind it."""


@dataclass(frozen=True)
class Look:
    """Materials as arrays over `MATERIAL_NAMES`: linear colors, opacity, glow, mirror strength and metal."""

    color: Floats
    opacity: Floats
    glow: Floats
    mirror: Floats
    metal: NDArray[np.bool_]


def looks() -> Look:
    """Return the looks of all materials."""
    materials = [MATERIALS[name] for name in MATERIAL_NAMES]
    color = np.array([material.rgba[:3] for material in materials], dtype=np.float32) ** np.float32(2.2)
    polish = np.array([material.specular * material.shininess for material in materials], dtype=np.float32)
    floor = np.array([GLOSS.get(name, 0.0) for name in MATERIAL_NAMES], dtype=np.float32)
    return Look(
        color=color,
        opacity=np.array([material.rgba[3] for material in materials], dtype=np.float32),
        glow=np.array([1.6 * material.emission for material in materials], dtype=np.float32),
        mirror=np.where(polish > 0.1, 0.04, 0.0).astype(np.float32) + 0.06 * floor,
        metal=np.array([name in METALS for name in MATERIAL_NAMES]),
    )


class Scene:
    """A mesh in two Embree scenes, opaque and translucent, with corner normals and materials."""

    def __init__(self, mesh: SceneMesh, normals: Floats | None = None, ghost: NDArray[np.bool_] | None = None) -> None:
        """Build the scenes.

        Args:
            normals: those of the face corners (m, 3, 3), if they are known.
            ghost: which faces are translucent whatever their material (m,); none by default.
        """
        self.look = looks()
        ghost = np.zeros(len(mesh.faces), dtype=np.bool_) if ghost is None else ghost
        self._ghosts = np.unique(mesh.owner[ghost])
        if normals is None:
            normals = corner_normals(mesh.vertices, mesh.faces).astype(np.float32)
        clear = ghost | (self.look.opacity[mesh.material] < 0.85)
        self.opaque = Surfaces(mesh, np.flatnonzero(~clear), normals)
        self.clear = Surfaces(mesh, np.flatnonzero(clear), normals)

    def opacity(self, hits: Hits) -> Floats:
        """Return the opacity at hits of translucent faces, shape (n,)."""
        opacity = self.look.opacity[hits.material]
        return np.where(np.isin(hits.owner, self._ghosts), np.minimum(GHOST, opacity), opacity)


@dataclass(frozen=True)
class Hits:
    """Hits of n rays: whether one exists, distance, face normal and smooth normal towards the ray (n, 3), material.

    Attributes:
        owner: index of the placement, or `ROOM`.
    """

    hit: NDArray[np.bool_]
    distance: Floats
    side: Floats
    normal: Floats
    material: NDArray[np.int64]
    owner: NDArray[np.int64]


class Surfaces:
    """A subset of a mesh's faces in an Embree scene."""

    def __init__(self, mesh: SceneMesh, subset: NDArray[np.int64], normals: Floats) -> None:
        faces = mesh.faces[subset]
        self._scene = embree_scene(len(faces))
        self._vertices = np.ascontiguousarray(mesh.vertices, dtype=np.float32)
        self._empty = len(faces) == 0
        if not self._empty:
            self._mesh = TriangleMesh(self._scene, self._vertices, np.ascontiguousarray(faces, dtype=np.int32))
            self._normals = normals[subset]
            self._material, self._owner = mesh.material[subset], mesh.owner[subset]

    def cast(self, origins: Floats, directions: Floats, reach: Floats | None = None, smooth: bool = True) -> Hits:
        """Return the first hits of rays within the distances `reach` (n,).

        Args:
            smooth: whether normals are interpolated over faces; otherwise they are those of the faces.
        """
        count = len(origins)
        limit = np.full(count, FAR) if reach is None else reach.astype(np.float32)
        nowhere, none = np.zeros((count, 3), dtype=np.float32), np.zeros(count, dtype=np.int64)
        if self._empty or count == 0:
            return Hits(np.zeros(count, dtype=bool), limit, nowhere, nowhere, none, none)
        result = self._scene.run(origins, directions, dists=limit.copy(), output=1)
        hit = result["primID"] >= 0
        # Most rays miss glass, and most hit something opaque.
        here: slice | NDArray[np.int64] = slice(None) if hit.all() else np.flatnonzero(hit)
        face, outward = result["primID"][here], result["Ng"][here]
        side = facing(-directions[here], outward / np.maximum(norms(outward), 1e-12))
        normal = side
        if smooth:
            u, v = result["u"][here, None], result["v"][here, None]
            corners = self._normals[face]
            normal = (1.0 - u - v) * corners[:, 0] + u * corners[:, 1] + v * corners[:, 2]
            normal = facing(side, normal / np.maximum(norms(normal), 1e-9))
        material, owner = self._material[face], self._owner[face]
        if isinstance(here, slice):
            return Hits(hit, result["tfar"], side, normal, material, owner)
        return Hits(
            hit,
            result["tfar"],
            _spread(nowhere, here, side),
            _spread(nowhere, here, normal),
            _spread(none, here, material),
            _spread(none, here, owner),
        )

    def blocked(self, origins: Floats, directions: Floats, reach: Floats) -> NDArray[np.bool_]:
        """Return which rays hit a face within the distances `reach` (n,), shape (n,)."""
        if self._empty or len(origins) == 0:
            return np.zeros(len(origins), dtype=bool)
        limit = np.ascontiguousarray(reach, dtype=np.float32).copy()
        return np.asarray(self._scene.run(origins, directions, dists=limit, query="OCCLUDED") == 0)


def norms(vectors: Floats) -> Floats:
    """Return the lengths of vectors (n, 3), shape (n, 1)."""
    return np.asarray(np.sqrt(np.einsum("ij,ij->i", vectors, vectors))[:, None])


def facing(side: Floats, vectors: Floats) -> Floats:
    """Return vectors (n, 3), reversed if they point away from `side` (n, 3)."""
    flip = np.where(np.einsum("ij,ij->i", vectors, side) < 0.0, np.float32(-1.0), np.float32(1.0))
    return np.asarray(vectors * flip[:, None], dtype=np.float32)


def _spread(empty: NDArray[Any], here: NDArray[np.int64], values: NDArray[Any]) -> NDArray[Any]:
    """Return a copy of an array with values at indices."""
    spread = empty.copy()
    spread[here] = values
    return spread
