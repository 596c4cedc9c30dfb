"""A layout as a USD stage: poses, colliders, lights, cameras, labels, and a folder that can be moved."""

from __future__ import annotations

import math
from pathlib import Path

import mujoco
import numpy as np
import pytest

pytest.importorskip("pxr")
from pxr import Gf, Usd, UsdGeom, UsdLux, UsdPhysics, UsdSemantics

from labgym.assets.meshes import read_mesh
from labgym.assets.usd import findings
from labgym.errors import LabgymError
from labgym.layouts import Layout, Room, load_published
from labgym.scenes import scene_mesh, to_mjcf, views, write_usd


@pytest.fixture
def stage(laboratory: Layout, tmp_path: Path) -> Usd.Stage:
    return Usd.Stage.Open(str(write_usd(laboratory, tmp_path / "scene")))


def test_a_stage_is_clean_under_all_validators_of_openusd(stage: Usd.Stage) -> None:
    assert findings(stage) == ()
    assert stage.GetCompositionErrors() == []


def test_a_published_laboratory_is_clean_too(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    layout = load_published("val", "val-alk_01")
    stage = Usd.Stage.Open(str(write_usd(layout, tmp_path / "scene")))
    assert findings(stage) == ()
    assert len(stage.GetPrimAtPath("/Laboratory/Placements").GetChildren()) == len(layout.placements)
    assert capfd.readouterr() == ("", "")


def test_visible_faces_are_where_the_scene_mesh_has_them(laboratory: Layout, tmp_path: Path) -> None:
    """The stage, read back as a mesh, has the triangles of the scene that labgym's own sensors see."""
    mesh = read_mesh(write_usd(laboratory, tmp_path / "scene"))
    expected = scene_mesh(laboratory)
    assert sum(len(part.faces) for part in mesh.parts) == len(expected.faces)
    centroids = np.concatenate([part.vertices[part.faces].mean(axis=1) for part in mesh.parts])
    centres = expected.vertices[expected.faces].mean(axis=1)
    np.testing.assert_allclose(_sorted(centroids), _sorted(centres), atol=2e-4)


def _sorted(points: np.ndarray) -> np.ndarray:
    """Return each coordinate's values in order: the same for two clouds of the same points."""
    return np.sort(points, axis=0)


def test_colliders_are_the_solids_of_the_layout(laboratory: Layout, stage: Usd.Stage) -> None:
    cache = UsdGeom.BBoxCache(Usd.TimeCode.Default(), [UsdGeom.Tokens.guide])
    for placement in laboratory.placements:
        prim = stage.GetPrimAtPath(f"/Laboratory/Placements/{placement.id}")
        box = cache.ComputeWorldBound(prim.GetChild("Colliders")).ComputeAlignedRange()
        solids = laboratory.solids(placement.id)
        plane = np.array([solid.bounds() for solid in solids])
        low = (*plane[:, :2].min(axis=0), min(solid.z0 for solid in solids))
        high = (*plane[:, 2:].max(axis=0), max(solid.z1 for solid in solids))
        np.testing.assert_allclose([box.GetMin(), box.GetMax()], [low, high], atol=1e-4)
    walls = stage.GetPrimAtPath("/Laboratory/Room/Colliders").GetChildren()
    assert {prim.GetName() for prim in walls} == {*(f"wall_{k}_wall_0" for k in range(4)), "floor"}
    assert all(prim.HasAPI(UsdPhysics.CollisionAPI) for prim in walls)


def test_furniture_and_wall_mounted_placements_are_kinematic_and_the_others_can_fall(
    laboratory: Layout, stage: Usd.Stage
) -> None:
    for placement in laboratory.placements:
        body = UsdPhysics.RigidBodyAPI(stage.GetPrimAtPath(f"/Laboratory/Placements/{placement.id}"))
        stays = laboratory.asset(placement.id).kind == "facility" or placement.support == "wall"
        assert bool(body.GetKinematicEnabledAttr().Get()) is stays, placement.id
    scene = UsdPhysics.Scene(stage.GetPrimAtPath("/Laboratory/Physics"))
    assert scene.GetGravityMagnitudeAttr().Get() == pytest.approx(9.81)


def test_the_folder_can_be_moved_and_is_reproducible(laboratory: Layout, tmp_path: Path) -> None:
    write_usd(laboratory, tmp_path / "scene")
    first = {path.name: path.read_bytes() for path in (tmp_path / "scene").rglob("*.usd*")}
    write_usd(laboratory, tmp_path / "scene")
    assert {path.name: path.read_bytes() for path in (tmp_path / "scene").rglob("*.usd*")} == first
    (tmp_path / "scene").rename(tmp_path / "moved")
    assert Usd.Stage.Open(str(tmp_path / "moved" / "scene.usda")).GetCompositionErrors() == []
    assert str(tmp_path).encode() not in b"".join(first.values())


def test_a_folder_with_other_content_is_refused_and_unchanged(laboratory: Layout, tmp_path: Path) -> None:
    (tmp_path / "mine.txt").write_text("keep")
    with pytest.raises(LabgymError, match=r"not a USD stage"):
        write_usd(laboratory, tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]


def test_ids_that_are_not_usd_identifiers_are_kept_as_attributes(laboratory: Layout, tmp_path: Path) -> None:
    clock = next(p for p in laboratory.placements if p.id == "clock")
    twins = tuple(clock.model_copy(update={"id": name}) for name in ("1-a", "1.a", "1_a"))
    layout = laboratory.replace(placements=twins)
    stage = Usd.Stage.Open(str(write_usd(layout, tmp_path / "scene")))
    prims = stage.GetPrimAtPath("/Laboratory/Placements").GetChildren()
    assert {prim.GetAttribute("labgym:id").Get() for prim in prims} == {"1-a", "1.a", "1_a"}
    assert len(prims) == 3
    turned = UsdGeom.XformCache().GetLocalToWorldTransform(prims[0])
    assert math.atan2(turned[0][1], turned[0][0]) == pytest.approx(clock.yaw)


def test_the_root_is_text_without_large_arrays(stage: Usd.Stage) -> None:
    """Binary files hold the meshes; the root can be read."""
    layer = stage.GetRootLayer()
    sizes: list[int] = []

    def visit(path: object) -> None:
        attribute = layer.GetAttributeAtPath(path)
        if attribute and attribute.typeName.isArray and attribute.HasDefaultValue():
            sizes.append(len(attribute.default))

    layer.Traverse("/", visit)
    assert Path(layer.realPath).read_text(encoding="utf-8").startswith("#usda")
    assert max(sizes) <= 64


def test_cameras_show_what_the_cameras_of_the_mjcf_scene_show(laboratory: Layout, stage: Usd.Stage) -> None:
    """Both project the same points to the same places of a 16:9 picture."""
    model = to_mjcf(laboratory, visible=False).compile()
    cameras = {prim.GetAttribute("labgym:view").Get(): UsdGeom.Camera(prim) for prim in _children(stage, "Cameras")}
    assert set(cameras) == set(views(laboratory)) == {model.camera(k).name for k in range(model.ncam)}
    rng = np.random.default_rng(0)
    for name, camera in cameras.items():
        position, rotation = model.camera(name).pos, np.zeros(9)
        mujoco.mju_quat2Mat(rotation, model.camera(name).quat)
        local = rng.uniform((-1.0, -1.0, -6.0), (1.0, 1.0, -2.0), (20, 3))
        world = local @ rotation.reshape(3, 3).T + position
        tall = math.tan(math.radians(float(model.camera(name).fovy[0])) / 2.0)
        expected = local[:, :2] / -local[:, 2:] / np.array([tall * 16.0 / 9.0, tall])
        frustum = camera.GetCamera().frustum
        matrix = frustum.ComputeViewMatrix() * frustum.ComputeProjectionMatrix()
        projected = np.array([matrix.Transform(Gf.Vec3d(*map(float, point))) for point in world])[:, :2]
        np.testing.assert_allclose(projected, expected, atol=1e-4)


@pytest.mark.parametrize("room", [Room(width=8.0, depth=8.0), Room(width=3.0, depth=2.4), Room(width=40.0, depth=30.0)])
def test_ceiling_panels_shine_down_and_light_the_floor_at_a_thousand_lux(room: Room, tmp_path: Path) -> None:
    layout = Layout(id="empty", floor=room.floor, placements=())
    stage = Usd.Stage.Open(str(write_usd(layout, tmp_path / "scene")))
    panels = [UsdLux.RectLight(prim) for prim in _children(stage, "Lights") if prim.IsA(UsdLux.RectLight)]
    # A flat Lambertian source of luminance L and area A emits pi L A lumens.
    flux = sum(
        math.pi * light.GetIntensityAttr().Get() * light.GetWidthAttr().Get() * light.GetHeightAttr().Get()
        for light in panels
    )
    assert flux / (room.width * room.depth) == pytest.approx(1000.0, rel=1e-3)
    assert len(panels) <= 100
    for light in panels:
        pose = UsdGeom.XformCache().GetLocalToWorldTransform(light.GetPrim())
        x, y, z = pose.ExtractTranslation()
        assert (0.0 < x < room.width, 0.0 < y < room.depth, z < room.height) == (True, True, True)
        assert pose.TransformDir(Gf.Vec3d(0.0, 0.0, -1.0))[2] == pytest.approx(-1.0)


def test_placements_and_the_room_have_semantic_labels(laboratory: Layout, stage: Usd.Stage) -> None:
    def label(prim: Usd.Prim, taxonomy: str) -> str:
        (text,) = UsdSemantics.LabelsAPI(prim, taxonomy).GetLabelsAttr().Get()
        return str(text)

    for placement in laboratory.placements:
        prim = stage.GetPrimAtPath(f"/Laboratory/Placements/{placement.id}")
        asset = laboratory.asset(placement.id)
        labels = [label(prim, taxonomy) for taxonomy in ("class", "category", "instance")]
        assert labels == [asset.name, asset.category, placement.id]
    surfaces = _children(stage, "Room/Geometry")
    assert {label(prim, "class") for prim in surfaces} == {"floor", "wall", "door", "window"}


@pytest.mark.slow
def test_a_published_laboratory_has_no_finding_of_nvidias_asset_validator(tmp_path: Path) -> None:
    validator = pytest.importorskip("omni.asset_validator")
    path = write_usd(load_published("val", "val-alk_01"), tmp_path / "scene")
    issues = validator.ValidationEngine().validate(str(path)).issues()
    assert [f"{issue.rule.__name__}: {issue.message}" for issue in issues] == []


def _children(stage: Usd.Stage, path: str) -> list[Usd.Prim]:
    return list(stage.GetPrimAtPath(f"/Laboratory/{path}").GetChildren())
