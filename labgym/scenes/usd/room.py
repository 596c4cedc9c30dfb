"""The building and the installations of a layout as USD layers, and names of prims."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from labgym.assets.textures import texture
from labgym.assets.usd import NAMESPACE, write_collider, write_labels, write_look, write_mesh
from labgym.geometry import OrientedBox
from labgym.layouts.floor import Floor
from labgym.scenes.building import building_patches, building_solids, floor_patches
from labgym.scenes.finishes import DOORS, FLOORS
from labgym.scenes.fittings import Installation
from labgym.scenes.patches import Array, Faces

TEXTURE_FOLDER = "textures"
FLOOR_THICKNESS = 0.1
"""Depth of the floor's collider below z = 0, meters."""
LABELS = {
    **dict.fromkeys(FLOORS.values(), "floor"),
    "door_frame": "door",
    **dict.fromkeys(DOORS.values(), "door"),
    "stainless": "door",
    "plastic_white": "window",
    "daylight": "window",
    "window_glass": "window",
    "blind": "window",
}
"""Semantic class of the building's surfaces by material; all others are walls."""


def identifiers(names: Sequence[str]) -> list[str]:
    """Return names as distinct USD identifiers, in the same order."""
    from pxr import Tf

    taken: dict[str, None] = {}
    for name in names:
        plain = unique = Tf.MakeValidIdentifier(name)
        count = 1
        while unique in taken:
            count += 1
            unique = f"{plain}_{count}"
        taken[unique] = None
    return list(taken)


def write_note(prim: Any, name: str, text: str) -> None:
    """Author a custom string attribute in the namespace `labgym`."""
    from pxr import Sdf

    prim.CreateAttribute(f"{NAMESPACE}:{name}", Sdf.ValueTypeNames.String, True, Sdf.VariabilityUniform).Set(text)


def room_layer(floor: Floor, leaves: bool = True) -> Any:
    """Return walls and floor as an anonymous `pxr.Sdf.Layer` whose default prim has Geometry, Looks and Colliders.

    Args:
        leaves: whether to include the leaves of interior doors.
    """
    from pxr import Sdf, Usd, UsdGeom, UsdPhysics, UsdShade

    layer = Sdf.Layer.CreateAnonymous("room")
    stage = Usd.Stage.Open(layer)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    UsdPhysics.SetStageKilogramsPerUnit(stage, 1.0)
    root = UsdGeom.Xform.Define(stage, "/Room").GetPrim()
    stage.SetDefaultPrim(root)
    Usd.ModelAPI(root).SetKind("component")
    surfaces = _surfaces(floor, leaves)
    UsdGeom.Scope.Define(stage, "/Room/Looks")
    materials = sorted({material for _, material, _, _ in surfaces})
    textures = {material: texture(material) for material in materials}
    files = {material: f"./{TEXTURE_FOLDER}/{material}.png" for material, image in textures.items() if image}
    looks = {name: write_look(stage, f"/Room/Looks/{name}", name, files.get(name)) for name in materials}
    UsdGeom.Scope.Define(stage, "/Room/Geometry")
    for name, (_, material, vertices, faces) in zip(identifiers([s[0] for s in surfaces]), surfaces, strict=True):
        mesh = write_mesh(stage, f"/Room/Geometry/{name}", vertices, faces, textures[material])
        UsdShade.MaterialBindingAPI.Apply(mesh).Bind(looks[material])
        write_labels(mesh, {"class": LABELS.get(material, "wall")})
    UsdGeom.Scope.Define(stage, "/Room/Colliders").CreatePurposeAttr(UsdGeom.Tokens.guide)
    solids = building_solids(floor, leaves)
    for name, box in zip(identifiers(list(solids)), solids.values(), strict=True):
        write_collider(stage, f"/Room/Colliders/{name}", box)
    write_collider(stage, "/Room/Colliders/floor", _floor_box(floor))
    return layer


def _surfaces(floor: Floor, leaves: bool) -> list[tuple[str, str, Array, Faces]]:
    """Return name, material, vertices and faces of the floor and of each block of the walls."""
    surfaces: list[tuple[str, str, Array, Faces]] = []
    for patch in (*floor_patches(floor), *building_patches(floor, leaves)):
        # Blocks that abut would be a mesh with points in the same place.
        surfaces += [(patch.name, patch.material, patch.vertices, faces) for faces in connected(patch.faces)]
    return surfaces


def connected(faces: Faces) -> list[Faces]:
    """Return the groups of faces that are connected by shared vertices, in the order of their first faces."""
    edges = faces[:, [0, 1, 1, 2]].reshape(-1, 2)
    count = int(faces.max()) + 1
    graph = coo_matrix((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), shape=(count, count))
    group = connected_components(graph, directed=False)[1][faces[:, 0]]
    return [faces[group == number] for number in dict.fromkeys(group.tolist())]


def _floor_box(floor: Floor) -> OrientedBox:
    x0, y0, x1, y1 = floor.bounds
    return OrientedBox((x0 + x1) / 2.0, (y0 + y1) / 2.0, x1 - x0, y1 - y0, 0.0, -FLOOR_THICKNESS, 0.0)


def fittings_layer(installations: Sequence[Installation]) -> Any:
    """Return installations as an anonymous `pxr.Sdf.Layer`: a prim for each, without colliders.

    Their semantic class is their kind; `labgym:owner` is the id of the placement that they belong to.
    """
    from pxr import Sdf, Usd, UsdGeom, UsdShade

    layer = Sdf.Layer.CreateAnonymous("fittings")
    stage = Usd.Stage.Open(layer)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    root = UsdGeom.Xform.Define(stage, "/Fittings").GetPrim()
    stage.SetDefaultPrim(root)
    Usd.ModelAPI(root).SetKind("component")
    UsdGeom.Scope.Define(stage, "/Fittings/Looks")
    materials = sorted({patch.material for each in installations for patch in each.patches})
    looks = {material: write_look(stage, f"/Fittings/Looks/{material}", material) for material in materials}
    names = identifiers([f"{each.owner}_{each.kind}" for each in installations])
    for name, installation in zip(names, installations, strict=True):
        prim = UsdGeom.Xform.Define(stage, f"/Fittings/{name}").GetPrim()
        write_labels(prim, {"class": installation.kind})
        write_note(prim, "owner", installation.owner)
        pieces = [(patch, faces) for patch in installation.patches for faces in connected(patch.faces)]
        for label, (patch, faces) in zip(identifiers([patch.material for patch, _ in pieces]), pieces, strict=True):
            mesh = write_mesh(stage, f"/Fittings/{name}/{label}", patch.vertices, faces)
            UsdShade.MaterialBindingAPI.Apply(mesh).Bind(looks[patch.material])
    return layer
