"""A rigid shape as binary glTF."""

from __future__ import annotations

import numpy as np

from labgym.assets.meshes.colors import to_linear
from labgym.assets.shapes import MATERIALS
from labgym.scenes.mesh import MATERIAL_NAMES, SceneMesh


def shape_glb(mesh: SceneMesh) -> bytes:
    """Return the faces of a shape in its own frame, as glTF has them: y up, origin on the floor."""
    import trimesh

    up = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, -1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
    scene = trimesh.Scene()
    for index in np.unique(mesh.material).tolist():
        name = MATERIAL_NAMES[index]
        corners, faces = np.unique(mesh.faces[mesh.material == index], return_inverse=True)
        part = trimesh.Trimesh(mesh.vertices[corners], faces.reshape(-1, 3), process=False)
        red, green, blue, alpha = MATERIALS[name].rgba
        part.visual = trimesh.visual.TextureVisuals(  # type: ignore[no-untyped-call]
            material=trimesh.visual.material.PBRMaterial(  # type: ignore[no-untyped-call]
                name=f"shape_{name}",
                baseColorFactor=[to_linear(red), to_linear(green), to_linear(blue), alpha],
                metallicFactor=0.0,
                roughnessFactor=0.7,
                alphaMode="OPAQUE" if alpha >= 1.0 else "BLEND",
            )
        )
        scene.add_geometry(part, node_name=name, geom_name=name, transform=up)
    return bytes(scene.export(file_type="glb", include_normals=True))  # type: ignore[no-untyped-call]
