"""Compiled scenes on disk: a self-contained MJCF folder, and binary glTF."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import TYPE_CHECKING, Any

import mujoco
import numpy as np
from PIL import Image

from labgym.assets import Asset
from labgym.assets.articulation import State
from labgym.assets.meshes.colors import to_linear
from labgym.assets.meshes.normals import corner_normals
from labgym.assets.shapes import MATERIALS
from labgym.assets.textures import Texture, corner_coordinates, texture
from labgym.documents import write_bytes
from labgym.errors import OptionError
from labgym.layouts import Layout, Placement
from labgym.layouts.floor import Finishes
from labgym.scenes.building import building_patches, floor_patches
from labgym.scenes.finishes import finishes_at
from labgym.scenes.fittings import drawn_asset, installations
from labgym.scenes.folders import whole_folder
from labgym.scenes.mesh import MATERIAL_NAMES, asset_mesh
from labgym.scenes.mjcf import to_mjcf
from labgym.scenes.patches import Array, Faces

if TYPE_CHECKING:
    import trimesh

SCENE_FILE = "scene.xml"
MESH_FOLDER = "meshes"
TEXTURE_FOLDER = "textures"


def write_mjcf(layout: Layout, folder: str | Path, interactive: bool = False, loose: bool = False) -> Path:
    """Write a layout as `folder/scene.xml` with `folder/meshes` and `folder/textures`, and return the file's path.

    The folder can be moved and loads in MuJoCo 3.3 and later without plugins. The files are written to a temporary
    folder, which then replaces an earlier scene.

    Args:
        interactive, loose: what moves, see `to_mjcf`; by default nothing.

    Raises:
        LabgymError: the folder exists and is not a compiled scene.
    """
    folder = Path(folder)
    with whole_folder(folder, (SCENE_FILE, MESH_FOLDER, TEXTURE_FOLDER), "compiled scene") as fresh:
        (fresh / MESH_FOLDER).mkdir()
        for name, content in mjcf_files(layout, interactive, loose).items():
            (fresh / name).parent.mkdir(exist_ok=True)
            (fresh / name).write_bytes(content)
    return folder / SCENE_FILE


def mjcf_files(layout: Layout, interactive: bool = False, loose: bool = False) -> dict[str, bytes]:
    """Return the files of a scene that `write_mjcf` writes: content by path relative to the scene's folder."""
    spec = to_mjcf(layout, interactive=interactive, loose=loose)
    textures = {f"{TEXTURE_FOLDER}/{name}": content for name, content in spec.assets.items()}
    meshes = _move_meshes_to_files(spec)
    files = {f"{MESH_FOLDER}/{name}": content for name, content in meshes.items()} | textures
    if textures:
        spec.texturedir = TEXTURE_FOLDER
    spec.assets = meshes | textures
    spec.compile()
    return {**files, SCENE_FILE: _portable(spec.to_xml()).encode("utf-8")}


def write_glb(layout: Layout, path: str | Path) -> Path:
    """Write a layout as binary glTF (`glb_bytes`), for viewers and modeling programs, and return the path.

    Raises:
        OptionError: the path does not end in .glb.
    """
    path = Path(path)
    if path.suffix.lower() != ".glb":
        raise OptionError(f"GLB file {path.name!r} must end in .glb, for example {path.name}.glb")
    return write_bytes(path, glb_bytes(layout))


def glb_bytes(layout: Layout) -> bytes:
    """Return a layout as binary glTF.

    Each material of a placement is a node `<id>/<material>`. Colors are linear, as glTF defines them. Normals are
    smooth over round surfaces; a vertex is repeated for each of its normals, so merge vertices by position to get
    watertight meshes. Materials have textures, whose means are the colors.
    """
    import trimesh

    scene = trimesh.Scene()
    # In glTF y points up and z towards the viewer.
    up = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, -1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
    added = (patch for installation in installations(layout) for patch in installation.patches)
    for patch in (*floor_patches(layout.floor), *building_patches(layout.floor), *added):
        mesh = _painted(patch.vertices, patch.faces, patch.material, texture(patch.material))
        scene.add_geometry(mesh, node_name=patch.name, geom_name=patch.name, transform=up)
    names: dict[tuple[Asset, Finishes, State], str] = {}
    for placement in layout.placements:
        asset, state = drawn_asset(layout, placement.id), placement.state
        finishes = finishes_at(layout.floor, *placement.position[:2])
        local, pose = asset_mesh(asset, finishes, state), up @ _pose(placement)
        asset_name = asset.name if asset.name not in names.values() else placement.id
        asset_name = names.setdefault((asset, finishes, state), asset_name)
        for index in np.unique(local.material):
            material, faces = MATERIAL_NAMES[index], local.faces[local.material == index]
            name = f"{asset_name}/{material}"
            if name in scene.geometry:
                scene.graph.update(frame_to=f"{placement.id}/{material}", matrix=pose, geometry=name)  # type: ignore[no-untyped-call]
            else:
                mesh = _painted(local.vertices, faces, material, texture(material))
                scene.add_geometry(mesh, node_name=f"{placement.id}/{material}", geom_name=name, transform=pose)
    content: bytes = scene.export(file_type="glb", include_normals=True, tree_postprocessor=_set_colors)  # type: ignore[no-untyped-call]
    return content


def _pose(placement: Placement) -> Array:
    """Return a placement's pose as a matrix, shape (4, 4)."""
    cosine, sine = math.cos(placement.yaw), math.sin(placement.yaw)
    x, y, z = placement.position
    return np.array([[cosine, -sine, 0.0, x], [sine, cosine, 0.0, y], [0.0, 0.0, 1.0, z], [0.0, 0.0, 0.0, 1.0]])


def _painted(vertices: Array, faces: Faces, material: str, image: Texture | None) -> trimesh.Trimesh:
    """Return a mesh with a material, normals and texture coordinates; a vertex is repeated for each that it has."""
    import trimesh

    look = MATERIALS[material]
    normals = np.round(corner_normals(vertices, faces).reshape(-1, 3), 4)
    corners = np.column_stack([faces.ravel(), normals])
    places = None if image is None else np.round(corner_coordinates(vertices, faces, image).reshape(-1, 2), 6)
    if places is not None:
        corners = np.column_stack([corners, places])
    _, first, index = np.unique(corners, axis=0, return_index=True, return_inverse=True)
    mesh = trimesh.Trimesh(
        vertices[faces.ravel()[first]], index.reshape(-1, 3), vertex_normals=normals[first], process=False
    )
    mesh.visual = trimesh.visual.TextureVisuals(  # type: ignore[no-untyped-call]
        uv=None if places is None else places[first],
        material=trimesh.visual.material.PBRMaterial(  # type: ignore[no-untyped-call]
            name=material,
            metallicFactor=0.9 if look.reflectance > 0.1 else 0.0,
            roughnessFactor=1.0 - 0.9 * look.shininess,
            alphaMode="BLEND" if look.rgba[3] < 1.0 else "OPAQUE",
            baseColorTexture=None if image is None else Image.fromarray(image.pixels),
        ),
    )
    return mesh


def _set_colors(tree: dict[str, Any]) -> None:
    """Set the linear color factors of a glTF document's materials, which trimesh would round to eight bits."""
    for material in tree["materials"]:
        look = MATERIALS[material["name"]]
        linear = [to_linear(channel) for channel in look.rgba[:3]]
        if "baseColorTexture" in material["pbrMetallicRoughness"]:
            linear = [1.0, 1.0, 1.0]
        material["pbrMetallicRoughness"]["baseColorFactor"] = [round(c, 6) for c in (*linear, look.rgba[3])]
        if look.emission:
            material["emissiveFactor"] = [round(min(1.0, look.emission * channel), 6) for channel in linear]


def _move_meshes_to_files(spec: mujoco.MjSpec) -> dict[str, bytes]:
    """Replace the in-memory meshes of a specification by OBJ files; return the files' contents by name."""
    files: dict[str, bytes] = {}
    for mesh in spec.meshes:
        vertices = np.array(mesh.uservert).reshape(-1, 3)
        faces = np.array(mesh.userface, dtype=np.int64).reshape(-1, 3) + 1
        texture = np.array(mesh.usertexcoord).reshape(-1, 2)
        lines = [f"v {x:.7g} {y:.7g} {z:.7g}" for x, y, z in vertices]
        lines += [f"vt {u:.7g} {v:.7g}" for u, v in texture]
        places = np.array(mesh.userfacetexcoord, dtype=np.int64).reshape(-1, 3) + 1
        if not len(texture):
            lines += [f"f {a} {b} {c}" for a, b, c in faces.tolist()]
        else:
            pairs = np.stack([faces, places if len(places) else faces], axis=2).tolist()
            lines += [" ".join(["f", *(f"{index}/{place}" for index, place in face)]) for face in pairs]
        mesh.file = f"{mesh.name.replace('/', '_')}.obj"
        mesh.uservert, mesh.userface, mesh.usertexcoord, mesh.userfacetexcoord = [], [], [], []
        files[mesh.file] = ("\n".join(lines) + "\n").encode()
    spec.meshdir = MESH_FOLDER
    return files


def _portable(text: str) -> str:
    """Return MuJoCo's XML with only the attributes that MuJoCo 3.3 reads, and with rounding noise set to zero."""
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
