"""Bodies of conditions in scenes that MuJoCo draws."""

from __future__ import annotations

import math
from collections.abc import Sequence

import mujoco
import numpy as np

from labgym.assets.shapes import MATERIALS
from labgym.envs.conditions.bodies import Body, Shape
from labgym.scenes.mesh import MATERIAL_NAMES
from labgym.scenes.mjcf import VISUAL_GROUP

NAME = "/condition"
"""Beginning of the names of bodies and meshes; no placement has such an id."""


def add_shapes(spec: mujoco.MjSpec, shapes: Sequence[Shape]) -> None:
    """Add a body without contacts for each shape, to be placed with `place_bodies`."""
    meshes: dict[tuple[int, int], str] = {}
    for number, shape in enumerate(shapes):
        body = spec.worldbody.add_body(name=f"{NAME}/{number}", mocap=True)
        for material in np.unique(shape.mesh.material).tolist():
            name = meshes.setdefault((id(shape), material), f"{NAME}/{len(meshes)}")
            if spec.mesh(name) is None:
                corners, faces = np.unique(shape.mesh.faces[shape.mesh.material == material], return_inverse=True)
                mesh = spec.add_mesh(name=name)
                mesh.uservert = shape.mesh.vertices[corners].astype(np.float32).ravel()
                mesh.userface = faces.astype(np.int32).ravel()
                mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
            body.add_geom(
                type=mujoco.mjtGeom.mjGEOM_MESH,
                meshname=name,
                rgba=MATERIALS[MATERIAL_NAMES[material]].rgba,
                group=VISUAL_GROUP,
                contype=0,
                conaffinity=0,
            )


def place_bodies(data: mujoco.MjData, bodies: Sequence[Body]) -> None:
    """Put bodies at their poses, in a scene with their shapes in this order; `mj_forward` takes effect."""
    for number, body in enumerate(bodies):
        mocap = data.model.body(f"{NAME}/{number}").mocapid[0]
        x, y, yaw = body.pose
        data.mocap_pos[mocap] = x, y, 0.0
        data.mocap_quat[mocap] = math.cos(yaw / 2.0), 0.0, 0.0, math.sin(yaw / 2.0)
