"""The robot as binary glTF."""

from __future__ import annotations

from functools import lru_cache

import mujoco
import numpy as np

from labgym.assets.meshes.colors import to_linear
from labgym.envs.robot import robot_spec
from labgym.envs.robot_mesh import VISUAL, geom_mesh


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
        mesh = geom_mesh(model, geom)
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
