"""Fast pictures: furniture merged into a few large meshes, since OpenGL spends time on every geom, and culling."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from labgym.layouts import Layout
from labgym.scenes.mesh import MATERIAL_NAMES, ROOM, SceneMesh, smooth_normals
from labgym.scenes.mjcf import SpecBuilder, set_looks
from labgym.scenes.patches import Array, Faces

CELL = 3.0
"""Side of the squares of the floor whose furniture is merged, meters; geoms out of view are not drawn."""


@dataclass(frozen=True)
class Batch:
    """Faces of one material: the furniture in one square of the floor.

    Attributes:
        material: name of the material.
        vertices: shape (n, 3), meters. faces: indices of vertices, shape (m, 3).
        normals: unit normals of the corners of faces, shape (m, 3, 3).
    """

    material: str
    vertices: Array
    faces: Faces
    normals: NDArray[np.float32]


def batches(layout: Layout, mesh: SceneMesh) -> Iterator[Batch]:
    """Yield the faces of all placements and installations of a layout, merged by material and square of the floor.

    Args:
        mesh: the layout's `scene_mesh`.
    """
    faces = np.flatnonzero(mesh.owner != ROOM)
    if not len(faces):
        return
    squares = np.floor(np.array([placement.position[:2] for placement in layout.placements]) / CELL).astype(np.int64)
    _, square = np.unique(squares, axis=0, return_inverse=True)
    key = square.ravel()[mesh.owner[faces]] * len(MATERIAL_NAMES) + mesh.material[faces]
    order = np.argsort(key, kind="stable")
    normals = smooth_normals(mesh, layout)
    for members in np.split(faces[order], np.flatnonzero(np.diff(key[order])) + 1):
        used, corners = np.unique(mesh.faces[members], return_inverse=True)
        name = MATERIAL_NAMES[mesh.material[members[0]]]
        yield Batch(name, mesh.vertices[used], corners.reshape(-1, 3), normals[members])


def batched_spec(layout: Layout, mesh: SceneMesh) -> mujoco.MjSpec:
    """Return a specification that looks as that of `to_mjcf` and is drawn in about half of the time.

    Placements are no bodies, and only the building collides. Walls have the names of `to_mjcf`.

    Args:
        mesh: the layout's `scene_mesh`.
    """
    scene = SpecBuilder(layout.id)
    set_looks(scene.spec, layout.floor)
    scene.add_floor(layout.floor)
    for number, batch in enumerate(batches(layout, mesh)):
        scene.add_faces(f"batch_{number}", batch.material, batch.vertices, batch.faces, batch.normals)
    return scene.spec


def in_view(model: mujoco.MjModel, data: mujoco.MjData, camera: mujoco.MjvCamera, aspect: float) -> NDArray[np.bool_]:
    """Return which geoms' bounding spheres reach into a free camera's field of view, shape (ngeom,).

    Planes have no bounding sphere and always count as in view.

    Args:
        camera: a free camera; its vertical field of view is the model's `vis.global_.fovy`.
        aspect: width of the picture over its height.
    """
    azimuth, elevation = math.radians(camera.azimuth), math.radians(camera.elevation)
    forward = np.array(
        [math.cos(elevation) * math.cos(azimuth), math.cos(elevation) * math.sin(azimuth), math.sin(elevation)]
    )
    right = np.array([math.sin(azimuth), -math.cos(azimuth), 0.0])
    axes = np.stack([right, np.cross(right, forward), forward])
    eye = np.array(camera.lookat) - camera.distance * forward
    # Coordinates along right, up and forward; the four side planes pass through the eye.
    local = (data.geom_xpos - eye) @ axes.T
    radius = model.geom_rbound
    tall = math.tan(math.radians(model.vis.global_.fovy) / 2.0)
    inside = local[:, 2] > -radius
    for axis, slope in ((0, tall * aspect), (1, tall)):
        inside &= np.abs(local[:, axis]) - local[:, 2] * slope < radius * math.hypot(1.0, slope)
    visible: NDArray[np.bool_] = inside | (model.geom_type == mujoco.mjtGeom.mjGEOM_PLANE)
    return visible
