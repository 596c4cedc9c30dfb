"""Compiled scenes on disk: an MJCF folder that stands on its own, and a binary glTF."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import mujoco
import numpy as np
import trimesh

from labgym.assets.shapes import MATERIALS
from labgym.documents import write_bytes
from labgym.layouts import Layout, Placement
from labgym.scenes.building import Array, Faces, room_patches
from labgym.scenes.folders import whole_folder
from labgym.scenes.mesh import MATERIAL_NAMES, asset_mesh, floor_mesh
from labgym.scenes.mjcf import to_mjcf

SCENE_FILE = "scene.xml"
MESH_FOLDER = "meshes"


def write_mjcf(layout: Layout, folder: str | Path) -> Path:
    """Write a layout as `folder/scene.xml` with its meshes in `folder/meshes`, and return the file's path.

    The folder can be moved anywhere and loads in MuJoCo 3.3 and later, without plugins. It is written beside its
    place and moved there when complete; a scene that was there before is replaced.

    Raises:
        LabgymError: the folder exists and holds something else than a scene.
    """
    folder = Path(folder)
    with whole_folder(folder, (SCENE_FILE, MESH_FOLDER), "compiled scene") as fresh:
        spec = to_mjcf(layout)
        meshes = _move_meshes_to_files(spec)
        spec.compile()
        (fresh / MESH_FOLDER).mkdir()
        for name, content in meshes.items():
            (fresh / MESH_FOLDER / name).write_bytes(content)
        (fresh / SCENE_FILE).write_text(_portable(spec.to_xml()), encoding="utf-8")
    return folder / SCENE_FILE


def write_glb(layout: Layout, path: str | Path) -> Path:
    """Write a layout as binary glTF, one node a placement, for viewers and modelling programs; return the path."""
    scene = trimesh.Scene()
    # glTF has y up and z towards the viewer.
    up = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, -1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
    surroundings = [("floor", "floor_vinyl", *floor_mesh(layout.room))]
    surroundings += [(patch.name, patch.material, patch.vertices, patch.faces) for patch in room_patches(layout.room)]
    for name, material, vertices, faces in surroundings:
        scene.add_geometry(_painted(vertices, faces, material), node_name=name, geom_name=name, transform=up)
    for placement in layout.placements:
        local = asset_mesh(layout.asset(placement.id))
        pose = up @ _pose(placement)
        for index in np.unique(local.material):
            material, faces = MATERIAL_NAMES[index], local.faces[local.material == index]
            name = f"{placement.asset}/{material}"
            if name in scene.geometry:
                scene.graph.update(frame_to=f"{placement.id}/{material}", matrix=pose, geometry=name)  # type: ignore[no-untyped-call]
            else:
                mesh = _painted(local.vertices, faces, material)
                scene.add_geometry(mesh, node_name=f"{placement.id}/{material}", geom_name=name, transform=pose)
    content: bytes = scene.export(file_type="glb")  # type: ignore[no-untyped-call]
    return write_bytes(path, content)


def _pose(placement: Placement) -> Array:
    """Return a placement's pose as a matrix, shape (4, 4)."""
    cosine, sine = math.cos(placement.yaw), math.sin(placement.yaw)
    x, y, z = placement.position
    return np.array([[cosine, -sine, 0.0, x], [sine, cosine, 0.0, y], [0.0, 0.0, 1.0, z], [0.0, 0.0, 0.0, 1.0]])


def _painted(vertices: Array, faces: Faces, material: str) -> trimesh.Trimesh:
    look = MATERIALS[material]
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    mesh.remove_unreferenced_vertices()
    mesh.visual = trimesh.visual.TextureVisuals(  # type: ignore[no-untyped-call]
        material=trimesh.visual.material.PBRMaterial(  # type: ignore[no-untyped-call]
            name=material,
            baseColorFactor=[round(255 * channel) for channel in look.rgba],
            metallicFactor=0.9 if look.reflectance > 0.1 else 0.0,
            roughnessFactor=1.0 - 0.9 * look.shininess,
            emissiveFactor=[look.emission * channel for channel in look.rgba[:3]],
            alphaMode="BLEND" if look.rgba[3] < 1.0 else "OPAQUE",
        )
    )
    return mesh


def _move_meshes_to_files(spec: mujoco.MjSpec) -> dict[str, bytes]:
    """Turn the in-memory meshes of a specification into OBJ files; return their contents by name."""
    files: dict[str, bytes] = {}
    for mesh in spec.meshes:
        vertices = np.array(mesh.uservert).reshape(-1, 3)
        faces = np.array(mesh.userface, dtype=np.int64).reshape(-1, 3) + 1
        lines = [f"v {x:.7g} {y:.7g} {z:.7g}" for x, y, z in vertices]
        lines += [f"f {a} {b} {c}" for a, b, c in faces]
        mesh.file = f"{mesh.name.replace('/', '_')}.obj"
        mesh.uservert, mesh.userface = [], []
        files[mesh.file] = ("\n".join(lines) + "\n").encode()
    spec.meshdir, spec.assets = MESH_FOLDER, files
    return files


def _portable(text: str) -> str:
    """Return MuJoCo's XML with attributes that MuJoCo 3.3 knows, and rounding noise set to zero."""
    root = ElementTree.fromstring(text)
    for element in root.iter():
        for key, value in list(element.attrib.items()):
            if key == "colorspace":
                del element.attrib[key]
            elif element.tag == "light" and key == "type":
                del element.attrib[key]
                element.set("directional", "true" if value == "directional" else "false")
            elif "e-" in value:
                element.set(key, " ".join(_quiet(token) for token in value.split()))
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode") + "\n"


def _quiet(token: str) -> str:
    try:
        return "0" if abs(float(token)) < 1e-9 else token
    except ValueError:
        return token
