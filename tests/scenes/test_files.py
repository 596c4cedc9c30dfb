"""Written scenes are self-contained: they can be moved, other programs read them, and the bytes are reproducible."""

from __future__ import annotations

import hashlib
import json
import os
import re
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import mujoco
import numpy as np
import pytest
import trimesh

from labgym.assets.shapes import MATERIALS
from labgym.errors import LabgymError, OptionError
from labgym.layouts import Layout, Placement
from labgym.scenes import scene_mesh, to_mjcf, write_glb, write_mjcf, write_usd
from labgym.scenes.mjcf import COLLISION_GROUP

KNOWN_TO_MUJOCO_3_3 = {
    "mujoco": "model",
    "compiler": "angle meshdir texturedir",
    "statistic": "center extent",
    "visual": "",
    "global": "offwidth offheight fovy",
    "quality": "shadowsize offsamples",
    "headlight": "ambient diffuse specular",
    "map": "znear zfar shadowclip",
    "rgba": "haze",
    "default": "class",
    "asset": "",
    "texture": "name type file builtin rgb1 rgb2 mark markrgb width height",
    "material": "name texture texrepeat texuniform emission specular shininess reflectance rgba",
    "mesh": "name file content_type inertia",
    "worldbody": "",
    "body": "name pos quat",
    "inertial": "pos quat mass diaginertia",
    "geom": "name class type size pos quat contype conaffinity group rgba material mesh",
    "light": "name pos dir directional castshadow diffuse specular",
    "camera": "name pos quat fovy",
}
"""Elements and attributes of the MJCF schema that MuJoCo 3.3.0 carries, as far as scenes use them."""


@pytest.fixture(scope="module")
def written(laboratory: Layout, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_mjcf(laboratory, tmp_path_factory.mktemp("written") / "scene")


def digest(folder: Path) -> str:
    total = hashlib.sha256()
    for path in sorted(path for path in folder.rglob("*") if path.is_file()):
        total.update(str(path.relative_to(folder)).encode() + b"\0" + path.read_bytes())
    return total.hexdigest()


def test_a_scene_moved_elsewhere_loads_as_the_model_that_was_written(
    written: Path, laboratory: Layout, tmp_path: Path
) -> None:
    elsewhere = tmp_path / "moved" / "here"
    elsewhere.parent.mkdir()
    moved = write_mjcf(laboratory, tmp_path / "first").parent.rename(elsewhere)
    loaded, compiled = mujoco.MjModel.from_xml_path(str(moved / "scene.xml")), to_mjcf(laboratory).compile()
    assert (loaded.nbody, loaded.ngeom, loaded.nmesh, loaded.nmat, loaded.ncam, loaded.nlight) == (
        compiled.nbody,
        compiled.ngeom,
        compiled.nmesh,
        compiled.nmat,
        compiled.ncam,
        compiled.nlight,
    )
    data, other = mujoco.MjData(loaded), mujoco.MjData(compiled)
    mujoco.mj_forward(loaded, data)
    mujoco.mj_forward(compiled, other)
    solid = compiled.geom_group == COLLISION_GROUP
    assert data.geom_xpos[solid] == pytest.approx(other.geom_xpos[solid], abs=2e-5)
    assert loaded.geom_size[solid] == pytest.approx(compiled.geom_size[solid], abs=2e-5)
    assert loaded.mesh_facenum.sum() == compiled.mesh_facenum.sum()


def test_a_written_scene_names_no_plugin_and_no_path_outside_its_folder(written: Path) -> None:
    text = written.read_text(encoding="utf-8")
    assert "plugin" not in text
    root = ElementTree.fromstring(text)
    compiler = root.find("compiler")
    assert compiler is not None
    assert compiler.get("meshdir") == "meshes"
    files = {element.get("file") for element in root.iter() if element.get("file")}
    assert files == {path.name for folder in ("meshes", "textures") for path in (written.parent / folder).iterdir()}
    assert not any(re.search(r"[/\\:]|\.\.", str(file)) for file in files)


def test_a_written_scene_uses_only_what_mujoco_3_3_reads(written: Path) -> None:
    for element in ElementTree.parse(written).iter():
        assert element.tag in KNOWN_TO_MUJOCO_3_3
        assert set(element.attrib) <= set(KNOWN_TO_MUJOCO_3_3[element.tag].split()), element.tag


def test_a_written_scene_holds_no_rounding_noise(written: Path) -> None:
    assert not re.search(r"e-(09|1\d|2\d)", written.read_text(encoding="utf-8"))


def test_writing_twice_gives_the_same_bytes(laboratory: Layout, written: Path, tmp_path: Path) -> None:
    again = write_mjcf(laboratory, tmp_path / "again")
    assert digest(again.parent) == digest(written.parent)


def test_another_process_with_another_hash_seed_writes_the_same_bytes(
    laboratory: Layout, written: Path, tmp_path: Path
) -> None:
    laboratory.save(tmp_path / "layout.json")
    program = (
        "import sys; from labgym.layouts import Layout; from labgym.scenes import write_mjcf, write_glb;"
        "layout = Layout.load(sys.argv[1]); write_mjcf(layout, sys.argv[2]); write_glb(layout, sys.argv[3])"
    )
    arguments = [sys.executable, "-c", program, tmp_path / "layout.json", tmp_path / "scene", tmp_path / "scene.glb"]
    subprocess.run(arguments, check=True, env={**os.environ, "PYTHONHASHSEED": "12345"}, timeout=600)
    assert digest(tmp_path / "scene") == digest(written.parent)
    assert (tmp_path / "scene.glb").read_bytes() == write_glb(laboratory, tmp_path / "here.glb").read_bytes()


def test_writing_replaces_a_scene_completely(laboratory: Layout, tmp_path: Path) -> None:
    write_mjcf(laboratory, tmp_path / "scene")
    smaller = laboratory.replace(placements=laboratory.placements[:1])
    path = write_mjcf(smaller, tmp_path / "scene")
    assert mujoco.MjModel.from_xml_path(str(path)).nbody == 2
    assert {entry.name for entry in tmp_path.iterdir()} == {"scene"}


def test_a_folder_with_other_content_is_refused_and_unchanged(laboratory: Layout, tmp_path: Path) -> None:
    (tmp_path / "thesis").mkdir()
    (tmp_path / "thesis" / "chapter.txt").write_text("words")
    with pytest.raises(LabgymError, match="not a compiled scene"):
        write_mjcf(laboratory, tmp_path / "thesis")
    (tmp_path / "file").write_text("words")
    with pytest.raises(LabgymError, match="not a compiled scene"):
        write_mjcf(laboratory, tmp_path / "file")
    assert (tmp_path / "thesis" / "chapter.txt").read_text() == "words"


def test_a_scene_that_cannot_be_compiled_leaves_nothing_behind(laboratory: Layout, tmp_path: Path) -> None:
    broken = laboratory.replace(placements=(Placement(id="a", asset="Nothing", position=(1.0, 1.0, 0.0)),))
    with pytest.raises(LabgymError):
        write_mjcf(broken, tmp_path / "scene")
    assert list(tmp_path.iterdir()) == []


def test_glb_holds_the_faces_of_the_scene_with_y_up(laboratory: Layout, tmp_path: Path) -> None:
    expected = scene_mesh(laboratory)
    scene = trimesh.load(write_glb(laboratory, tmp_path / "scene.glb"))
    assert isinstance(scene, trimesh.Scene)
    mesh = scene.to_mesh()
    assert len(mesh.faces) == len(expected.faces)
    low, high = expected.vertices.min(axis=0), expected.vertices.max(axis=0)
    assert mesh.bounds[0] == pytest.approx([low[0], low[2], -high[1]], abs=1e-4)
    assert mesh.bounds[1] == pytest.approx([high[0], high[2], -low[1]], abs=1e-4)
    corners = expected.vertices[expected.faces]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum() / 2.0
    assert mesh.area == pytest.approx(area, rel=1e-4)


def linear(channel: float) -> float:
    """sRGB to linear light by the formula of IEC 61966-2-1, written out anew."""
    return channel / 12.92 if channel <= 0.04045 else ((channel + 0.055) / 1.055) ** 2.4


def document(path: Path) -> dict:
    """JSON chunk of a binary glTF file."""
    content = path.read_bytes()
    return json.loads(content[20 : 20 + int.from_bytes(content[12:16], "little")])


def test_glb_colors_are_linear_and_those_of_the_usd_stage(laboratory: Layout, tmp_path: Path) -> None:
    materials = document(write_glb(laboratory, tmp_path / "scene.glb"))["materials"]
    # Worked out by hand from sRGB 0.62, 0.75, 0.78.
    assert [linear(channel) for channel in (0.62, 0.75, 0.78)] == pytest.approx([0.342, 0.522, 0.571], abs=1e-3)
    plain = [entry for entry in materials if "baseColorTexture" not in entry["pbrMetallicRoughness"]]
    assert 5 < len(plain) < len(materials)
    for entry in plain:
        look = MATERIALS[entry["name"]]
        expected = [*(linear(channel) for channel in look.rgba[:3]), look.rgba[3]]
        assert entry["pbrMetallicRoughness"]["baseColorFactor"] == pytest.approx(expected, abs=1e-5)
    pytest.importorskip("pxr")
    from pxr import Usd, UsdShade

    stage = Usd.Stage.Open(str(write_usd(laboratory, tmp_path / "usd")))
    shader = UsdShade.Shader(stage.GetPrimAtPath("/Laboratory/Room/Looks/door_leaf/Surface"))
    leaf = next(entry for entry in plain if entry["name"] == "door_leaf")
    assert list(shader.GetInput("diffuseColor").Get()) == pytest.approx(
        leaf["pbrMetallicRoughness"]["baseColorFactor"][:3], abs=1e-4
    )


def test_glb_normals_are_unit_vectors_on_the_outer_side_of_their_faces(laboratory: Layout, tmp_path: Path) -> None:
    scene = trimesh.load(write_glb(laboratory, tmp_path / "scene.glb"))
    assert isinstance(scene, trimesh.Scene)
    for mesh in scene.geometry.values():
        assert "vertex_normals" in mesh._cache.cache
        assert np.linalg.norm(mesh.vertex_normals, axis=1) == pytest.approx(1.0, abs=1e-3)
        facing = np.einsum("ij,ikj->ik", mesh.face_normals, mesh.vertex_normals[mesh.faces])
        assert (facing[mesh.area_faces > 1e-9] > 0.0).all()


def test_a_glb_path_without_its_suffix_is_refused_and_nothing_is_written(laboratory: Layout, tmp_path: Path) -> None:
    with pytest.raises(OptionError, match=r"'scene' must end in \.glb"):
        write_glb(laboratory, tmp_path / "scene")
    assert list(tmp_path.iterdir()) == []
