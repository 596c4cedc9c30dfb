"""An imported mesh as GLB for viewers, in the file's own colors."""

from __future__ import annotations

import numpy as np
import trimesh

from labgym.assets.forge.looks import look
from labgym.assets.meshes import PhysicalMesh
from labgym.assets.meshes.colors import to_linear
from labgym.assets.shapes import MATERIALS

_Y_UP = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, -1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]])


def glb(mesh: PhysicalMesh) -> bytes:
    """Return a mesh as binary glTF; its front, +y of the asset's frame, looks along -z of glTF."""
    scene = trimesh.Scene()
    for k, part in enumerate(mesh.parts):
        red, green, blue, opacity = part.color or MATERIALS[look(part)].rgba
        body = trimesh.Trimesh(part.vertices, part.faces, process=False)
        body.visual = trimesh.visual.TextureVisuals(  # type: ignore[no-untyped-call]
            material=trimesh.visual.material.PBRMaterial(  # type: ignore[no-untyped-call]
                name=part.material or look(part),
                baseColorFactor=[round(255 * to_linear(channel)) for channel in (red, green, blue)]
                + [round(255 * opacity)],
                metallicFactor=0.0,
                roughnessFactor=0.6,
                alphaMode="BLEND" if opacity < 1.0 else "OPAQUE",
            )
        )
        scene.add_geometry(body, node_name=f"part_{k}", geom_name=f"part_{k}", transform=_Y_UP)
    content: bytes = scene.export(file_type="glb")  # type: ignore[no-untyped-call]
    return content
