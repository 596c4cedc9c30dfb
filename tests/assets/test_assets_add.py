"""What `labgym assets add` and `add-reagent` take from foreign files: names, units, axes, bodies, and their limits."""

from __future__ import annotations

import io
import json
import zipfile
from contextlib import suppress

import numpy as np
import pytest
import trimesh
from every_case import for_each

from labgym.assets import Catalog
from labgym.assets.archive import Geometry, MeshPiece, pack, unpack
from labgym.assets.checks import check
from labgym.assets.forge import Options, OwnAssets, annotate
from labgym.assets.meshes import MeshError, read_mesh
from labgym.assets.meshes import physical as physical_phase
from labgym.cli import main
from labgym.errors import DocumentError, OptionError


def box(path, millimetres):
    body = trimesh.creation.box(extents=millimetres)
    body.export(path)
    return path


def bowl():
    """A thick half shell: far from convex."""
    section = 0.05 * np.array([(0, 0), (1, 0), (1, 1), (0.9, 1), (0.9, 0.1), (0, 0.1)])
    return trimesh.creation.revolve(section, sections=24)


@pytest.fixture
def own(tmp_path, monkeypatch):
    monkeypatch.delenv("LABGYM_CATALOG", raising=False)
    return OwnAssets(tmp_path / "own")


@pytest.mark.parametrize(
    ("stem", "millimetres", "resembles"),
    [
        ("tube_tower_24", (120, 80, 200), None),
        ("tube_tipper", (120, 80, 90), None),
        ("device_controller", (150, 150, 80), None),
        ("vial_holder", (120, 80, 40), None),
        ("stirrer_controller_holder", (100, 80, 90), None),
        ("cell_dish_100_vis", (100, 100, 20), "PetriDish"),
        ("1002_tray", (300, 200, 40), None),
        ("HorizontalGelTank", (250, 150, 90), None),
        ("blueP1000micropipette", (40, 30, 230), "Micropipette"),
        ("centrifuge_50ml", (30, 30, 115), "CentrifugeTube"),
        ("magnetic_stirrer_body", (150, 200, 90), "MagneticStirrer"),
        ("glass_beaker_blue", (70, 70, 95), "Beaker"),
        ("my_petri_dish", (100, 100, 18), "PetriDish"),
    ],
)
def test_a_mesh_is_what_the_last_words_of_its_name_say_or_entered_by_size(tmp_path, stem, millimetres, resembles):
    result = annotate(box(tmp_path / f"{stem}.stl", millimetres))
    assert result.annotation.resembles == resembles
    assert resembles is not None or any("by size alone; give --like" in note for note in result.annotation.notes)


def test_the_unit_that_is_suggested_fits_the_volume_in_the_name(tmp_path):
    path = box(tmp_path / "centrifuge_50ml.obj", (30, 115, 30))
    with pytest.raises(MeshError, match="--unit mm"):
        annotate(path)
    asset = annotate(path, Options(unit="mm")).asset
    assert (asset.size.height, asset.subtype) == (pytest.approx(0.115), "tube")


def test_a_model_without_a_unit_is_refused_with_a_scale_that_makes_it_fit(tmp_path):
    path = box(tmp_path / "centrifuge.glb", (2.1, 2.8, 2.1))
    with pytest.raises(MeshError, match=r"no common unit makes it fit: --scale 0\.22") as refused:
        annotate(path)
    scale = float(str(refused.value).partition("--scale ")[2].split()[0])
    asset = annotate(path, Options(scale=scale)).asset
    assert asset.size.height == pytest.approx(2.8 * scale, rel=1e-5)
    assert annotate(path, Options(scale=scale)).annotation.source.options == {"scale": str(scale)}


@pytest.mark.parametrize("scale", [0.0, -1.0, float("nan"), 1e9])
def test_a_scale_out_of_bounds_is_refused(tmp_path, scale):
    with pytest.raises(OptionError, match="scale"):
        read_mesh(box(tmp_path / "a.glb", (1, 1, 1)), scale=scale)


def test_an_assumed_up_axis_is_noted_and_one_that_is_named_is_not(tmp_path):
    path = box(tmp_path / "petri_dish.obj", (0.1, 0.1, 0.02))
    (note,) = annotate(path).annotation.notes
    assert "Y is assumed" in note
    assert "with --up Z it is 0.02 m high, closer to PetriDish" in note
    upright = annotate(path, Options(up="Z"))
    assert upright.annotation.notes == ()
    assert upright.asset.size.height == pytest.approx(0.02)
    assert annotate(box(tmp_path / "petri_dish.glb", (0.1, 0.02, 0.1))).annotation.notes == ()


def test_an_unusual_size_is_noted(tmp_path):
    notes = annotate(box(tmp_path / "glass_funnel.glb", (0.47, 0.5, 0.47)), Options(unit="m")).annotation.notes
    assert any("times that of GlassFunnel" in note for note in notes)


@pytest.mark.cases(1)
@pytest.mark.parametrize("count", [1, 2])
def test_the_number_of_convex_bodies_of_an_asset_is_limited(tmp_path, monkeypatch, count):
    pytest.importorskip("coacd")
    assert physical_phase.MAX_BODIES == 32
    monkeypatch.setattr(physical_phase, "MAX_BODIES", 2 * count)
    scene = trimesh.Scene()
    for k in range(count):
        part = bowl()
        part.apply_translation((0.15 * k, 0.0, 0.0))
        scene.add_geometry(part, geom_name=f"bowl{k}")
    scene.export(tmp_path / "bowls.glb")
    physical = annotate(tmp_path / "bowls.glb").annotation.physical
    assert physical.decomposed_by == "coacd"
    assert count < physical.convex_bodies <= 2 * count


@pytest.mark.parametrize(("limit", "value"), [("MEMORY_BYTES", 64 * 1024**2), ("WALL_SECONDS", 0.01)])
def test_a_decomposition_that_exceeds_its_limits_ends_alone_and_hulls_are_used(tmp_path, monkeypatch, limit, value):
    pytest.importorskip("coacd")
    monkeypatch.setattr(physical_phase, limit, value)
    bowl().export(tmp_path / "bowl.glb")
    result = annotate(tmp_path / "bowl.glb")
    assert result.annotation.physical.decomposed_by == "convex hull"
    assert any("each part collides as its hull" in note for note in result.annotation.notes)


def test_one_file_that_breaks_its_reader_does_not_stop_a_batch(tmp_path, own, capsys):
    models = tmp_path / "models"
    models.mkdir()
    triangle = "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0.1\nf 1 2 3\n"
    (models / "a_long_library.obj").write_text(f"mtllib {'m' * 300}.mtl\n{triangle}")
    (models / "b_broken.obj").write_text("f 1 2 3\n")
    box(models / "c_beaker.stl", (70, 70, 95))
    assert main(["assets", "add", str(models), "--catalog", str(own.folder)]) == 1
    captured = capsys.readouterr()
    assert "2 of 3 files are in the catalog" in captured.out
    assert "b_broken.obj" in captured.err
    assert len(own.names()) == 2


def test_numbers_of_a_text_stl_are_read_whole_or_refused(tmp_path):
    facet = "facet normal 0 0 1\nouter loop\n{}endloop\nendfacet\n"
    long_number = "1.000000000000000000000000000000000000e3"
    text = facet.format(f"vertex 0 0 0\nvertex {long_number} 0 0\nvertex 0 5 5\n")
    (tmp_path / "a.stl").write_text(f"solid a\n{text}endsolid a\n")
    assert read_mesh(tmp_path / "a.stl", "m").bounds[1, 0] == 1000.0
    (tmp_path / "b.stl").write_text(f"solid a\n{text.replace(long_number, '1.' + 90 * '0')}endsolid a\n")
    with pytest.raises(MeshError, match="more than 64 characters"):
        read_mesh(tmp_path / "b.stl")


@for_each("seed", range(200))
def test_geometry_with_changed_bytes_is_read_or_refused(seed):
    random = np.random.default_rng(seed)
    body = trimesh.creation.box()
    points, faces = np.asarray(body.vertices, float), np.asarray(body.faces, np.int64)
    content = bytearray(pack(Geometry((MeshPiece(points, faces, "glass"),), ((points, faces),))))
    for place in random.integers(0, len(content), 4):
        content[place] = random.integers(0, 256)
    with suppress(DocumentError):
        unpack(bytes(content), "file")


def test_a_compression_that_is_not_supported_is_refused():
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as package:
        package.writestr("materials.npy", b"x")
    content = bytearray(stream.getvalue())
    content[8] = content[content.rfind(b"PK\x01\x02") + 10] = 97  # WavPack
    with pytest.raises(DocumentError, match="not the geometry"):
        unpack(bytes(content), "file")


def test_a_reagent_from_its_structure_is_usable_by_every_command(tmp_path, own, monkeypatch, capsys):
    pytest.importorskip("rdkit")
    command = ["assets", "add-reagent", "2-methylanisole", "--smiles", "Cc1ccccc1OC", "--density", "0.985"]
    assert main([*command, "--synonyms", "o-methylanisole", "--catalog", str(own.folder)]) == 0
    captured = capsys.readouterr()
    assert captured.out.startswith("added Reagent2Methylanisole")
    assert "export LABGYM_CATALOG=" in captured.err
    assert main([*command, "--synonyms", "o-methylanisole", "--catalog", str(own.folder)]) == 0
    assert "unchanged" in capsys.readouterr().out
    catalog = Catalog.load(own.folder)
    asset = catalog.find("o-methylanisole")
    assert asset.chemistry.notes.startswith("inferred from structure")
    assert (asset.chemistry.density, asset.chemistry.confidence) == (0.985, "low")
    assert asset.hazards.flammable
    assert check(catalog) == ()
    monkeypatch.setenv("LABGYM_CATALOG", str(own.folder))
    assert main(["assets", "2-methylanisole"]) == 0
    protocol = json.loads(protocol_with("Anisole", "Reagent2Methylanisole"))
    (tmp_path / "mine.json").write_text(json.dumps(protocol))
    assert main(["generate", str(tmp_path / "mine.json"), "--out", str(tmp_path / "mine.layout.json")]) == 0
    placed = json.loads((tmp_path / "mine.layout.json").read_text())["placements"]
    assert any(placement["asset"] == "Reagent2Methylanisole" for placement in placed)


def protocol_with(published: str, own_name: str) -> str:
    """Return a published protocol with one reagent replaced."""
    from labgym.protocols import protocols

    for protocol in protocols().values():
        text = json.dumps({**protocol.to_json(), "id": "mine"})
        if f'"{published}"' in text:
            return text.replace(f'"{published}"', f'"{own_name}"')
    raise AssertionError(f"no published protocol uses {published}")


def test_a_reagent_with_a_published_name_or_without_a_structure_is_refused(tmp_path, own, capsys):
    pytest.importorskip("rdkit")
    folder = ["--catalog", str(own.folder)]
    assert main(["assets", "add-reagent", "acetone", "--smiles", "CC(=O)C", *folder]) == 2
    assert "is a name of the published asset Acetone" in capsys.readouterr().err
    assert main(["assets", "add-reagent", "nonsense", "--smiles", "C1CC", *folder]) == 2
    assert main(["assets", "add-reagent", "x", "--smiles", "CCO", "--density", "100", *folder]) == 2
    assert "expected 0.0001 to 25 g/mL" in capsys.readouterr().err
    assert own.names() == ()


def test_the_help_of_add_shows_no_internals_of_its_parser(capsys):
    with pytest.raises(SystemExit):
        main(["assets", "add", "--help"])
    printed = capsys.readouterr().out
    assert "{None}" not in printed
    assert "(default: )" not in printed
    assert "(default: None)" not in printed
    assert "[[" not in printed
