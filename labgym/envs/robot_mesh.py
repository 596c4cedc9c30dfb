"""The robot as triangles, for pictures that MuJoCo does not draw."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import mujoco
import numpy as np

from labgym.envs.robot import robot_spec
from labgym.scenes.mesh import MATERIAL_NAMES, ROOM, SceneMesh
from labgym.scenes.patches import join

if TYPE_CHECKING:
    import trimesh

VISUAL = 1
"""Group of the robot's visual geoms."""
LOOKS = {
    "white": "powder_white",
    "graphite": "plastic_dark",
    "rubber": "rubber",
    "glass": "screen_dark",
    "accent": "edge_teal",
}
"""Material of scenes for each finish of the robot."""


@lru_cache(maxsize=1)
def robot_mesh() -> SceneMesh:
    """Return the robot's visual geoms at the pose (0, 0, 0)."""
    model = robot_spec().compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    meshes, materials = [], []
    for geom in np.flatnonzero(model.geom_group == VISUAL).tolist():
        mesh = geom_mesh(model, geom)
        turn = data.geom_xmat[geom].reshape(3, 3)
        meshes.append((np.asarray(mesh.vertices) @ turn.T + data.geom_xpos[geom], np.asarray(mesh.faces)))
        finish = model.material(int(model.geom_matid[geom])).name.rpartition("/")[2]
        materials.append(np.full(len(mesh.faces), MATERIAL_NAMES.index(LOOKS[finish])))
    vertices, faces = join(meshes)
    return SceneMesh(vertices, faces, np.concatenate(materials), np.full(len(faces), ROOM))


def geom_mesh(model: mujoco.MjModel, geom: int) -> trimesh.Trimesh:
    """Return a geom's mesh in its own frame."""
    import trimesh

    creation = trimesh.creation
    mesh: trimesh.Trimesh
    kind, (x, y, z) = model.geom_type[geom], model.geom_size[geom].tolist()
    if kind == mujoco.mjtGeom.mjGEOM_MESH:
        number = model.geom_dataid[geom]
        first, count = model.mesh_vertadr[number], model.mesh_vertnum[number]
        start, faces = model.mesh_faceadr[number], model.mesh_facenum[number]
        vertices = model.mesh_vert[first : first + count]
        mesh = trimesh.Trimesh(vertices, model.mesh_face[start : start + faces], process=False)
    elif kind == mujoco.mjtGeom.mjGEOM_BOX:
        mesh = creation.box(extents=(2.0 * x, 2.0 * y, 2.0 * z))
    elif kind == mujoco.mjtGeom.mjGEOM_CAPSULE:
        mesh = creation.capsule(radius=x, height=2.0 * y)
        mesh.apply_translation(-mesh.bounds.mean(axis=0))
    elif kind == mujoco.mjtGeom.mjGEOM_CYLINDER:
        mesh = creation.cylinder(radius=x, height=2.0 * y, sections=32)
    else:
        mesh = creation.icosphere(subdivisions=2, radius=1.0)
        mesh.vertices *= (x, y, z) if kind == mujoco.mjtGeom.mjGEOM_ELLIPSOID else x
    return mesh
