"""A layout as one triangle mesh: faces with their materials and owners."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from labgym.assets import Asset
from labgym.assets.archive import convex_bodies
from labgym.assets.articulation import State, posed_parts
from labgym.assets.meshes.normals import corner_normals
from labgym.assets.shapes import MATERIALS, Part, build, tessellate
from labgym.geometry import OrientedBox
from labgym.layouts import Layout, Placement
from labgym.layouts.floor import Finishes, Floor
from labgym.scenes.building import building_patches, building_solids, floor_patches
from labgym.scenes.cutaway import hanging_on
from labgym.scenes.finishes import finishes_at, palette
from labgym.scenes.fittings import drawn_asset, installations
from labgym.scenes.patches import Patch, join, visible

if TYPE_CHECKING:
    import trimesh

MATERIAL_NAMES = tuple(MATERIALS)
"""Material of each material index."""
ROOM = -1
"""Owner index of the faces of floor and walls."""
_MATERIAL_INDEX = {name: index for index, name in enumerate(MATERIAL_NAMES)}
_BOX_FACES = np.array(
    [
        [0, 2, 1],
        [0, 3, 2],
        [4, 5, 6],
        [4, 6, 7],
        [0, 1, 5],
        [0, 5, 4],
        [1, 2, 6],
        [1, 6, 5],
        [2, 3, 7],
        [2, 7, 6],
        [3, 0, 4],
        [3, 4, 7],
    ]
)


@dataclass(frozen=True)
class SceneMesh:
    """Triangles in the room frame.

    Attributes:
        vertices: (n, 3) float64, meters. faces: (m, 3) int64, wound outwards.
        material: (m,) index into `MATERIAL_NAMES`.
        owner: (m,) index into the layout's placements, `ROOM` for floor and walls.
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    material: NDArray[np.int64]
    owner: NDArray[np.int64]

    @property
    def rgba(self) -> NDArray[np.float64]:
        """Color of each face, shape (m, 4), in [0, 1]."""
        return np.array([MATERIALS[name].rgba for name in MATERIAL_NAMES])[self.material]

    def trimesh(self) -> trimesh.Trimesh:
        """Return the mesh as trimesh's, with face colors and the face attribute `owner`."""
        import trimesh

        colors = np.rint(self.rgba * 255.0).astype(np.uint8)
        owner: dict[str, Any] = {"owner": self.owner}
        return trimesh.Trimesh(self.vertices, self.faces, face_colors=colors, process=False, face_attributes=owner)


@dataclass(frozen=True)
class AssetMesh:
    """An asset's parts and their triangles in the asset's frame, materials by face."""

    asset: Asset
    parts: tuple[Part, ...]
    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    material: NDArray[np.int64]


@lru_cache(maxsize=2048)
def asset_mesh(asset: Asset, finishes: Finishes = Finishes(), state: State = ()) -> AssetMesh:  # noqa: B008 (a frozen record)
    """Return an asset's mesh in the finishes of a space, computed once for each catalog entry, size and state."""
    painted = palette(finishes)
    if painted:
        plain = asset_mesh(asset, state=state)
        if painted.keys().isdisjoint(part.material for part in plain.parts):
            return plain
        parts = tuple(replace(part, material=painted.get(part.material, part.material)) for part in plain.parts)
        index = np.arange(len(MATERIAL_NAMES))
        index[[_MATERIAL_INDEX[name] for name in painted]] = [_MATERIAL_INDEX[name] for name in painted.values()]
        return replace(plain, parts=parts, material=index[plain.material])
    parts = posed_parts(asset, state) if state else build(asset)
    meshes = [tessellate(part) for part in parts]
    material = np.concatenate(
        [np.full(len(faces), _MATERIAL_INDEX[part.material]) for part, (_, faces) in zip(parts, meshes, strict=True)]
    )
    vertices, faces = join(meshes)
    return AssetMesh(asset, parts, vertices, faces, material)


def scene_mesh(layout: Layout, hidden: Collection[str] = ()) -> SceneMesh:
    """Return the visible faces of a layout: floor, walls as seen from inside, placements and their installations.

    Args:
        hidden: walls, or upper parts of walls, to leave out, together with the placements mounted on them.
    """
    patches = [*floor_patches(layout.floor), *visible(building_patches(layout.floor), hidden)]
    meshes = [(patch.vertices, patch.faces) for patch in patches]
    materials = [np.full(len(patch.faces), _MATERIAL_INDEX[patch.material]) for patch in patches]
    owners = [np.full(len(faces), ROOM) for _, faces in meshes]
    for index, placement in enumerate(layout.placements):
        if hidden and hanging_on(layout, placement) in hidden:
            continue
        finishes = finishes_at(layout.floor, *placement.position[:2])
        local = asset_mesh(drawn_asset(layout, placement.id), finishes, placement.state)
        meshes.append((_placed(local.vertices, placement), local.faces))
        materials.append(local.material)
        owners.append(np.full(len(local.faces), index))
    index_of = {placement.id: index for index, placement in enumerate(layout.placements)}
    for installation in installations(layout):
        for patch in visible(installation.patches, hidden):
            meshes.append((patch.vertices, patch.faces))
            materials.append(np.full(len(patch.faces), _MATERIAL_INDEX[patch.material]))
            owners.append(np.full(len(patch.faces), index_of[installation.owner]))
    vertices, faces = join(meshes)
    return SceneMesh(vertices, faces, np.concatenate(materials), np.concatenate(owners))


def smooth_normals(mesh: SceneMesh, layout: Layout) -> NDArray[np.float32]:
    """Return the normals of the face corners of a layout's mesh, shape (m, 3, 3); those of assets are computed once."""
    normals = np.empty((len(mesh.faces), 3, 3), dtype=np.float32)
    # Faces of the building come first, then those of placements in their order, then those of installations.
    end = int(np.argmax(mesh.owner != ROOM)) if layout.placements else len(mesh.faces)
    normals[:end] = corner_normals(mesh.vertices, mesh.faces[:end])
    for index, placement in enumerate(layout.placements):
        if end < len(mesh.owner) and mesh.owner[end] == index:
            local = _asset_normals(drawn_asset(layout, placement.id), placement.state)
            cosine, sine = math.cos(placement.yaw), math.sin(placement.yaw)
            turn = np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]], dtype=np.float32)
            normals[end : end + len(local)] = local @ turn
            end += len(local)
    normals[end:] = corner_normals(mesh.vertices, mesh.faces[end:])
    return normals


@lru_cache(maxsize=2048)
def _asset_normals(asset: Asset, state: State) -> NDArray[np.float32]:
    mesh = asset_mesh(asset, state=state)
    return corner_normals(mesh.vertices, mesh.faces).astype(np.float32)


def with_patches(mesh: SceneMesh, patches: Iterable[Patch]) -> SceneMesh:
    """Return a mesh with further faces of the building, which come first."""
    added = list(patches)
    vertices, faces = join([*((patch.vertices, patch.faces) for patch in added), (mesh.vertices, mesh.faces)])
    materials = [np.full(len(patch.faces), _MATERIAL_INDEX[patch.material]) for patch in added]
    owner = np.full(len(faces) - len(mesh.faces), ROOM)
    return SceneMesh(vertices, faces, np.concatenate([*materials, mesh.material]), np.concatenate([owner, mesh.owner]))


def joined(first: SceneMesh, *others: SceneMesh) -> SceneMesh:
    """Return meshes as one, in their order."""
    meshes = (first, *others)
    vertices, faces = join([(each.vertices, each.faces) for each in meshes])
    material, owner = (np.concatenate([getattr(each, name) for each in meshes]) for name in ("material", "owner"))
    return SceneMesh(vertices, faces, material, owner)


def solid_mesh(layout: Layout) -> SceneMesh:
    """Return the solid faces of a layout: floor, walls, and the solids of all placements."""
    meshes = [_ground(layout.floor)]
    owners = [np.full(2, ROOM)]
    boxes = [(ROOM, box) for box in building_solids(layout.floor).values()]
    for k, placement in enumerate(layout.placements):
        bodies = convex_bodies(layout.asset(placement.id))
        boxes += [(k, box) for box in (() if bodies else layout.solids(placement.id))]
        meshes += [(_placed(vertices, placement), faces) for vertices, faces in bodies]
        owners += [np.full(len(faces), k) for _, faces in bodies]
    for owner, box in boxes:
        meshes.append(box_faces(box))
        owners.append(np.full(len(_BOX_FACES), owner))
    vertices, faces = join(meshes)
    return SceneMesh(vertices, faces, np.full(len(faces), _MATERIAL_INDEX["powder_grey"]), np.concatenate(owners))


def own_mesh(asset: Asset, finishes: Finishes, geometry: Literal["solid", "visual"]) -> SceneMesh:
    """Return the visible or the solid faces of an asset in its own frame; all are of one owner."""
    if geometry == "visual":
        local = asset_mesh(asset, finishes)
        return SceneMesh(local.vertices, local.faces, local.material, np.full(len(local.faces), ROOM))
    vertices, faces = join(list(convex_bodies(asset)) or [box_faces(box) for box in asset.solids()])
    return SceneMesh(vertices, faces, np.full(len(faces), _MATERIAL_INDEX["powder_grey"]), np.full(len(faces), ROOM))


def box_faces(box: OrientedBox) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return vertices and faces of a box."""
    ring = box.corners()
    return np.concatenate([np.column_stack([ring, np.full(4, z)]) for z in (box.z0, box.z1)]), _BOX_FACES


def _placed(vertices: NDArray[np.float64], placement: Placement) -> NDArray[np.float64]:
    """Return vertices of an asset's frame in the room frame, shape (n, 3)."""
    cosine, sine = math.cos(placement.yaw), math.sin(placement.yaw)
    turn = np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    return np.asarray(vertices @ turn + np.array(placement.position))


def _ground(floor: Floor) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return vertices and faces of the solid floor: a rectangle under everything."""
    x0, y0, x1, y1 = floor.bounds
    corners = np.array([[x0, y0, 0.0], [x1, y0, 0.0], [x1, y1, 0.0], [x0, y1, 0.0]])
    return corners, np.array([[0, 1, 2], [0, 2, 3]])
