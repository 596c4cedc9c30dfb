"""The catalogue as OpenUSD: clean under OpenUSD's validators, current, and the same geometry when read again."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

pytest.importorskip("pxr")
from pxr import Sdf, Usd, UsdGeom, UsdPhysics, UsdSemantics, UsdShade

from labgym.assets import Catalog
from labgym.assets.meshes import normalize, read_mesh
from labgym.assets.meshes.reading import from_raw
from labgym.assets.meshes.stage import read_stage
from labgym.assets.shapes import MATERIALS, build, tessellate
from labgym.assets.usd import (
    ATTRIBUTES,
    asset_layer,
    check_files,
    findings,
    stray_files,
    usd_folder,
    usd_path,
    write_files,
)

CATALOG = Catalog.load()
ONE_OF_EACH_SHAPE = {asset.shape.name: asset for asset in reversed(CATALOG.assets)}.values()
TOLERANCE = 1e-4
"""0.1 mm."""


def opened(asset) -> Usd.Stage:
    return Usd.Stage.Open(asset_layer(asset))


def test_the_committed_files_are_what_the_catalogue_gives_and_clean_under_all_validators():
    problems = [line for _, lines in check_files(CATALOG, usd_folder()) for line in lines]
    assert problems == []
    assert stray_files(CATALOG, usd_folder()) == ()


@pytest.mark.cases(20)
@pytest.mark.parametrize("asset", ONE_OF_EACH_SHAPE, ids=lambda asset: asset.shape.name)
def test_reading_an_exported_asset_gives_its_geometry_within_a_tenth_of_a_millimetre(asset, tmp_path):
    path = tmp_path / f"{asset.name}.usdc"
    asset_layer(asset).Export(str(path))
    mesh = normalize(from_raw(path, read_stage(path)), hulls_only=True)
    expected = [tessellate(part) for part in build(asset)]
    everything = np.concatenate([vertices for vertices, _ in expected])
    low, high = everything.min(axis=0), everything.max(axis=0)
    size = (mesh.size.width, mesh.size.depth, mesh.size.height)
    np.testing.assert_allclose(size, high - low, atol=TOLERANCE)
    origin = np.array([*((low + high) / 2.0)[:2], low[2]])
    assert [part.material for part in mesh.parts] == [part.material for part in build(asset)]
    for part, (vertices, faces) in zip(mesh.parts, expected, strict=True):
        assert len(part.faces) == len(faces)
        np.testing.assert_allclose(part.vertices[part.faces], vertices[faces] - origin, atol=TOLERANCE)


def test_a_file_goes_through_the_reader_that_users_have(tmp_path):
    asset = CATALOG.get("RoundBottomFlask")
    (path,) = write_files([asset], tmp_path)
    mesh = read_mesh(path)
    assert (mesh.name, mesh.source_unit, mesh.unit_from, mesh.up_axis) == (asset.name, "m", "file metadata", "Z")
    assert mesh.metadata["labgym:name"] == asset.name
    glass = next(part for part in mesh.parts if part.material == "borosilicate")
    np.testing.assert_allclose(glass.color, MATERIALS["borosilicate"].rgba, atol=1e-3)
    size = normalize(mesh, hulls_only=True).size
    assert (size.width, size.height) == pytest.approx((asset.size.width, asset.size.height), abs=1e-3)


def test_every_file_has_default_prim_unit_axis_and_kind():
    for asset in ONE_OF_EACH_SHAPE:
        stage = opened(asset)
        root = stage.GetDefaultPrim()
        assert root.GetName() == asset.name
        assert (UsdGeom.GetStageMetersPerUnit(stage), UsdGeom.GetStageUpAxis(stage)) == (1.0, "Z")
        assert Usd.ModelAPI(root).GetKind() == "component"


def test_masses_and_colliders_are_those_of_the_catalogue():
    for asset in ONE_OF_EACH_SHAPE:
        stage = opened(asset)
        root = stage.GetDefaultPrim()
        assert UsdPhysics.MassAPI(root).GetMassAttr().Get() == pytest.approx(asset.mass)
        body = UsdPhysics.RigidBodyAPI(root)
        assert body.GetKinematicEnabledAttr().Get() is (asset.kind == "facility")
        colliders = [prim for prim in stage.Traverse() if prim.HasAPI(UsdPhysics.CollisionAPI)]
        cache = UsdGeom.BBoxCache(Usd.TimeCode.Default(), [UsdGeom.Tokens.guide])
        found = sorted(
            tuple(round(float(value), 4) for value in (*box.GetMin(), *box.GetMax()))
            for box in (cache.ComputeWorldBound(prim).ComputeAlignedRange() for prim in colliders)
        )
        expected = sorted(
            tuple(
                round(value, 4)
                for value in (
                    solid.x - solid.width / 2, solid.y - solid.depth / 2, solid.z0,
                    solid.x + solid.width / 2, solid.y + solid.depth / 2, solid.z1,
                )
            )
            for solid in asset.solids()
        )  # fmt: skip
        np.testing.assert_allclose(found, expected, atol=TOLERANCE)


def test_every_visible_prim_has_a_material_bound():
    for asset in ONE_OF_EACH_SHAPE:
        stage = opened(asset)
        for prim in stage.Traverse():
            if prim.IsA(UsdGeom.Gprim) and UsdGeom.Imageable(prim).ComputePurpose() == "default":
                material, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()
                assert material, f"{asset.name}: {prim.GetPath()}"
                assert material.ComputeSurfaceSource()[0].GetIdAttr().Get() == "UsdPreviewSurface"


def test_hazards_and_chemistry_are_custom_attributes_with_documentation():
    acid = next(asset for asset in CATALOG if asset.hazards.acid and asset.chemistry and asset.chemistry.cas)
    stage = opened(acid)
    root = stage.GetDefaultPrim()
    for name, value in acid.hazards.model_dump().items():
        assert root.GetAttribute(f"labgym:hazards:{name}").Get() is value
    assert root.GetAttribute("labgym:chemistry:cas").Get() == acid.chemistry.cas
    assert tuple(root.GetAttribute("labgym:synonyms:zh").Get()) == acid.synonyms_zh
    custom = [attribute for attribute in root.GetAttributes() if attribute.IsCustom()]
    assert len(custom) > 15
    assert all(attribute.GetDocumentation() for attribute in custom)


def test_specifications_are_custom_attributes_with_their_units():
    names = ("MagneticHotplateStirrer", "FumeHood", "SinkBench", "UVCabinet", "ToxicCabinet")
    stages = {name: opened(CATALOG.get(name)) for name in (*names, "GasCylinderCabinet", "FireExtinguisher", "Beaker")}

    def said(name, spec):
        return stages[name].GetDefaultPrim().GetAttribute(f"labgym:specs:{spec}")

    assert tuple(said("MagneticHotplateStirrer", "rotation_rpm").Get()) == (50.0, 1500.0)
    assert said("MagneticHotplateStirrer", "rotation_rpm").GetDocumentation().endswith("Unit: rpm.")
    assert said("FumeHood", "face_velocity_m_s").Get() == 0.5
    assert tuple(said("SinkBench", "bowl_m").Get()) == (0.45, 0.4, 0.3)
    assert tuple(said("UVCabinet", "lines_nm").Get()) == (254.0, 365.0)
    assert tuple(said("ToxicCabinet", "features").Get()) == ("ventilated", "lockable")
    assert said("GasCylinderCabinet", "fire_rating_min").Get() == 30
    assert said("FireExtinguisher", "agent").Get() == "ABC"
    assert not said("Beaker", "rotation_rpm").IsValid()


def test_every_custom_attribute_is_in_the_documentation():
    page = (Path(__file__).parents[2] / "docs" / "specifications.md").read_text(encoding="utf-8")
    names = [attribute.full_name.removeprefix("labgym:specs:") for attribute in ATTRIBUTES]
    missing = [name for name in names if f"`{name}`" not in page]
    assert missing == []


@pytest.mark.parametrize("damage, message", [
    ('upAxis = "Z"', "upAxis"),
    ('prepend apiSchemas = ["MaterialBindingAPI"]', "MaterialBindingAPI"),
    ('defaultPrim = "GlassRod"', "defaultPrim"),
])  # fmt: skip
def test_the_validators_see_damage_and_the_check_names_the_file(tmp_path, damage, message):
    asset = CATALOG.get("GlassRod")
    (path,) = write_files([asset], tmp_path)
    assert list(check_files([asset], tmp_path)) == [(asset, ())]
    damaged = Sdf.Layer.CreateAnonymous(".usda")
    damaged.ImportFromString(Sdf.Layer.OpenAsAnonymous(str(path)).ExportToString().replace(damage, ""))
    damaged.Export(str(path))
    ((_, problems),) = check_files([asset], tmp_path)
    assert any("is outdated" in problem for problem in problems)
    assert any(message in problem for problem in problems[1:])
    assert all(str(path) in problem for problem in problems)


def test_missing_broken_and_stray_files_are_named(tmp_path):
    asset = CATALOG.get("GlassRod")
    ((_, missing),) = check_files([asset], tmp_path)
    (path,) = write_files([asset], tmp_path)
    path.write_text("junk")
    ((_, broken),) = check_files([asset], tmp_path)
    assert [line.split()[1:] for line in (*missing, *broken)] == [
        ["is", "missing"],
        ["cannot", "be", "read", "as", "USD"],
    ]
    (tmp_path / "instrument" / "Other.usdc").write_bytes(b"")
    assert [stray.name for stray in stray_files([asset], tmp_path)] == ["Other.usdc"]
    assert usd_path(asset, tmp_path).parent.name == asset.kind


def test_the_same_asset_gives_the_same_bytes(tmp_path):
    assets = list(ONE_OF_EACH_SHAPE)[:5]
    for first, second in zip(write_files(assets, tmp_path / "a"), write_files(assets, tmp_path / "b"), strict=True):
        assert first.read_bytes() == second.read_bytes()


class Surface(NamedTuple):
    """A mesh prim: points (n, 3), faces (m, 3), normals (m, 1 or 3, 3) of faces or of their corners."""

    points: np.ndarray
    faces: np.ndarray
    normals: np.ndarray


def surfaces(asset) -> list[Surface]:
    stage, read = opened(asset), []
    for mesh in (UsdGeom.Mesh(prim) for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh)):
        faces = np.array(mesh.GetFaceVertexIndicesAttr().Get()).reshape(-1, 3)
        primvar = UsdGeom.PrimvarsAPI(mesh).GetPrimvar("normals")
        normals = np.array(primvar.ComputeFlattened(), dtype=float).reshape(len(faces), -1, 3)
        assert normals.shape[1] == {"uniform": 1, "faceVarying": 3}[primvar.GetInterpolation()]
        read.append(Surface(np.array(mesh.GetPointsAttr().Get(), dtype=float), faces, normals))
    return read


@pytest.mark.cases(20)
@pytest.mark.parametrize("asset", ONE_OF_EACH_SHAPE, ids=lambda asset: asset.shape.name)
def test_meshes_have_unit_normals_on_the_outer_side_of_every_face_and_no_unused_point(asset):
    for surface in surfaces(asset):
        assert set(surface.faces.ravel()) == set(range(len(surface.points)))
        np.testing.assert_allclose(np.linalg.norm(surface.normals, axis=2), 1.0, atol=2e-4)
        corners = surface.points[surface.faces]
        area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        large = np.linalg.norm(area, axis=1) > 1e-7
        # Smooth normals lean by less than a right angle from their faces.
        assert (np.einsum("ij,ikj->ik", area, surface.normals)[large] > 0.0).all()


def test_round_glass_is_smooth_and_boxes_are_faceted():
    flask = max(surfaces(CATALOG.get("RoundBottomFlask")), key=lambda surface: len(surface.points))
    # On the round of the bottom all faces that share a point have the same normal there.
    low, high = flask.points[:, 2].min(), flask.points[:, 2].max()
    for point in np.flatnonzero(flask.points[:, 2] < low + 0.2 * (high - low)):
        shared = flask.normals[flask.faces == point]
        assert np.ptp(shared, axis=0).max() < 1e-3
    prisms = 0
    for asset in ONE_OF_EACH_SHAPE:
        swept = [part for part in build(asset) if part.primitive in ("revolve", "prism", "ellipsoid", "mesh")]
        for part, surface in zip(swept, surfaces(asset), strict=True):
            if part.primitive == "prism" and len(part.profile) <= 4:
                prisms += 1
                assert surface.normals.shape[1] == 1
    assert prisms


def test_an_asset_has_its_name_and_category_as_semantic_labels():
    for asset in ONE_OF_EACH_SHAPE:
        stage = opened(asset)
        for taxonomy, label in (("class", asset.name), ("category", asset.category)):
            labels = UsdSemantics.LabelsAPI(stage.GetDefaultPrim(), taxonomy)
            assert list(labels.GetLabelsAttr().Get()) == [label]


def test_one_file_of_each_shape_has_no_finding_of_nvidias_asset_validator():
    validator = pytest.importorskip("omni.asset_validator")
    engine = validator.ValidationEngine()
    for asset in ONE_OF_EACH_SHAPE:
        issues = engine.validate(str(usd_path(asset, usd_folder()))).issues()
        assert [f"{issue.rule.__name__}: {issue.message}" for issue in issues] == []


def test_references_to_an_asset_compose(tmp_path):
    asset = CATALOG.get("GlassRod")
    (path,) = write_files([asset], tmp_path)
    stage = Usd.Stage.CreateNew(str(tmp_path / "top.usda"))
    stage.DefinePrim("/Top/Rod").GetReferences().AddReference(f"./{path.relative_to(tmp_path)}")
    assert stage.GetPrimAtPath("/Top/Rod/Geometry").IsValid()
    assert stage.GetCompositionErrors() == []
    assert findings(opened(asset)) == ()
