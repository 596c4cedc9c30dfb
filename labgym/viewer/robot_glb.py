"""The robot as binary glTF."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import mujoco
import numpy as np

from labgym.assets.meshes.colors import to_linear
from labgym.envs.robot import robot_spec

if TYPE_CHECKING:
    import trimesh

VISUAL = 1
"""Group of the robot's visual geoms."""


@lru_cache(maxsize=1)
def robot_glb() -> bytes:
    """Return the robot's visual geoms at yaw 0, as glTF has them: y up, origin on the floor."""
    import trimesh

    model = robot_spec().compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    up = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, -1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
    scene = trimesh.Scene()
    for geom in np.flatnonzero(model.geom_group == VISUAL).tolist():
        mesh = _shape(model, geom)
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = data.geom_xmat[geom].reshape(3, 3), data.geom_xpos[geom]
        material = int(model.geom_matid[geom])
        red, green, blue, alpha = model.mat_rgba[material].tolist()
        mesh.visual = trimesh.visual.TextureVisuals(  # type: ignore[no-untyped-call]
            material=trimesh.visual.material.PBRMaterial(  # type: ignore[no-untyped-call]
                name=f"robot_{material}",
                baseColorFactor=[to_linear(red), to_linear(green), to_linear(blue), alpha],
                metallicFactor=0.0,
                roughnessFactor=1.0 - 0.7 * float(model.mat_shininess[material]),
            )
        )
        scene.add_geometry(mesh, node_name=f"robot_{geom}", geom_name=f"robot_{geom}", transform=up @ pose)
    return bytes(scene.export(file_type="glb", include_normals=True))  # type: ignore[no-untyped-call]


def _shape(model: mujoco.MjModel, geom: int) -> trimesh.Trimesh:
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
