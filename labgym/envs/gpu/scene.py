"""Layouts in the memory of a device."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from labgym.envs.gpu import wp
from labgym.envs.planar.scene import PlanarScene, scene_of
from labgym.envs.world import World
from labgym.scenes import SceneMesh
from labgym.scenes.rays import Geometry, ray_mesh

FACE_BYTES = 84
"""Approximate memory of a face with its share of Warp's tree, bytes."""


class DeviceScene:
    """The obstacles that a robot touches, and the barriers from which clearances are measured.

    Args:
        scene: the layout for the planar kernel. device: of Warp.

    Attributes:
        addresses: (6,) of the sides (m, 5: first corner, normal, length), the first side of each outline, the reach of
            each outline, the first member of each cell, the members, and the boxes (k, 6: center, half extents, axis).
        sizes: (6,) their number of rows.
        plan: (4,) corner, columns and rows of the grid of cells.
        nbytes: size in memory, bytes.
    """

    def __init__(self, scene: PlanarScene, device: Any) -> None:
        solids, near, boxes = scene.plan.solids, scene.plan.near, scene.boxes
        sides = np.column_stack([solids.corners, solids.normals, solids.lengths])
        tables: tuple[NDArray[Any], ...] = (
            sides,
            solids.first.astype(np.int32),
            solids.reach,
            near.first.astype(np.int32),
            near.members.astype(np.int32),
            np.column_stack([boxes.center, boxes.half, boxes.axis]),
        )
        # The addresses are valid as long as these live.
        self._arrays = [wp.array(np.ascontiguousarray(table), device=device) for table in tables]
        self.addresses = np.array([array.ptr or 0 for array in self._arrays], dtype=np.uint64)
        self.sizes = np.array([len(table) for table in tables], dtype=np.int32)
        self.plan = np.concatenate([near.corner, near.shape])
        self.nbytes = sum(table.nbytes for table in tables)


class DeviceMesh:
    """Triangles that rays hit.

    Args:
        mesh: the triangles. device: of Warp.

    Attributes:
        number: by which kernels know the mesh. nbytes: approximate size in memory, bytes.
    """

    def __init__(self, mesh: SceneMesh, device: Any) -> None:
        corners = wp.array(mesh.vertices.astype(np.float32), dtype=wp.vec3, device=device)
        faces = wp.array(mesh.faces.astype(np.int32).ravel(), dtype=wp.int32, device=device)
        self._mesh = wp.Mesh(corners, faces)
        self.number = int(self._mesh.id)
        self.nbytes = FACE_BYTES * len(mesh.faces)


def device_scene(world: World, device: Any) -> DeviceScene:
    """Return the scene of a world on a device; it is built once."""
    return world.derived(f"scene on {device}", lambda _: DeviceScene(scene_of(world), device))


def device_mesh(world: World, geometry: Geometry, device: Any) -> DeviceMesh:
    """Return the mesh of a world on a device; it is built once."""
    mesh = world.derived(geometry, lambda layout: ray_mesh(layout, geometry))
    return world.derived(f"{geometry} mesh on {device}", lambda _: DeviceMesh(mesh, device))
