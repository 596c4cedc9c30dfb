"""Ray casting in a static scene by Embree: distances, faces and colors, without OpenGL."""

from __future__ import annotations

import copy
import math
from functools import cached_property
from typing import Any, Literal, Protocol

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
from numpy.typing import NDArray

from labgym.counts import check_address_space
from labgym.errors import OptionError
from labgym.layouts import Layout
from labgym.scenes.mesh import SceneMesh, scene_mesh, solid_mesh

Geometry = Literal["visual", "solid"]
SKY = np.array([205, 214, 224], dtype=np.uint8)
"""Color of rays that hit nothing."""
EMBREE_BYTES = 140
"""Memory that Embree's tree, the normals and the colors take for each face, bytes (measured over eight rooms)."""
EMBREE_RESERVED_BYTES = 250e6
"""Address space that Embree reserves with its first scene, with a margin, as measured."""
_SUN = np.array([0.35, 0.45, -0.82]) / np.linalg.norm([0.35, 0.45, -0.82])


def embree_scene(faces: int) -> EmbreeScene:
    """Return an empty scene of Embree with room for a number of faces.

    Raises:
        MemoryError: the limit of the address space is too low; Embree would crash.
    """
    check_address_space("ray tracing", EMBREE_RESERVED_BYTES + EMBREE_BYTES * faces)
    return EmbreeScene()


class RaySource(Protocol):
    """A scene that sensors cast rays against: a `RayScene`, or one of which parts move."""

    def cast(
        self, origins: NDArray[np.floating], directions: NDArray[np.floating], max_range: float = 10.0
    ) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
        """Return the distance to the first hit of each ray, and the face that it hits; -1 for nothing within reach."""
        ...

    def color(self, faces: NDArray[np.integer], directions: NDArray[np.floating]) -> NDArray[np.uint8]:
        """Return the color seen along rays, shape (n, 3)."""
        ...

    def owners(self, faces: NDArray[np.integer]) -> NDArray[np.int64]:
        """Return the index of the placement of each face, `ROOM` for floor and walls."""
        ...


class RayScene:
    """A layout as a static scene for ray casting; build it once and cast many rays.

    Attributes:
        mesh: the triangles; `cast` returns indices of its faces.
    """

    def __init__(self, layout: Layout | None, geometry: Geometry = "visual", mesh: SceneMesh | None = None) -> None:
        """Build the scene.

        Args:
            geometry: "visual" for the visible parts (glass is opaque); "solid" for the solids that collide, so that a
                range finder agrees with the physics.
            layout: the layout; None with a mesh.
            mesh: the triangles, if they are at hand: the result of `ray_mesh`, or of anything else.

        Raises:
            OptionError: unknown geometry, or neither layout nor mesh.
        """
        if mesh is None:
            if layout is None:
                raise OptionError("a ray scene needs a layout or a mesh")
            mesh = ray_mesh(layout, geometry)
        self.mesh: SceneMesh = mesh
        self._scene = embree_scene(len(self.mesh.faces))
        vertices = np.ascontiguousarray(self.mesh.vertices, dtype=np.float32)
        # Embree reads the buffers as long as the scene lives.
        self._buffers = TriangleMesh(self._scene, vertices, np.ascontiguousarray(self.mesh.faces, dtype=np.int32))

    @property
    def nbytes(self) -> int:
        """Approximate size without the mesh, bytes."""
        return EMBREE_BYTES * len(self.mesh.faces)

    @cached_property
    def _normals(self) -> NDArray[np.float32]:
        """Unit normals of the faces (m, 3)."""
        corners = self.mesh.vertices[self.mesh.faces]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
        return normals.astype(np.float32)

    @cached_property
    def _colors(self) -> NDArray[np.float32]:
        """Colors of the faces (m, 3), as `_flat_colors`."""
        return _flat_colors(self.mesh)

    def cast(
        self, origins: NDArray[np.floating], directions: NDArray[np.floating], max_range: float = 10.0
    ) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
        """Return the distance to the first hit of each ray, and the face that it hits.

        Args:
            origins: (n, 3) meters in the room frame. directions: (n, 3) unit vectors.
            max_range: distance that is returned for rays that hit nothing nearer, meters.

        Returns:
            Distances (n,) float32 and face indices (n,) int32, -1 for rays that hit nothing.
        """
        hits = self._hits(origins, directions, max_range)
        return hits["tfar"], hits["primID"]

    def _hits(
        self, origins: NDArray[np.floating], directions: NDArray[np.floating], max_range: float
    ) -> dict[str, NDArray[Any]]:
        """Return Embree's answers by name, each (n,) or (n, 3)."""
        starts = np.ascontiguousarray(origins, dtype=np.float32)
        along = np.ascontiguousarray(directions, dtype=np.float32)
        reach = np.full(len(starts), max_range, dtype=np.float32)
        hits: dict[str, NDArray[Any]] = self._scene.run(starts, along, dists=reach, output=1)
        return hits

    def color(
        self, faces: NDArray[np.integer], directions: NDArray[np.floating], yaw: float = 0.0
    ) -> NDArray[np.uint8]:
        """Return the color seen along rays, shape (n, 3): the face's own, lit from above and from the viewer.

        Args:
            faces: (n,) face indices from `cast`, -1 for the sky. directions: (n, 3) unit vectors.
            yaw: turn of the scene under the lights, radians; the directions are those after the turn.
        """
        hit = faces >= 0
        index = np.where(hit, faces, 0)
        normals = self._normals[index]
        if yaw:
            cosine, sine = math.cos(yaw), math.sin(yaw)
            turn = np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]], dtype=normals.dtype)
            normals = normals @ turn
        colors = lit(self._colors[index], normals, directions)
        colors[~hit] = SKY
        return colors

    def owners(self, faces: NDArray[np.integer]) -> NDArray[np.int64]:
        """Return the index of the placement of each face, `ROOM` for floor and walls."""
        owners: NDArray[np.int64] = self.mesh.owner[faces]
        return owners

    def recolored(self, colors: NDArray[np.float32]) -> RayScene:
        """Return the same scene with other colors of the faces, (m, 3) in [0, 255]; both share Embree's tree."""
        scene = copy.copy(self)
        scene.__dict__["_colors"] = colors
        return scene

    @property
    def colors(self) -> NDArray[np.float32]:
        """Colors of the faces (m, 3) in [0, 255], before they are lit."""
        return self._colors


def ray_mesh(layout: Layout, geometry: Geometry) -> SceneMesh:
    """Return the triangles of the ray scene of a layout.

    Raises:
        OptionError: unknown geometry.
    """
    if geometry not in ("visual", "solid"):
        raise OptionError(f"geometry must be 'visual' or 'solid', got {str(geometry)[:40]!r}")
    return scene_mesh(layout) if geometry == "visual" else solid_mesh(layout)


def lit(
    colors: NDArray[np.float32], normals: NDArray[np.floating], directions: NDArray[np.floating]
) -> NDArray[np.uint8]:
    """Return colors (n, 3) lit from above and from the viewer.

    Args:
        colors: (n, 3) in [0, 255]. normals: (n, 3) of the faces. directions: (n, 3) of the rays.
    """
    facing = np.einsum("ij,ij->i", normals, np.asarray(directions, dtype=np.float32))
    sunlit = np.abs(normals @ _SUN.astype(np.float32)) * (normals @ _SUN * facing > 0.0)
    light = 0.45 + 0.25 * np.abs(facing) + 0.30 * sunlit
    shades: NDArray[np.uint8] = np.clip(colors * light[:, None], 0.0, 255.0).astype(np.uint8)
    return shades


def _flat_colors(mesh: SceneMesh) -> NDArray[np.float32]:
    """Return face colors (m, 3) in [0, 255]; translucent ones are blended with a light gray."""
    rgba = mesh.rgba
    opacity = rgba[:, 3:]
    return (255.0 * (rgba[:, :3] * opacity + 0.82 * (1.0 - opacity))).astype(np.float32)
