"""A scene's surfaces for tracing pictures: opaque and clear ones, with smooth normals and the looks of materials."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
from numpy.typing import NDArray

from labgym.assets.meshes.normals import corner_normals
from labgym.assets.shapes import MATERIALS
from labgym.scenes.mesh import MATERIAL_NAMES, SceneMesh

Floats = NDArray[np.float32]
METALS = ("stainless", "chrome", "aluminium", "galvanised", "brass")
FAR = np.float32(1e4)


@dataclass(frozen=True)
class Look:
    """Materials as arrays over `MATERIAL_NAMES`: linear colours, opacity, glow, mirror strength and metal."""

    colour: Floats
    opacity: Floats
    glow: Floats
    mirror: Floats
    metal: NDArray[np.bool_]


def looks() -> Look:
    """Return the looks of all materials."""
    materials = [MATERIALS[name] for name in MATERIAL_NAMES]
    colour = np.array([material.rgba[:3] for material in materials], dtype=np.float32) ** np.float32(2.2)
    polish = np.array([material.specular * material.shininess for material in materials], dtype=np.float32)
    floor = np.array([0.5 * (name == "floor_vinyl") for name in MATERIAL_NAMES], dtype=np.float32)
    return Look(
        colour=colour,
        opacity=np.array([material.rgba[3] for material in materials], dtype=np.float32),
        glow=np.array([1.6 * material.emission for material in materials], dtype=np.float32),
        mirror=np.where(polish > 0.1, 0.04, 0.0).astype(np.float32) + 0.06 * floor,
        metal=np.array([name in METALS for name in MATERIAL_NAMES]),
    )


class Scene:
    """A mesh in two Embree scenes, opaque and translucent, with corner normals and materials."""

    def __init__(self, mesh: SceneMesh) -> None:
        self.look = looks()
        clear = self.look.opacity[mesh.material] < 0.85
        self.opaque = Surfaces(mesh, np.flatnonzero(~clear))
        self.clear = Surfaces(mesh, np.flatnonzero(clear))


@dataclass(frozen=True)
class Hits:
    """Where rays hit, (n,): whether, how far, face and smooth normal towards the ray (n, 3), material."""

    hit: NDArray[np.bool_]
    distance: Floats
    side: Floats
    normal: Floats
    material: NDArray[np.int64]


class Surfaces:
    """Some faces of a mesh that rays can be cast at."""

    def __init__(self, mesh: SceneMesh, chosen: NDArray[np.int64]) -> None:
        faces = mesh.faces[chosen]
        self._scene = EmbreeScene()
        self._vertices = np.ascontiguousarray(mesh.vertices, dtype=np.float32)
        self._empty = len(faces) == 0
        if not self._empty:
            self._mesh = TriangleMesh(self._scene, self._vertices, np.ascontiguousarray(faces, dtype=np.int32))
            self._normals = corner_normals(mesh.vertices, faces).astype(np.float32)
            self._material = mesh.material[chosen]

    def cast(self, origins: Floats, directions: Floats, reach: Floats | None = None) -> Hits:
        """Find the first hit of rays, no further than `reach` (n,)."""
        count = len(origins)
        limit = np.full(count, FAR) if reach is None else reach.astype(np.float32)
        if self._empty or count == 0:
            nowhere = np.zeros((count, 3), dtype=np.float32)
            return Hits(np.zeros(count, dtype=bool), limit, nowhere, nowhere, np.zeros(count, dtype=np.int64))
        found = self._scene.run(origins, directions, dists=limit.copy(), output=1)
        hit = found["primID"] >= 0
        face = np.where(hit, found["primID"], 0)
        side = facing(-directions, found["Ng"] / np.maximum(norms(found["Ng"]), 1e-12))
        u, v = found["u"][:, None], found["v"][:, None]
        corners = self._normals[face]
        normal = (1.0 - u - v) * corners[:, 0] + u * corners[:, 1] + v * corners[:, 2]
        normal = facing(side, normal / np.maximum(norms(normal), 1e-9))
        return Hits(hit, found["tfar"], side, normal, self._material[face])

    def blocked(self, origins: Floats, directions: Floats) -> NDArray[np.bool_]:
        """Tell which rays hit anything."""
        if self._empty or len(origins) == 0:
            return np.zeros(len(origins), dtype=bool)
        return np.asarray(self._scene.run(origins, directions, query="OCCLUDED") == 0)


def norms(vectors: Floats) -> Floats:
    """Return the lengths of vectors (n, 3), shape (n, 1)."""
    return np.asarray(np.sqrt(np.einsum("ij,ij->i", vectors, vectors))[:, None])


def facing(side: Floats, vectors: Floats) -> Floats:
    """Return vectors (n, 3), turned round where they point away from `side` (n, 3)."""
    flip = np.where(np.einsum("ij,ij->i", vectors, side) < 0.0, np.float32(-1.0), np.float32(1.0))
    return np.asarray(vectors * flip[:, None], dtype=np.float32)
