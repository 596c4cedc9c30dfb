"""Meshes of the page as binary glTF: the robot, and the shapes of what moves."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import mujoco
import numpy as np

from labgym.assets.meshes.colors import to_linear
from labgym.assets.shapes import MATERIALS
from labgym.envs.robot import robot_spec
from labgym.envs.robot_mesh import VISUAL, geom_mesh
from labgym.scenes.mesh import MATERIAL_NAMES, SceneMesh

UP = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, -1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
"""From z up, as here, to y up, as in glTF."""


@lru_cache(maxsize=1)
def robot_glb() -> bytes:
    """Return the robot's visual geoms at yaw 0, as glTF has them: y up, origin on the floor."""
    import trimesh

    model = robot_spec().compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    scene = trimesh.Scene()
    for geom in np.flatnonzero(model.geom_group == VISUAL).tolist():
        mesh = geom_mesh(model, geom)
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = data.geom_xmat[geom].reshape(3, 3), data.geom_xpos[geom]
        material = int(model.geom_matid[geom])
        roughness = 1.0 - 0.7 * float(model.mat_shininess[material])
        mesh.visual = _visual(f"robot_{material}", model.mat_rgba[material].tolist(), roughness)
        scene.add_geometry(mesh, node_name=f"robot_{geom}", geom_name=f"robot_{geom}", transform=UP @ pose)
    return bytes(scene.export(file_type="glb", include_normals=True))  # type: ignore[no-untyped-call]


def shape_glb(mesh: SceneMesh) -> bytes:
    """Return the faces of a shape in its own frame, as glTF has them: y up, origin on the floor."""
    import trimesh

    scene = trimesh.Scene()
    for index in np.unique(mesh.material).tolist():
        name = MATERIAL_NAMES[index]
        corners, faces = np.unique(mesh.faces[mesh.material == index], return_inverse=True)
        part = trimesh.Trimesh(mesh.vertices[corners], faces.reshape(-1, 3), process=False)
        rgba = MATERIALS[name].rgba
        part.visual = _visual(f"shape_{name}", rgba, 0.7, alphaMode="OPAQUE" if rgba[3] >= 1.0 else "BLEND")
        scene.add_geometry(part, node_name=name, geom_name=name, transform=UP)
    return bytes(scene.export(file_type="glb", include_normals=True))  # type: ignore[no-untyped-call]


def _visual(name: str, rgba: Any, roughness: float, **more: Any) -> Any:
    """Return the look of a mesh of one color, sRGB."""
    import trimesh

    red, green, blue, alpha = rgba
    color = [to_linear(red), to_linear(green), to_linear(blue), alpha]
    material = trimesh.visual.material.PBRMaterial(  # type: ignore[no-untyped-call]
        name=name, baseColorFactor=color, metallicFactor=0.0, roughnessFactor=roughness, **more
    )
    return trimesh.visual.TextureVisuals(material=material)  # type: ignore[no-untyped-call]
