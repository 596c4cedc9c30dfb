"""Moving bodies of a USD stage: articulated placements in their state, free ones on castors, and interior doors."""

from __future__ import annotations

import math
from typing import Any

from labgym.assets import Asset
from labgym.assets.articulation import footing, joints, values
from labgym.assets.shapes.joints import Joint
from labgym.assets.usd import set_joint, write_collider, write_geometry, write_labels, write_looks
from labgym.geometry import OrientedBox, rotate
from labgym.layouts import Placement
from labgym.layouts.floor import Floor
from labgym.layouts.placement import FLOOR
from labgym.scenes.building import LEAF_DAMPING, LEAF_MASS, Leaf, leaves_of
from labgym.scenes.usd.room import identifiers, write_note
from labgym.scenes.wall_openings import leaf_parts


def pose_parts(prim: Any, asset: Asset, placement: Placement) -> None:
    """Move the parts of an articulated placement to the state of the placement."""
    from pxr import Gf, UsdGeom

    places = values(asset, placement.state)
    for name, joint in joints(asset).items():
        motion = places[name] - joint.drawn
        if motion == 0.0:
            continue
        part = UsdGeom.Xformable(prim.GetStage().OverridePrim(prim.GetPath().AppendChild(name)))
        x, y, z, angle = _motion(joint, motion)
        part.AddTranslateOp().Set(Gf.Vec3d(x, y, z))
        if angle:
            part.AddRotateZOp(UsdGeom.XformOp.PrecisionDouble).Set(math.degrees(angle))


def _motion(joint: Joint, motion: float) -> tuple[float, float, float, float]:
    """Return the translation (meters) and the turn about z (radians) that take a part to a place in its range."""
    if joint.kind == "slide":
        x, y, z = (motion * along for along in joint.axis)
        return x, y, z, 0.0
    angle = motion * joint.axis[2]
    dx, dy = rotate(-joint.origin[0], -joint.origin[1], angle)
    return joint.origin[0] + dx, joint.origin[1] + dy, 0.0, angle


def release(prim: Any, asset: Asset, placement: Placement, materials: str) -> None:
    """Make a placement that a push moves a free body with the friction of its castors or feet.

    Args:
        materials: path of the scope of the physics materials.
    """
    from pxr import UsdPhysics, UsdShade

    foot = footing(asset) if placement.support == FLOOR else None
    if foot is None:
        return
    stage = prim.GetStage()
    material = UsdShade.Material.Define(stage, f"{materials}/{asset.shape.name}")
    friction = UsdPhysics.MaterialAPI.Apply(material.GetPrim())
    friction.CreateStaticFrictionAttr(foot.friction)
    friction.CreateDynamicFrictionAttr(foot.friction)
    UsdShade.MaterialBindingAPI.Apply(prim).Bind(material, UsdShade.Tokens.weakerThanDescendants, "physics")
    UsdPhysics.RigidBodyAPI(prim).CreateKinematicEnabledAttr(False)


def doors_layer(floor: Floor) -> Any:
    """Return the leaves of the interior doors as an anonymous `pxr.Sdf.Layer`: rigid bodies on hinges to the world.

    A leaf is authored at its angle, where its joint's coordinate is 0.
    """
    from labgym.assets.usd.stages import new_layer

    layer, stage = new_layer("doors")
    from pxr import Usd, UsdGeom, UsdPhysics

    root = UsdGeom.Xform.Define(stage, "/Doors").GetPrim()
    stage.SetDefaultPrim(root)
    Usd.ModelAPI(root).SetKind("component")
    leaves = list(leaves_of(floor))
    parts = [[*leaf_parts(e.box.width, e.box.depth, e.box.z1, "window_glass", e.material)] for e in leaves]
    looks = write_looks(stage, "/Doors/Looks", [part for each in parts for part in each])
    UsdGeom.Scope.Define(stage, "/Doors/Joints")
    names = identifiers([leaf.name for leaf in leaves])
    for name, leaf, own in zip(names, leaves, parts, strict=True):
        prim = UsdGeom.Xform.Define(stage, f"/Doors/{name}").GetPrim()
        _place_leaf(prim, leaf)
        UsdPhysics.RigidBodyAPI.Apply(prim)
        UsdPhysics.MassAPI.Apply(prim).CreateMassAttr(round(LEAF_MASS * leaf.box.width * leaf.box.z1, 3))
        write_labels(prim, {"class": "door"})
        write_note(prim, "solid", leaf.name)
        write_geometry(stage, f"/Doors/{name}/Geometry", own, looks)
        UsdGeom.Scope.Define(stage, f"/Doors/{name}/Colliders").CreatePurposeAttr(UsdGeom.Tokens.guide)
        box = OrientedBox(0.0, 0.0, leaf.box.width, leaf.box.depth, 0.0, leaf.box.z0, leaf.box.z1)
        write_collider(stage, f"/Doors/{name}/Colliders/box_0", box)
        _write_hinge(stage, name, leaf)
    return layer


def _place_leaf(prim: Any, leaf: Leaf) -> None:
    from pxr import Gf, UsdGeom

    pose = UsdGeom.Xformable(prim)
    pose.AddTranslateOp().Set(Gf.Vec3d(leaf.box.x, leaf.box.y, 0.0))
    pose.AddRotateZOp(UsdGeom.XformOp.PrecisionDouble).Set(math.degrees(leaf.box.yaw))


def _write_hinge(stage: Any, name: str, leaf: Leaf) -> None:
    """Define the hinge of a leaf; its first body is the world."""
    from pxr import Gf, UsdPhysics

    joint = UsdPhysics.RevoluteJoint.Define(stage, f"/Doors/Joints/{name}")
    joint.CreateBody1Rel().SetTargets([f"/Doors/{name}"])
    limits = -leaf.angle, leaf.travel - leaf.angle
    damping = LEAF_DAMPING * leaf.box.width**2
    set_joint(joint, (0.0, 0.0, leaf.turn), (*leaf.hinge, 0.0), limits, damping)
    dx, dy = rotate(*leaf.hinge, leaf.box.yaw)
    joint.CreateLocalPos0Attr().Set(Gf.Vec3f(leaf.box.x + dx, leaf.box.y + dy, 0.0))
    half = leaf.box.yaw / 2.0
    turn = Gf.Quatf(math.cos(half), 0.0, 0.0, math.sin(half))
    joint.CreateLocalRot0Attr().Set(turn * joint.GetLocalRot1Attr().Get())
