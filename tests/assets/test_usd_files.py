"""The catalogue as OpenUSD: clean under OpenUSD's validators, current, and the same geometry when read again."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("pxr")
from pxr import Sdf, Usd, UsdGeom, UsdPhysics, UsdShade

from labgym.assets import Catalog
from labgym.assets.meshes import normalise, read_mesh
from labgym.assets.meshes.reading import from_raw
from labgym.assets.meshes.stage import read_stage
from labgym.assets.shapes import MATERIALS, build, tessellate
from labgym.assets.usd import (
    ATTRIBUTES,
    asset_text,
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
    layer = Sdf.Layer.CreateAnonymous(".usda")
    layer.ImportFromString(asset_text(asset))
    return Usd.Stage.Open(layer)


def test_the_committed_files_are_what_the_catalogue_gives_and_clean_under_all_validators():
    problems = [line for _, lines in check_files(CATALOG, usd_folder()) for line in lines]
    assert problems == []
    assert stray_files(CATALOG, usd_folder()) == ()


@pytest.mark.parametrize("asset", ONE_OF_EACH_SHAPE, ids=lambda asset: asset.shape.name)
def test_reading_an_exported_asset_gives_its_geometry_within_a_tenth_of_a_millimetre(asset, tmp_path):
    path = tmp_path / f"{asset.name}.usda"
    path.write_text(asset_text(asset))
    mesh = normalise(from_raw(path, read_stage(path)), decompose=False)
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
    size = normalise(mesh, decompose=False).size
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
    page = (Path(__file__).parents[2] / "docs" / "assets.md").read_text(encoding="utf-8")
    names = [attribute.full_name.removeprefix("labgym:specs:") for attribute in ATTRIBUTES]
    missing = [name for name in names if f"`{name}`" not in page]
    assert missing == []


@pytest.mark.parametrize("damage, said", [
    ('upAxis = "Z"', "upAxis"),
    ('prepend apiSchemas = ["MaterialBindingAPI"]', "MaterialBindingAPI"),
    ('defaultPrim = "GlassRod"', "defaultPrim"),
])  # fmt: skip
def test_the_validators_see_damage_and_the_check_names_the_file(tmp_path, damage, said):
    asset = CATALOG.get("GlassRod")
    (path,) = write_files([asset], tmp_path)
    assert list(check_files([asset], tmp_path)) == [(asset, ())]
    path.write_text(path.read_text().replace(damage, ""))
    ((_, problems),) = check_files([asset], tmp_path)
    assert any("not what the catalogue gives" in problem for problem in problems)
    assert any(said in problem for problem in problems[1:])
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
    (tmp_path / "instrument" / "Other.usda").write_text("#usda 1.0\n")
    assert [stray.name for stray in stray_files([asset], tmp_path)] == ["Other.usda"]
    assert usd_path(asset, tmp_path).parent.name == asset.kind


def test_the_same_asset_gives_the_same_text():
    for asset in list(ONE_OF_EACH_SHAPE)[:5]:
        assert asset_text(asset) == asset_text(asset)


def test_references_to_an_asset_compose(tmp_path):
    asset = CATALOG.get("GlassRod")
    (path,) = write_files([asset], tmp_path)
    stage = Usd.Stage.CreateNew(str(tmp_path / "top.usda"))
    stage.DefinePrim("/Top/Rod").GetReferences().AddReference(f"./{path.relative_to(tmp_path)}")
    assert stage.GetPrimAtPath("/Top/Rod/Geometry").IsValid()
    assert stage.GetCompositionErrors() == []
    assert findings(opened(asset)) == ()
