"""A layout as an OpenUSD stage that stands on its own: the room, and a reference to an asset file each placement."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from labgym.assets.usd import NAMESPACE, asset_text, write_collider, write_look, write_mesh
from labgym.geometry import OrientedBox
from labgym.layouts import Layout, Room
from labgym.layouts.model import WALL
from labgym.scenes.building import room_patches, room_solids
from labgym.scenes.folders import whole_folder
from labgym.scenes.mesh import floor_mesh

STAGE_FILE = "scene.usda"
ASSET_FOLDER = "assets"
ROOT = "/Laboratory"
FLOOR_THICKNESS = 0.1
"""Depth of the floor's collider below z = 0, metres."""
GRAVITY = 9.81


def write_usd(layout: Layout, folder: str | Path) -> Path:
    """Write a layout as `folder/scene.usda` with its assets in `folder/assets`, and return the stage's path.

    The stage has metres and z up. `Laboratory/Room` holds floor and walls, seen and solid; `Laboratory/Placements`
    one prim a placement, which references its asset; what hangs on a wall is kinematic. The folder can be moved
    anywhere. It is written beside its place and moved there when complete; a stage that was there is replaced.

    Raises:
        LabgymError: the folder exists and holds something else than a stage.
        MissingDependencyError: usd-core is not installed.
    """
    folder = Path(folder)
    assets = {placement.asset: layout.asset(placement.id) for placement in layout.placements}
    with whole_folder(folder, (STAGE_FILE, ASSET_FOLDER), "USD stage of labgym") as fresh:
        (fresh / ASSET_FOLDER).mkdir()
        for name, asset in assets.items():
            (fresh / _asset_file(name)).write_text(asset_text(asset), encoding="utf-8")
        _write_stage(layout, fresh / STAGE_FILE)
    return folder / STAGE_FILE


def _write_stage(layout: Layout, path: Path) -> None:
    from pxr import Gf, Usd, UsdGeom, UsdLux, UsdPhysics

    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    UsdPhysics.SetStageKilogramsPerUnit(stage, 1.0)
    root = UsdGeom.Xform.Define(stage, ROOT).GetPrim()
    stage.SetDefaultPrim(root)
    Usd.ModelAPI(root).SetKind("assembly")
    _note(root, "layout", layout.id)
    _note(root, "layoutHash", layout.hash)
    if layout.protocol_id:
        _note(root, "protocol", layout.protocol_id)
    physics = UsdPhysics.Scene.Define(stage, f"{ROOT}/Physics")
    physics.CreateGravityDirectionAttr(Gf.Vec3f(0.0, 0.0, -1.0))
    physics.CreateGravityMagnitudeAttr(GRAVITY)
    UsdLux.DomeLight.Define(stage, f"{ROOT}/Light").CreateIntensityAttr(1.0)
    _write_room(stage, layout.room)
    _write_placements(stage, layout)
    stage.GetRootLayer().Save()


def _write_room(stage: Any, room: Room) -> None:
    from pxr import Usd, UsdGeom, UsdShade

    path = f"{ROOT}/Room"
    Usd.ModelAPI(UsdGeom.Xform.Define(stage, path).GetPrim()).SetKind("component")
    surfaces = [("floor", "floor_vinyl", *floor_mesh(room))]
    surfaces += [(patch.name, patch.material, patch.vertices, patch.faces) for patch in room_patches(room)]
    UsdGeom.Scope.Define(stage, f"{path}/Looks")
    names = sorted({material for _, material, _, _ in surfaces})
    looks = {name: write_look(stage, f"{path}/Looks/{name}", name) for name in names}
    UsdGeom.Scope.Define(stage, f"{path}/Geometry")
    for name, (_, material, vertices, faces) in zip(_identifiers([s[0] for s in surfaces]), surfaces, strict=True):
        mesh = write_mesh(stage, f"{path}/Geometry/{name}", vertices, faces)
        UsdShade.MaterialBindingAPI.Apply(mesh).Bind(looks[material])
    UsdGeom.Scope.Define(stage, f"{path}/Colliders").CreatePurposeAttr(UsdGeom.Tokens.guide)
    for wall, box in room_solids(room).items():
        write_collider(stage, f"{path}/Colliders/{wall}", box)
    write_collider(stage, f"{path}/Colliders/floor", _floor_box(room))


def _floor_box(room: Room) -> OrientedBox:
    width, depth = room.width + 2.0 * room.wall_thickness, room.depth + 2.0 * room.wall_thickness
    return OrientedBox(room.width / 2.0, room.depth / 2.0, width, depth, 0.0, -FLOOR_THICKNESS, 0.0)


def _write_placements(stage: Any, layout: Layout) -> None:
    from pxr import Gf, Usd, UsdGeom, UsdPhysics

    path = f"{ROOT}/Placements"
    Usd.ModelAPI(UsdGeom.Xform.Define(stage, path).GetPrim()).SetKind("group")
    names = _identifiers([placement.id for placement in layout.placements])
    for name, placement in zip(names, layout.placements, strict=True):
        pose = UsdGeom.Xform.Define(stage, f"{path}/{name}")
        prim = pose.GetPrim()
        prim.GetReferences().AddReference(f"./{_asset_file(placement.asset)}")
        prim.SetInstanceable(True)
        pose.AddTranslateOp().Set(Gf.Vec3d(*placement.position))
        pose.AddRotateZOp(UsdGeom.XformOp.PrecisionDouble).Set(math.degrees(placement.yaw))
        _note(prim, "id", placement.id)
        _note(prim, "support", placement.support)
        if placement.support == WALL:
            UsdPhysics.RigidBodyAPI(prim).CreateKinematicEnabledAttr(True)


def _asset_file(name: str) -> str:
    return f"{ASSET_FOLDER}/{name}.usda"


def _note(prim: Any, name: str, text: str) -> None:
    from pxr import Sdf

    prim.CreateAttribute(f"{NAMESPACE}:{name}", Sdf.ValueTypeNames.String, True, Sdf.VariabilityUniform).Set(text)


def _identifiers(names: Sequence[str]) -> list[str]:
    """Return names as USD identifiers, each of its own."""
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
