"""An asset with moving parts as a USD layer: a rigid body for each part, and physics joints between them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from labgym.assets.articulation import all_parts, fixed_solids, joints
from labgym.assets.model import Asset
from labgym.assets.shapes import Part
from labgym.assets.shapes.joints import MECHANISMS, Joint
from labgym.assets.usd.bodies import rounded, write_collider
from labgym.assets.usd.stages import (
    UNPAINTED,
    Looks,
    define_asset,
    new_layer,
    repainted,
    write_geometry,
    write_looks,
)
from labgym.geometry import OrientedBox

BODY = "Body"
"""Name of the prim of the fixed part."""
JOINTS = "Joints"


def articulated_layer(asset: Asset, painted: Mapping[str, str] = UNPAINTED, images: str = "") -> Any:
    """Return an asset with joints as an anonymous `pxr.Sdf.Layer`, its parts as drawn.

    As `asset_layer`, but the default prim is no rigid body: its children are `Body` (the fixed part), a prim for each
    joint of `labgym.assets.articulation.joints` under its name, all of them rigid bodies with Geometry and Colliders,
    and `Joints`. A joint's coordinate is 0 where the part is drawn; its damping is that of a drive without target.
    Gravity does not act on counterbalanced parts (`physxRigidBody:disableGravity`).

    Args:
        painted, images: as in `asset_layer`.

    Raises:
        MissingDependencyError: usd-core is not installed.
    """
    layer, stage = new_layer(asset.name)
    from pxr import UsdGeom, UsdPhysics

    root = define_asset(stage, asset)
    path, parts, own = f"/{asset.name}", repainted(all_parts(asset), painted), joints(asset)
    looks = write_looks(stage, f"{path}/Looks", parts, images)
    body = UsdGeom.Xform.Define(stage, f"{path}/{BODY}").GetPrim()
    rigid = UsdPhysics.RigidBodyAPI.Apply(body)
    if asset.kind == "facility":
        rigid.CreateKinematicEnabledAttr(True)
    moving = sum(joint.mass - MECHANISMS[joint.mechanism].content for joint in own.values())
    UsdPhysics.MassAPI.Apply(body).CreateMassAttr(round(max(asset.mass - moving, 0.1 * asset.mass), 3))
    fixed = [part for part in parts if part.joint is None]
    _write_body(stage, f"{path}/{BODY}", fixed, looks, fixed_solids(asset))
    UsdGeom.Scope.Define(stage, f"{path}/{JOINTS}")
    for name, joint in own.items():
        prim = UsdGeom.Xform.Define(stage, f"{path}/{name}").GetPrim()
        if joint.balanced:
            _disable_gravity(prim)
        UsdPhysics.RigidBodyAPI.Apply(prim)
        UsdPhysics.MassAPI.Apply(prim).CreateMassAttr(round(joint.mass, 3))
        _write_body(stage, f"{path}/{name}", [p for p in parts if p.joint == joint], looks, [joint.solid])
        _write_joint(stage, root, joint)
    return layer


def _write_body(stage: Any, path: str, parts: Sequence[Part], looks: Looks, solids: Sequence[OrientedBox]) -> None:
    from pxr import UsdGeom

    write_geometry(stage, f"{path}/Geometry", parts, looks)
    UsdGeom.Scope.Define(stage, f"{path}/Colliders").CreatePurposeAttr(UsdGeom.Tokens.guide)
    for k, box in enumerate(solids):
        write_collider(stage, f"{path}/Colliders/box_{k}", box)


def _disable_gravity(prim: Any) -> None:
    """Turn gravity off for a body, as PhysX reads it."""
    from pxr import Sdf

    prim.AddAppliedSchema("PhysxRigidBodyAPI")
    prim.CreateAttribute("physxRigidBody:disableGravity", Sdf.ValueTypeNames.Bool, False).Set(True)


def _write_joint(stage: Any, root: Any, joint: Joint) -> None:
    """Define the joint of a moving part with the fixed part; positive motion opens."""
    from pxr import UsdPhysics

    path = root.GetPath()
    place = path.AppendChild(JOINTS).AppendChild(joint.name)
    slides = joint.kind == "slide"
    define = UsdPhysics.PrismaticJoint.Define if slides else UsdPhysics.RevoluteJoint.Define
    prim = define(stage, place)
    prim.CreateBody0Rel().SetTargets([path.AppendChild(BODY)])
    prim.CreateBody1Rel().SetTargets([path.AppendChild(joint.name)])
    set_joint(prim, joint.axis, joint.origin, (-joint.drawn, joint.travel - joint.drawn), joint.damping)


def set_joint(
    joint: Any,
    axis: tuple[float, float, float],
    origin: tuple[float, float, float],
    limits: tuple[float, float],
    damping: float,
) -> None:
    """Author axis, frames, limits and damping of a joint along or about an axis of its bodies' common frame.

    Args:
        joint: a `UsdPhysics.PrismaticJoint` or `RevoluteJoint`.
        axis: unit vector along x, y or z, or against it.
        origin: in the frame of both bodies, meters.
        limits: meters or radians from the authored place.
        damping: N s/m or N m s/rad.
    """
    from pxr import Gf, UsdPhysics

    slides = isinstance(joint, UsdPhysics.PrismaticJoint)
    unit = 1.0 if slides else math.degrees(1.0)
    index = max(range(3), key=lambda k: abs(axis[k]))
    joint.CreateAxisAttr("XYZ"[index])
    x, y, z = rounded(origin).tolist()
    # Against the axis, both frames are turned by half a turn about another axis.
    frame = Gf.Quatf(1.0) if axis[index] > 0.0 else Gf.Quatf(0.0, *((1.0, 0.0, 0.0) if index else (0.0, 0.0, 1.0)))
    for position, rotation in (
        (joint.CreateLocalPos0Attr(), joint.CreateLocalRot0Attr()),
        (joint.CreateLocalPos1Attr(), joint.CreateLocalRot1Attr()),
    ):
        position.Set(Gf.Vec3f(x, y, z))
        rotation.Set(frame)
    joint.CreateLowerLimitAttr(round(limits[0] * unit, 5) + 0.0)
    joint.CreateUpperLimitAttr(round(limits[1] * unit, 5) + 0.0)
    drive = UsdPhysics.DriveAPI.Apply(joint.GetPrim(), "linear" if slides else "angular")
    drive.CreateTypeAttr("force")
    drive.CreateStiffnessAttr(0.0)
    drive.CreateDampingAttr(round(damping / unit, 6))
