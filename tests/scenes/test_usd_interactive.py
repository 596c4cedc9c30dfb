"""Interactive USD stages: clean under the validators, and joints that agree with the layout's solids."""

from __future__ import annotations

import math

import numpy as np
import pytest
from furnished_floors import furnished

pytest.importorskip("pxr")
from pxr import Gf, Usd, UsdGeom, UsdPhysics, UsdShade

from labgym.assets.articulation import fixed_solids, joints, values
from labgym.assets.usd import findings
from labgym.layouts import Layout, Placement, Room
from labgym.scenes import write_usd

PLACEMENTS = "/Laboratory/Placements"


def small() -> Layout:
    placements = (
        Placement(id="bench", asset="LabBench", position=(3.0, 1.0, 0.0), yaw=0.4, state={"drawer_2": 0.7}),
        Placement(id="island", asset="IslandBench1800", position=(6.0, 3.0, 0.0), state={"back_door_1": 0.5}),
        Placement(id="cabinet", asset="FlammableCabinet", position=(1.5, 3.0, 0.0), yaw=-2.0, state={"door_2": 0.6}),
        Placement(id="hood", asset="FumeHood", position=(3.5, 4.5, 0.0), yaw=math.pi, state={"sash": 0.4}),
        Placement(id="stool", asset="LabStool", position=(4.2, 2.4, 0.0)),
        Placement(id="wall", asset="WallCabinet", position=(0.18, 2.0, 1.4), yaw=-math.pi / 2.0, support="wall"),
    )
    return Layout(id="small", floor=Room(width=8.0, depth=5.0).floor, placements=placements)


@pytest.fixture(scope="module")
def layout() -> Layout:
    return small()


@pytest.fixture(scope="module")
def stage(layout, tmp_path_factory):
    return Usd.Stage.Open(str(write_usd(layout, tmp_path_factory.mktemp("usd") / "stage", interactive=True)))


def world(stage, path):
    return UsdGeom.XformCache().GetLocalToWorldTransform(stage.GetPrimAtPath(path))


def frames(stage, joint):
    """World transforms of the two frames of a joint."""
    result = []
    for bodies, position, rotation in (
        (joint.GetBody0Rel(), joint.GetLocalPos0Attr(), joint.GetLocalRot0Attr()),
        (joint.GetBody1Rel(), joint.GetLocalPos1Attr(), joint.GetLocalRot1Attr()),
    ):
        local = Gf.Matrix4d().SetTransform(Gf.Rotation(Gf.Quatd(rotation.Get())), Gf.Vec3d(position.Get()))
        targets = bodies.GetTargets()
        result.append(local * world(stage, targets[0]) if targets else local)
    return result


def coordinate(stage, joint):
    """Place of a joint from its frames: translation along, or turn about, its axis; and what is left over."""
    first, second = frames(stage, joint)
    relative = second * first.GetInverse()
    index = "XYZ".index(joint.GetAxisAttr().Get())
    shift = np.array(relative.ExtractTranslation())
    turn = relative.ExtractRotation()
    angle = math.radians(turn.GetAngle()) * turn.GetAxis()[index]
    if isinstance(joint, UsdPhysics.PrismaticJoint):
        return shift[index], np.abs(np.delete(shift, index)).max() + abs(angle)
    return angle, np.abs(shift).max()


def physics_joints(stage):
    return [
        (UsdPhysics.PrismaticJoint if prim.IsA(UsdPhysics.PrismaticJoint) else UsdPhysics.RevoluteJoint)(prim)
        for prim in stage.Traverse()
        if prim.IsA(UsdPhysics.Joint)
    ]


def test_an_interactive_stage_is_clean_under_the_validators_of_openusd_and_nvidia(stage):
    assert findings(stage) == ()
    validator = pytest.importorskip("omni.asset_validator")
    issues = validator.ValidationEngine().validate(stage.GetRootLayer().identifier).issues()
    assert [issue.message for issue in issues] == []


def test_joints_begin_at_the_states_of_the_placements_and_end_at_their_travel(stage, layout):
    found = {}
    for joint in physics_joints(stage):
        parts = str(joint.GetPath()).removeprefix(f"{PLACEMENTS}/").split("/")
        found[parts[0], parts[-1]] = joint
    expected = {(p.id, name) for p in layout.placements for name in joints(layout.asset(p.id))}
    assert set(found) == expected
    for (owner, name), joint in found.items():
        asset, placement = layout.asset(owner), layout.placement(owner)
        entry = joints(asset)[name]
        value, rest = coordinate(stage, joint)
        assert value == pytest.approx(values(asset, placement.state)[name] - entry.drawn, abs=1e-5)
        assert rest == pytest.approx(0.0, abs=1e-5)
        unit = 1.0 if entry.kind == "slide" else math.degrees(1.0)
        assert joint.GetUpperLimitAttr().Get() == pytest.approx((entry.travel - entry.drawn) * unit, abs=1e-3)
        assert joint.GetLowerLimitAttr().Get() == pytest.approx(-entry.drawn * unit, abs=1e-3)
        for body in (joint.GetBody0Rel(), joint.GetBody1Rel()):
            assert stage.GetPrimAtPath(body.GetTargets()[0]).HasAPI(UsdPhysics.RigidBodyAPI)


def test_colliders_of_moving_parts_are_the_solids_of_the_layout(stage, layout):
    for placement in layout.placements:
        asset = layout.asset(placement.id)
        boxes = layout.solids(placement.id)[len(fixed_solids(asset)) :] if placement.state else ()
        for name, box in zip(joints(asset), boxes, strict=False):
            matrix = world(stage, f"{PLACEMENTS}/{placement.id}/{name}/Colliders/box_0")
            assert np.array(matrix.ExtractTranslation()) == pytest.approx(
                [box.x, box.y, (box.z0 + box.z1) / 2.0], abs=2e-5
            )


def test_furniture_stays_while_parts_stools_and_trolleys_move(stage, layout):
    def kinematic(path):
        return bool(UsdPhysics.RigidBodyAPI(stage.GetPrimAtPath(path)).GetKinematicEnabledAttr().Get())

    assert kinematic(f"{PLACEMENTS}/bench/Body")
    assert kinematic(f"{PLACEMENTS}/wall/Body")
    assert not kinematic(f"{PLACEMENTS}/bench/drawer_2")
    stool = stage.GetPrimAtPath(f"{PLACEMENTS}/stool")
    assert not kinematic(stool.GetPath())
    material, _ = UsdShade.MaterialBindingAPI(stool).ComputeBoundMaterial("physics")
    assert UsdPhysics.MaterialAPI(material.GetPrim()).GetDynamicFrictionAttr().Get() == pytest.approx(0.06)
    sash = stage.GetPrimAtPath(f"{PLACEMENTS}/hood/sash")
    assert sash.GetAttribute("physxRigidBody:disableGravity").Get() is True
    mass = sum(
        UsdPhysics.MassAPI(prim).GetMassAttr().Get()
        for prim in stage.GetPrimAtPath(f"{PLACEMENTS}/cabinet").GetChildren()
        if prim.HasAPI(UsdPhysics.MassAPI)
    )
    assert mass == pytest.approx(layout.asset("cabinet").mass, rel=1e-3)


def test_interior_doors_hang_on_their_hinges(tmp_path):
    layout = furnished("suite").replace(placements=())
    stage = Usd.Stage.Open(str(write_usd(layout, tmp_path / "doors", interactive=True)))
    hinges = physics_joints(stage)
    leaves = [part.box for part in layout.floor.parts if part.kind == "leaf"]
    assert len(hinges) == len(leaves) == 4
    for joint in hinges:
        value, rest = coordinate(stage, joint)
        assert (value, rest) == pytest.approx((0.0, 0.0), abs=1e-5)
        body = joint.GetBody1Rel().GetTargets()[0]
        x, y, _ = world(stage, body).ExtractTranslation()
        assert min(math.hypot(x - box.x, y - box.y) for box in leaves) < 1e-5
        assert joint.GetLowerLimitAttr().Get() <= 0.0 < joint.GetUpperLimitAttr().Get() + 1e-6
    assert findings(stage) == ()
    static = Usd.Stage.Open(str(write_usd(layout, tmp_path / "static")))
    assert physics_joints(static) == []
    assert not static.GetPrimAtPath("/Laboratory/Doors")
