"""The room of a layout as a USD layer: visible walls and floor, their materials and colliders."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from labgym.assets.usd import write_collider, write_labels, write_look, write_mesh
from labgym.geometry import OrientedBox
from labgym.layouts import Room
from labgym.scenes.building import Array, Faces, room_patches, room_solids
from labgym.scenes.mesh import floor_mesh
from labgym.scenes.usd.names import identifiers

FLOOR_THICKNESS = 0.1
"""Depth of the floor's collider below z = 0, meters."""
LABELS = {
    "floor_vinyl": "floor",
    "door_frame": "door",
    "door_leaf": "door",
    "stainless": "door",
    "plastic_white": "window",
    "daylight": "window",
}
"""Semantic class of the room's surfaces by material; all others are walls."""


def room_layer(room: Room) -> Any:
    """Return a room as an anonymous `pxr.Sdf.Layer` whose default prim has Geometry, Looks and Colliders."""
    from pxr import Sdf, Usd, UsdGeom, UsdPhysics, UsdShade

    layer = Sdf.Layer.CreateAnonymous("room")
    stage = Usd.Stage.Open(layer)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    UsdPhysics.SetStageKilogramsPerUnit(stage, 1.0)
    root = UsdGeom.Xform.Define(stage, "/Room").GetPrim()
    stage.SetDefaultPrim(root)
    Usd.ModelAPI(root).SetKind("component")
    surfaces = _surfaces(room)
    UsdGeom.Scope.Define(stage, "/Room/Looks")
    materials = sorted({material for _, material, _, _ in surfaces})
    looks = {material: write_look(stage, f"/Room/Looks/{material}", material) for material in materials}
    UsdGeom.Scope.Define(stage, "/Room/Geometry")
    for name, (_, material, vertices, faces) in zip(identifiers([s[0] for s in surfaces]), surfaces, strict=True):
        mesh = write_mesh(stage, f"/Room/Geometry/{name}", vertices, faces)
        UsdShade.MaterialBindingAPI.Apply(mesh).Bind(looks[material])
        write_labels(mesh, {"class": LABELS.get(material, "wall")})
    UsdGeom.Scope.Define(stage, "/Room/Colliders").CreatePurposeAttr(UsdGeom.Tokens.guide)
    for wall, box in room_solids(room).items():
        write_collider(stage, f"/Room/Colliders/{wall}", box)
    write_collider(stage, "/Room/Colliders/floor", _floor_box(room))
    return layer


def _surfaces(room: Room) -> list[tuple[str, str, Array, Faces]]:
    """Return name, material, vertices and faces of the floor and of each block of the walls."""
    surfaces = [("floor", "floor_vinyl", *floor_mesh(room))]
    for patch in room_patches(room):
        # Blocks that abut would be a mesh with points in the same place.
        surfaces += [(patch.name, patch.material, patch.vertices, faces) for faces in _connected(patch.faces)]
    return surfaces


def _connected(faces: Faces) -> list[Faces]:
    """Return the groups of faces that are connected by shared vertices, in the order of their first faces."""
    edges = faces[:, [0, 1, 1, 2]].reshape(-1, 2)
    count = int(faces.max()) + 1
    graph = coo_matrix((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), shape=(count, count))
    group = connected_components(graph, directed=False)[1][faces[:, 0]]
    return [faces[group == number] for number in dict.fromkeys(group.tolist())]


def _floor_box(room: Room) -> OrientedBox:
    width, depth = room.width + 2.0 * room.wall_thickness, room.depth + 2.0 * room.wall_thickness
    return OrientedBox(room.width / 2.0, room.depth / 2.0, width, depth, 0.0, -FLOOR_THICKNESS, 0.0)
