"""A layout as a self-contained USD stage: references to the room and to the asset of each placement."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from labgym.assets import Asset
from labgym.assets.articulation import State, joints
from labgym.assets.textures import texture
from labgym.assets.usd import BODY, articulated_layer, asset_layer, write_labels, write_layer
from labgym.layouts import Layout, Placement
from labgym.layouts.floor import Finishes, Floor
from labgym.layouts.placement import WALL
from labgym.scenes.camera import WIDE, View
from labgym.scenes.ceiling import PANEL, panels
from labgym.scenes.finishes import finishes_at, palette
from labgym.scenes.fittings import drawn_asset, installations
from labgym.scenes.folders import whole_folder
from labgym.scenes.mesh import MATERIAL_NAMES, asset_mesh, scene_mesh
from labgym.scenes.usd.moving import doors_layer, pose_parts, release
from labgym.scenes.usd.room import TEXTURE_FOLDER, fittings_layer, identifiers, room_layer, write_note
from labgym.scenes.views import views

STAGE_FILE = "scene.usda"
ROOM_FILE = "room.usdc"
FITTINGS_FILE = "fittings.usdc"
DOORS_FILE = "doors.usdc"
ASSET_FOLDER = "assets"
ROOT = "/Laboratory"
FRICTIONS = f"{ROOT}/PhysicsMaterials"
GRAVITY = 9.81

Dressed = tuple[Asset, State, Finishes]
"""An asset in a state of its moving parts and in the finishes of a space."""
SENSOR = 0.036
"""Width of a camera's sensor, meters."""
NEAR, FAR = 0.05, 200.0
"""Clipping distances, meters."""
DOME = 500.0
"""Luminance of the dome, nits."""


def write_lights(stage: Any, path: str, floor: Floor) -> None:
    """Define the lights of a floor under a path. Intensities are nits, as UsdLux and path tracers take them."""
    from pxr import Gf, UsdGeom, UsdLux

    UsdGeom.Scope.Define(stage, path)
    UsdLux.DomeLight.Define(stage, f"{path}/Dome").CreateIntensityAttr(DOME)
    for k, panel in enumerate(panel for space in floor.spaces for panel in panels(space)):
        light = UsdLux.RectLight.Define(stage, f"{path}/Panel_{k}")
        light.CreateWidthAttr(PANEL[0])
        light.CreateHeightAttr(PANEL[1])
        light.CreateIntensityAttr(round(panel.luminance, 1))
        light.CreateExtentAttr(
            [Gf.Vec3f(-PANEL[0] / 2.0, -PANEL[1] / 2.0, 0.0), Gf.Vec3f(PANEL[0] / 2.0, PANEL[1] / 2.0, 0.0)]
        )
        # A rectangular light shines along its own -z, which points down.
        light.AddTranslateOp().Set(Gf.Vec3d(panel.x, panel.y, panel.z))
        if panel.yaw:
            light.AddRotateZOp(UsdGeom.XformOp.PrecisionDouble).Set(math.degrees(panel.yaw))


def write_cameras(stage: Any, path: str, views: Mapping[str, View]) -> None:
    """Define a 16:9 camera for each view under a path, with the view's vertical field of view."""
    from pxr import Gf, UsdGeom

    UsdGeom.Scope.Define(stage, path)
    height = SENSOR / WIDE
    for identifier, (name, view) in zip(identifiers(list(views)), views.items(), strict=True):
        camera = UsdGeom.Camera.Define(stage, f"{path}/{identifier}")
        # Apertures and focal lengths are in tenths of the stage's unit.
        camera.CreateHorizontalApertureAttr(10.0 * SENSOR)
        camera.CreateVerticalApertureAttr(10.0 * height)
        camera.CreateFocalLengthAttr(10.0 * height / (2.0 * math.tan(math.radians(view.fovy) / 2.0)))
        camera.CreateClippingRangeAttr(Gf.Vec2f(NEAR, FAR))
        rows = [[*map(float, axis), 0.0] for axis in view.axes()]
        camera.AddTransformOp().Set(Gf.Matrix4d(*[value for row in [*rows, [*view.position, 1.0]] for value in row]))
        write_note(camera.GetPrim(), "view", name)


def write_usd(layout: Layout, folder: str | Path, interactive: bool = False) -> Path:
    """Write a layout as `folder/scene.usda`, `folder/room.usdc` and `folder/assets`; return the stage's path.

    The stage is in meters, z up. `/Laboratory` has these children: `Room`, with visible and collision geometry of
    floor and walls; `Fittings`, from `folder/fittings.usdc`, with the visible geometry of ducts, sockets and cables
    if the floor has them; `Placements`, with one prim for each placement that references its asset (wall-mounted ones
    and the pieces of an apparatus are kinematic); `Lights`; and `Cameras`, one for each view of
    `labgym.scenes.views`. Prims have semantic labels (taxonomies `class`, `category` and `instance`). The folder can
    be moved; its references are relative. The files are written to a temporary folder, which then replaces an earlier
    stage.

    Args:
        interactive: whether drawers, doors and sashes are rigid bodies with physics joints, stools, trolleys and boxes
            free bodies, and interior doors bodies on hinges in `Doors`, from `folder/doors.usdc`.

    Raises:
        LabgymError: the folder exists and is not a stage of labgym.
        MissingDependencyError: usd-core is not installed.
    """
    folder = Path(folder)
    files = _asset_files(layout, interactive)
    names = (STAGE_FILE, ROOM_FILE, FITTINGS_FILE, DOORS_FILE, ASSET_FOLDER, TEXTURE_FOLDER)
    with whole_folder(folder, names, "USD stage of labgym") as fresh:
        images = f"../{TEXTURE_FOLDER}"
        for (asset, state, finishes), file in files.items():
            if interactive and _has_joints(asset):
                layer = articulated_layer(asset, palette(finishes), images)
            else:
                layer = asset_layer(asset, state, palette(finishes), images)
            write_layer(layer, fresh / file)
        write_layer(room_layer(layout.floor, leaves=not interactive), fresh / ROOM_FILE)
        _write_textures(layout, fresh / TEXTURE_FOLDER)
        referenced = {"Room": ROOM_FILE}
        added = installations(layout)
        if added:
            write_layer(fittings_layer(added), fresh / FITTINGS_FILE)
            referenced["Fittings"] = FITTINGS_FILE
        if interactive and any(part.kind == "leaf" for part in layout.floor.parts):
            write_layer(doors_layer(layout.floor), fresh / DOORS_FILE)
            referenced["Doors"] = DOORS_FILE
        _write_stage(layout, files, fresh / STAGE_FILE, referenced, interactive)
    return folder / STAGE_FILE


def _has_joints(asset: Asset) -> bool:
    return bool(joints(asset))


def _write_stage(
    layout: Layout,
    files: Mapping[Dressed, str],
    path: Path,
    referenced: Mapping[str, str],
    interactive: bool,
) -> None:
    from pxr import Gf, Usd, UsdGeom, UsdPhysics

    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    UsdPhysics.SetStageKilogramsPerUnit(stage, 1.0)
    root = UsdGeom.Xform.Define(stage, ROOT).GetPrim()
    stage.SetDefaultPrim(root)
    Usd.ModelAPI(root).SetKind("assembly")
    write_note(root, "layout", layout.id)
    write_note(root, "layoutHash", layout.hash)
    if layout.protocol_id:
        write_note(root, "protocol", layout.protocol_id)
    physics = UsdPhysics.Scene.Define(stage, f"{ROOT}/Physics")
    physics.CreateGravityDirectionAttr(Gf.Vec3f(0.0, 0.0, -1.0))
    physics.CreateGravityMagnitudeAttr(GRAVITY)
    write_lights(stage, f"{ROOT}/Lights", layout.floor)
    write_cameras(stage, f"{ROOT}/Cameras", views(layout))
    for name, file in referenced.items():
        UsdGeom.Xform.Define(stage, f"{ROOT}/{name}").GetPrim().GetReferences().AddReference(f"./{file}")
    _write_placements(stage, layout, files, interactive)
    stage.GetRootLayer().Save()


def _write_placements(stage: Any, layout: Layout, files: Mapping[Dressed, str], interactive: bool) -> None:
    from pxr import Gf, Usd, UsdGeom, UsdPhysics

    path = f"{ROOT}/Placements"
    Usd.ModelAPI(UsdGeom.Xform.Define(stage, path).GetPrim()).SetKind("group")
    if interactive:
        UsdGeom.Scope.Define(stage, FRICTIONS)
    names = identifiers([placement.id for placement in layout.placements])
    for name, placement in zip(names, layout.placements, strict=True):
        pose = UsdGeom.Xform.Define(stage, f"{path}/{name}")
        prim = pose.GetPrim()
        dressed = _dressed(layout, placement, interactive)
        asset = dressed[0]
        articulated = interactive and _has_joints(asset)
        prim.GetReferences().AddReference(f"./{files[dressed]}")
        prim.SetInstanceable(not articulated)
        pose.AddTranslateOp().Set(Gf.Vec3d(*placement.position))
        pose.AddRotateZOp(UsdGeom.XformOp.PrecisionDouble).Set(math.degrees(placement.yaw))
        write_labels(prim, {"instance": placement.id})
        write_note(prim, "id", placement.id)
        write_note(prim, "support", placement.support)
        if articulated:
            pose_parts(prim, asset, placement)
        elif interactive:
            release(prim, asset, placement, FRICTIONS)
        if placement.support == WALL or layout.apparatus(placement.id) not in (None, placement.id):
            body = stage.OverridePrim(prim.GetPath().AppendChild(BODY)) if articulated else prim
            UsdPhysics.RigidBodyAPI(body).CreateKinematicEnabledAttr(True)


def _asset_files(layout: Layout, interactive: bool) -> dict[Dressed, str]:
    """Return the files of assets, relative to the stage; each size, state and finish has a separate file."""
    assets = dict.fromkeys(_dressed(layout, placement, interactive) for placement in layout.placements)
    return {
        dressed: f"{ASSET_FOLDER}/{name}.usdc"
        for dressed, name in zip(assets, identifiers([asset.name for asset, *_ in assets]), strict=True)
    }


def _dressed(layout: Layout, placement: Placement, interactive: bool) -> Dressed:
    """Return the asset of a placement, its state, and the finishes of its space if they change the asset.

    The state is empty for an asset with joints in an interactive stage, which poses its parts.
    """
    asset, finishes = drawn_asset(layout, placement.id), finishes_at(layout.floor, *placement.position[:2])
    painted = palette(finishes)
    changed = any(part.material in painted for part in asset_mesh(asset).parts)
    state = () if interactive and _has_joints(asset) else placement.state
    return asset, state, finishes if changed else Finishes()


def _write_textures(layout: Layout, folder: Path) -> None:
    """Write the images of the materials of a layout."""
    for material in np.unique(scene_mesh(layout).material).tolist():
        image = texture(MATERIAL_NAMES[material])
        if image is not None:
            folder.mkdir(exist_ok=True)
            (folder / f"{image.name}.png").write_bytes(image.png)
