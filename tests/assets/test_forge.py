"""The annotation engine: mesh files that become catalogue entries."""

from __future__ import annotations

import json

import numpy as np
import pytest
import trimesh

from labgym.assets import Catalog
from labgym.assets.archive import geometry
from labgym.assets.checks import check
from labgym.assets.forge import Described, Options, OwnAssets, annotate, mesh_files
from labgym.assets.meshes import MeshError
from labgym.assets.plausibility import faults
from labgym.cli import main
from labgym.errors import DocumentError, LabgymError, UnknownNameError

PUBLISHED = Catalog.published()


def box(path, extents, at=0.0):
    body = trimesh.creation.box(extents=extents)
    body.apply_translation((at, at, at))
    body.export(path)
    return path


def bottle(path):
    """A bottle of 90 x 90 x 210 mm in glTF's axes, with a glass body and a red cap."""
    scene = trimesh.Scene()
    body, cap = trimesh.creation.cylinder(0.045, 0.18), trimesh.creation.cylinder(0.02, 0.03)
    body.apply_translation((0, 0, 0.09))
    cap.apply_translation((0, 0, 0.195))
    for name, part, color in (("clear glass", body, [220, 230, 240, 90]), ("red", cap, [200, 20, 20, 255])):
        material = trimesh.visual.material.PBRMaterial(name=name, baseColorFactor=color)
        part.visual = trimesh.visual.TextureVisuals(material=material)
        part.apply_transform([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])
        scene.add_geometry(part, geom_name=name)
    scene.export(path)
    return path


@pytest.fixture
def own(tmp_path, monkeypatch):
    monkeypatch.delenv("LABGYM_CATALOG", raising=False)
    return OwnAssets(tmp_path / "own")


def snapshot(folder):
    return {path.relative_to(folder): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_a_bottle_named_after_a_substance_is_a_reagent_with_its_chemistry(tmp_path):
    made = annotate(bottle(tmp_path / "acetone_500ml.glb"))
    acetone = PUBLISHED.get("Acetone")
    assert (made.asset.kind, made.asset.category, made.asset.subtype) == ("reagent", "organic_solvent", "ketone")
    assert made.asset.chemistry == acetone.chemistry
    assert made.asset.hazards == acetone.hazards
    assert made.asset.specs.pack_mL == 500.0
    assert made.annotation.resembles == "Acetone"
    assert made.annotation.fields["hazards.flammable"].how == "catalogue"
    size = made.asset.size
    assert (size.width, size.depth, size.height) == pytest.approx((0.09, 0.09, 0.21), abs=1e-5)
    assert made.annotation.fields["size"].confidence == 1.0


@pytest.mark.parametrize(
    "name, extents, like, flags",
    [
        ("RoundBottomFlask_250ml", (0.085, 0.085, 0.14), "RoundBottomFlask", {"glass_container"}),
        ("SM_Beaker_01_final", (0.07, 0.07, 0.095), "Beaker", {"glass_container"}),
        ("烧杯", (0.07, 0.07, 0.095), "Beaker", {"glass_container"}),
        ("rotovap", (0.6, 0.4, 0.7), "RotaryEvaporator", None),
        ("nitric acid 1L", (0.1, 0.1, 0.23), "NitricAcid", {"acid", "oxidizer", "volatile_or_toxic"}),
    ],
)
def test_names_in_either_language_find_the_published_entry(tmp_path, name, extents, like, flags):
    made = annotate(box(tmp_path / f"{name}.stl", np.multiply(extents, 1000.0)))
    published = PUBLISHED.get(like)
    assert made.annotation.resembles == like
    assert (made.asset.kind, made.asset.category, made.asset.placing) == (
        published.kind,
        published.category,
        published.placing,
    )
    if flags is not None:
        assert {flag for flag, value in made.asset.hazards if value} >= flags - {"volatile_or_toxic"}
    assert made.asset.name not in PUBLISHED


@pytest.mark.parametrize("name", ["ice_bucket_steel", "water_bath_large"])
def test_a_substance_within_the_name_of_a_thing_makes_it_no_reagent(tmp_path, name):
    assert annotate(box(tmp_path / f"{name}.stl", (250, 200, 180))).asset.kind == "instrument"


def test_what_nothing_names_is_placed_by_size_and_says_that_it_is_a_guess(tmp_path):
    made = annotate(box(tmp_path / "qzxv_17.stl", (100, 100, 100)))
    assert made.annotation.resembles is None
    assert made.annotation.fields["kind"].how == "default"
    assert made.annotation.fields["kind"].confidence <= 0.3
    assert made.annotation.notes


@pytest.mark.parametrize(
    "stem, name, volume",
    [
        ("acetone_500ml", "Acetone500ml", 500.0),
        ("conc. H2SO4 2.5 L", "SulfuricAcid2p5L", 2500.0),
        ("盐酸_1L", "HydrochloricAcid1L", 1000.0),
        ("ErlenmeyerFlask-250 mL", "ErlenmeyerFlask250ml", 250.0),
        ("toluene-100mL", "Toluene100ml", 100.0),
    ],
)
def test_amounts_in_a_name_are_the_volume(tmp_path, stem, name, volume):
    sides = np.multiply((0.8, 0.8, 1.3), (1000.0 * volume) ** (1 / 3) * 1.3)  # mm: twice the volume
    asset = annotate(box(tmp_path / f"{stem}.stl", sides)).asset
    assert asset.name == name
    assert asset.specs.volume_mL == volume


@pytest.mark.parametrize(
    ("stem", "extents", "shared", "own"),
    [
        ("hotplate", (160, 270, 85), ("heating_C", "rotation_rpm", "power_W"), "stirring_mL"),
        ("analytical balance", (210, 350, 340), ("capacity_g", "resolution_g"), "capacity_mL"),
        ("Beaker_250ml", (70, 70, 95), ("withstands_C", "capacity_mL"), "working_mL"),
        ("drying oven", (570, 580, 700), ("heating_C", "power_W"), "chamber_L"),
    ],
)
def test_a_device_has_the_specifications_of_its_like_but_for_those_of_size(tmp_path, stem, extents, shared, own):
    made = annotate(box(tmp_path / f"{stem}.stl", extents))
    like = PUBLISHED.get(made.annotation.resembles).specs
    assert [getattr(made.asset.specs, name) for name in shared] == [getattr(like, name) for name in shared]
    assert getattr(made.asset.specs, own) is None
    assert made.annotation.fields["specs"].confidence <= 0.9
    assert list(faults(made.asset)) == []


def test_every_field_that_is_set_tells_where_it_comes_from(tmp_path):
    made = annotate(bottle(tmp_path / "acetone.glb"))
    given = {name for name in made.asset.model_fields_set if name not in ("shape", "hazards")}
    assert given <= set(made.annotation.fields)
    assert {f"hazards.{flag}" for flag, _ in made.asset.hazards} <= set(made.annotation.fields)


@pytest.mark.parametrize(
    "suffix, extents, unit, remedy",
    [
        ("obj", (70.0, 95.0, 70.0), None, "looks like millimeters read as meters (format default): --unit mm"),
        ("stl", (0.07, 0.07, 0.095), None, "looks like meters read as millimeters (format default): --unit m"),
        ("stl", (7.0, 7.0, 9.5), None, "looks like centimeters read as millimeters (format default): --unit cm"),
        ("stl", (70.0, 70.0, 95.0), "m", "looks like millimeters read as meters (option): --unit mm"),
    ],
)
def test_a_beaker_of_an_impossible_size_is_refused_with_the_unit_that_was_meant(
    tmp_path, suffix, extents, unit, remedy
):
    path = box(tmp_path / f"beaker.{suffix}", extents)
    with pytest.raises(MeshError) as refused:
        annotate(path, Options(unit=unit))
    assert remedy in str(refused.value)
    meant = remedy.rpartition(" ")[2]
    size = annotate(path, Options(unit=meant)).asset.size
    assert max(size.width, size.depth, size.height) == pytest.approx(0.095, rel=1e-5)


def test_the_user_can_say_what_it_is(tmp_path):
    made = annotate(box(tmp_path / "thing.stl", (70, 70, 95)), Options(like="烧杯", name="MyBeaker"))
    assert (made.asset.name, made.asset.subtype) == ("MyBeaker", "beaker")
    assert made.annotation.fields["category"].confidence == 1.0
    with pytest.raises(UnknownNameError):
        annotate(tmp_path / "thing.stl", Options(like="flux capacitor"))


def test_a_flat_top_carries_things_and_a_pointed_one_does_not(tmp_path):
    flat = annotate(box(tmp_path / "bench.stl", (1500, 750, 900))).asset
    assert [(s.z, s.width, s.depth) for s in flat.surfaces] == [pytest.approx((0.9, 1.5, 0.75))]
    cone = trimesh.creation.cone(radius=700, height=900)
    cone.export(tmp_path / "bench_round.stl")
    assert annotate(tmp_path / "bench_round.stl").asset.surfaces == ()


def test_adding_again_changes_nothing_and_nothing_is_overwritten_unasked(tmp_path, own):
    path = bottle(tmp_path / "acetone_500ml.glb")
    assert own.add(path) == ("Acetone500ml", "added")
    before = snapshot(own.folder)
    assert own.add(path) == ("Acetone500ml", "unchanged")
    other = tmp_path / "other"
    other.mkdir()
    box(other / "acetone_500ml.stl", (90, 90, 200))
    with pytest.raises(MeshError, match="--overwrite"):
        own.add(other / "acetone_500ml.stl")
    assert snapshot(own.folder) == before
    assert own.add(other / "acetone_500ml.stl", replace=True) == ("Acetone500ml", "replaced")
    assert len(list((own.folder / "meshes").iterdir())) == 2
    assert Catalog.load(own.folder).get("Acetone500ml").size.height == pytest.approx(0.2)


def test_equal_files_give_equal_entries_wherever_they_are_added(tmp_path):
    path = bottle(tmp_path / "acetone_500ml.glb")
    stores = [OwnAssets(tmp_path / name) for name in ("a", "b")]
    for store in stores:
        store.add(path)
    assert snapshot(stores[0].folder) == snapshot(stores[1].folder)


def test_the_published_catalogue_stays_and_is_merged_where_the_variable_names_a_folder(tmp_path, own, monkeypatch):
    own.add(bottle(tmp_path / "acetone_500ml.glb"))
    assert "Acetone500ml" not in Catalog.load()
    monkeypatch.setenv("LABGYM_CATALOG", str(own.folder))
    merged = Catalog.load()
    assert len(merged) == len(PUBLISHED) + 1
    assert all(merged.get(asset.name) is asset for asset in PUBLISHED)
    assert (merged.find("acetone").name, merged.find("67-64-1").name) == ("Acetone", "Acetone")
    assert check(merged) == check(PUBLISHED)
    with pytest.raises(MeshError, match="published"):
        own.add(bottle(tmp_path / "acetone.glb"), Options(name="Acetone"), replace=True)


def test_geometry_that_was_changed_or_lies_elsewhere_is_refused_on_loading(tmp_path, own):
    own.add(bottle(tmp_path / "acetone_500ml.glb"))
    entry = own.folder / "assets" / "Acetone500ml.json"
    good = entry.read_text()
    document = json.loads(good)
    document["assets"][0]["shape"]["parameters"]["file"] = "../../secret.npz"
    entry.write_text(json.dumps(document))
    with pytest.raises(DocumentError, match="not a file name in the folder meshes"):
        Catalog.load(own.folder)
    entry.write_text(good)
    archive = own.folder / json.loads(good)["assets"][0]["shape"]["parameters"]["file"]
    archive.write_bytes(archive.read_bytes()[:-1] + b"?")
    with pytest.raises(DocumentError, match="its contents changed since"):
        Catalog.load(own.folder)
    archive.unlink()
    with pytest.raises(DocumentError, match="missing"):
        Catalog.load(own.folder)


def test_a_folder_that_does_not_exist_is_an_error_rather_than_nothing(tmp_path):
    with pytest.raises(DocumentError, match="no such folder"):
        Catalog.load(tmp_path / "nowhere")


@pytest.mark.parametrize("content", [b"", b"solid empty\nendsolid\n", b"\0" * 200])
def test_bad_files_leave_the_folder_as_it_was(tmp_path, own, content):
    own.add(bottle(tmp_path / "acetone_500ml.glb"))
    before = snapshot(own.folder)
    (tmp_path / "beaker.stl").write_bytes(content)
    with pytest.raises(LabgymError):
        own.add(tmp_path / "beaker.stl")
    assert snapshot(own.folder) == before


def test_a_folder_adds_what_it_can_and_tells_what_failed(tmp_path, own, capsys):
    models = tmp_path / "models"
    (models / "deep").mkdir(parents=True)
    bottle(models / "acetone_500ml.glb")
    box(models / "deep" / "beaker.stl", (70, 70, 95))
    (models / "broken.stl").write_bytes(b"nothing")
    (models / "readme.txt").write_text("no mesh")
    assert main(["assets", "add", str(models), "--catalog", str(own.folder)]) == 1
    said = capsys.readouterr()
    assert "2 of 3 files are in the catalog" in said.out
    assert "broken.stl" in said.err
    assert own.names() == ("Acetone500ml", "BeakerMesh")
    assert main(["assets", "add", str(models / "broken.stl"), "--catalog", str(own.folder)]) == 2
    assert main(["assets", "add", str(models / "acetone_500ml.glb"), "--catalog", str(own.folder)]) == 0


def test_meshes_of_the_folder_that_is_added_to_are_no_input(tmp_path, own):
    own.add(bottle(tmp_path / "acetone_500ml.glb"))
    assert [path.name for path in mesh_files([tmp_path], own.folder)] == ["acetone_500ml.glb"]


SAID = {
    "name": "WideBeaker",
    "kind": "instrument",
    "category": "glassware",
    "subtype": "beaker",
    "synonyms_en": ["wide beaker", "beaker"],
    "synonyms_zh": ["宽口烧杯"],
    "description": "A wide vessel for mixing.",
    "caption": "A clear cylinder with a spout.",
    "hazards": {},
    "semantic": 0.9,
    "domain": 0.75,
}


def test_what_a_model_says_is_taken_with_its_confidence(tmp_path):
    asked = []

    def annotator(measured, draft, pictures):
        asked.append((measured, draft, pictures))
        return Described.model_validate(SAID)

    path = box(tmp_path / "xyzzy.stl", (70, 70, 95))
    made = annotate(path, annotator=annotator, views=lambda asset: [asset.name.encode()])
    measured, draft, pictures = asked[0]
    assert measured["size_m"] == {"width": 0.07, "depth": 0.07, "height": 0.095}
    assert draft["kind"] == "instrument"
    assert pictures == [b"Xyzzy"]
    assert (made.asset.name, made.asset.category) == ("WideBeaker", "glassware")
    assert made.asset.hazards.glass_container
    assert "beaker" not in made.asset.synonyms_en
    assert "宽口烧杯" in made.asset.synonyms_zh
    assert made.annotation.fields["category"].model_dump() == {"how": "model", "confidence": 0.9, "why": ""}


def test_a_model_cannot_talk_the_hazards_out_of_a_reagent_or_choose_a_path(tmp_path):
    path = bottle(tmp_path / "acetone_500ml.glb")
    made = annotate(path, annotator=lambda *_: Described.model_validate(SAID))
    assert made.asset.kind == "reagent"
    assert made.asset.hazards == PUBLISHED.get("Acetone").hazards
    with pytest.raises(ValueError):
        Described.model_validate({**SAID, "name": "../../etc/passwd"})


def test_the_geometry_of_an_entry_is_the_files(tmp_path, own):
    own.add(bottle(tmp_path / "acetone_500ml.glb"))
    asset = Catalog.load(own.folder).get("Acetone500ml")
    pieces = geometry(asset).pieces
    low = np.min([piece.vertices.min(axis=0) for piece in pieces], axis=0)
    high = np.max([piece.vertices.max(axis=0) for piece in pieces], axis=0)
    np.testing.assert_allclose([low, high], [[-0.045, -0.045, 0.0], [0.045, 0.045, 0.21]], atol=1e-6)
    tall = {piece.material: np.ptp(piece.vertices[:, 2]) for piece in pieces}
    assert tall["borosilicate"] == pytest.approx(0.18, abs=1e-6)
    assert sorted(tall.values()) == pytest.approx([0.03, 0.18], abs=1e-6)


def test_an_exported_asset_that_comes_back_is_known_by_its_attribute(tmp_path):
    pytest.importorskip("pxr")
    from labgym.assets.usd import asset_layer

    asset_layer(PUBLISHED.get("ErlenmeyerFlask")).Export(str(tmp_path / "thing_7.usda"))
    made = annotate(tmp_path / "thing_7.usda")
    assert made.annotation.resembles == "ErlenmeyerFlask"
    assert "labgym:name" in made.annotation.fields["kind"].why
    assert made.asset.size.height == pytest.approx(PUBLISHED.get("ErlenmeyerFlask").size.height, abs=1e-4)


def test_usd_of_ones_own_assets_goes_nowhere_unnamed(tmp_path, own, monkeypatch):
    pytest.importorskip("pxr")
    own.add(bottle(tmp_path / "acetone_500ml.glb"))
    monkeypatch.setenv("LABGYM_CATALOG", str(own.folder))
    assert main(["assets", "build", "Acetone500ml"]) == 2
    assert main(["assets", "build", "Acetone500ml", "--out", str(tmp_path / "usd")]) == 0
    assert (tmp_path / "usd" / "reagent" / "Acetone500ml.usdc").is_file()
