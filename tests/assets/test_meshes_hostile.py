"""Mesh files that are broken or mean harm: one clear error each, that names the file and the remedy."""

from __future__ import annotations

import json
import os
import struct
import tracemalloc
import zipfile
from dataclasses import replace

import numpy as np
import pytest
import trimesh

from labgym.assets.meshes import LIMITS, MeshError, polygons, read_mesh, unitless
from labgym.assets.meshes.stage import memory_for
from labgym.errors import UnknownNameError

TRIANGLE = """def Mesh "Body" {
 int[] faceVertexCounts = [3]
 int[] faceVertexIndices = [0, 1, 2]
 point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
}
"""
HEAD = '#usda 1.0\n(\n defaultPrim = "Thing"\n metersPerUnit = 1\n upAxis = "Z"\n)\n'


def stage(path, body, extra=""):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f'{HEAD}def Xform "Thing" ({extra}) {{\n{body}\n}}\n')
    return path


def refused(path, *words, limits=LIMITS, **options) -> str:
    """Check that a file is refused in one line that has its name and the words."""
    with pytest.raises(MeshError) as caught:
        read_mesh(path, limits=limits, **options)
    message = str(caught.value)
    assert path.name in message
    assert "\n" not in message
    assert len(message) < 700
    for word in words:
        assert word in message, message
    return message


# every format


@pytest.mark.cases(5)
@pytest.mark.parametrize("suffix", [".stl", ".obj", ".glb", ".usd", ".usda", ".usdc", ".usdz"])
@pytest.mark.parametrize("content", [b"", b"\0" * 200, b"\xff\xfe junk" * 50], ids=["empty", "zeros", "junk"])
def test_junk_is_refused_in_every_format(tmp_path, suffix, content, capfd):
    path = tmp_path / f"junk{suffix}"
    path.write_bytes(content)
    refused(path)
    assert capfd.readouterr() == ("", "")


def test_missing_files_folders_other_formats_and_units_are_refused(tmp_path):
    refused(tmp_path / "none.glb", "no such file")
    (tmp_path / "folder.glb").mkdir()
    refused(tmp_path / "folder.glb", "not a regular file")
    (tmp_path / "a.fbx").write_text("x")
    refused(tmp_path / "a.fbx", ".fbx", ".glb")
    with pytest.raises(UnknownNameError, match="parsec"):
        read_mesh(tmp_path / "a.stl", unit="parsec")


def test_a_file_of_more_bytes_than_allowed_is_not_read(tmp_path):
    path = tmp_path / "large.stl"
    with path.open("wb") as stream:
        stream.truncate(LIMITS.bytes + 1)
    refused(path, "bytes", "simplify")


@pytest.mark.parametrize("suffix", [".stl", ".obj", ".glb", ".usda"])
@pytest.mark.parametrize("limit", ["faces", "vertices"])
def test_more_faces_or_vertices_than_allowed_are_refused(tmp_path, suffix, limit):
    path = tmp_path / f"ball{suffix}"
    ball = trimesh.creation.icosphere(subdivisions=2)
    if suffix == ".usda":
        corners, points = ball.faces.ravel().tolist(), ", ".join(map(str, map(tuple, ball.vertices.tolist())))
        counts = [3] * len(ball.faces)
        topology = f"int[] faceVertexCounts = {counts}\n int[] faceVertexIndices = {corners}"
        stage(path, f'def Mesh "B" {{\n {topology}\n point3f[] points = [{points}]\n}}')
    else:
        ball.export(path)
    if suffix == ".stl" and limit == "vertices":
        return  # no more vertices than three a face
    refused(path, "simplify", limits=replace(LIMITS, **{limit: 50}))


# text formats


@pytest.mark.parametrize(
    "text, words",
    [
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", ("line 4", "corner 4")),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 0\n", ("line 4", "corner 0")),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 -4\n", ("line 4", "corner -4")),
        ("v 0 0\nf 1 1 1\n", ("line 1",)),
        ("v a b c\n", ("line 1",)),
        ("v 0 0 0\nv 1 0 0\nv 0 nan 0\nf 1 2 3\n", ("not a number",)),
        ("v 0 0 0\nv 1 0 0\nv 0 1e999 0\nf 1 2 3\n", ("not a number or infinite",)),
        ("v 0 0 0\nv 1 0 0\nv 0 1e30 0\nf 1 2 3\n", ("check the unit",)),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\n", ("no faces",)),
        ("v 0 0 0\nv 1 0 0\nf 1 2\n", ("no faces",)),
    ],
)
def test_broken_obj_files_are_refused_with_the_line(tmp_path, text, words):
    path = tmp_path / "bad.obj"
    path.write_text(text)
    refused(path, *words)


def test_an_obj_of_too_many_objects_is_refused(tmp_path):
    path = tmp_path / "many.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\n" + "".join(f"o part{k}\nf 1 2 3\n" for k in range(51)))
    assert len(read_mesh(path, limits=replace(LIMITS, parts=51)).parts) == 51
    refused(path, "50 parts", limits=replace(LIMITS, parts=50))


def polygon(points) -> str:
    return "".join(f"v {x} {y} 0\n" for x, y in points) + "f " + " ".join(map(str, range(-len(points), 0))) + "\n"


def test_polygons_of_too_many_corners_that_are_not_convex_are_refused(tmp_path, monkeypatch):
    path, comb = tmp_path / "comb.obj", [(k, 5 * (k % 2)) for k in range(510)] + [(510, -1), (-1, -1)]
    path.write_text(polygon(comb))
    (part,) = read_mesh(path).parts
    assert len(part.faces) == len(comb) - 2
    assert trimesh.Trimesh(part.vertices, part.faces).area == pytest.approx(0.5 + 509 * 3.5 + 3.0)  # over y = -1
    path.write_text(polygon([*comb, (-1, -0.5)]))
    refused(path, "513 corners, expected at most 512", "triangulate the mesh")
    path.write_text(polygon([(np.cos(k), np.sin(k)) for k in np.linspace(0.0, 6.28, 600)]))
    assert len(read_mesh(path).parts[0].faces) == 598
    # Limits of one polygon, or of one object, would let many of them take hours.
    monkeypatch.setattr("labgym.assets.meshes.polygons.MAX_ALL_CONCAVE_CORNERS", 19)
    arrow = polygon([(0, 0), (2, 0), (1, 1), (2, 2), (0, 2)])
    path.write_text("".join(f"o part{k}\n{arrow}" for k in range(3)))
    assert len(read_mesh(path).parts) == 3
    path.write_text("".join(f"o part{k}\n{arrow}" for k in range(4)))
    refused(path, "20 corners, expected at most 19", "triangulate the mesh")


def test_corners_are_cut_off_in_an_order_that_looks_at_each_a_few_times(monkeypatch):
    """A spiral of 512 corners has few ears; a polygon of random corners crosses itself and may have none."""
    looks = []
    inside = polygons._inside
    monkeypatch.setattr(polygons, "_inside", lambda *arguments: looks.append(1) or inside(*arguments))
    turn, rng = np.arange(256), np.random.default_rng(0)
    outer = np.stack([np.cos(0.2 * turn), np.sin(0.2 * turn)], axis=1) * (1.0 + 0.05 * turn)[:, None]
    inner = (outer * (1.3 + 0.05 * turn)[:, None] / (1.0 + 0.05 * turn)[:, None])[::-1]
    for ring in (np.concatenate([outer, inner]), rng.normal(size=(512, 2))):
        points = np.column_stack([ring, np.zeros(512)])
        looks.clear()
        faces, _ = polygons.triangulate(points, np.array([512]), np.arange(512))
        assert len(faces) == 510
        assert len(looks) <= 3 * 512
        x, y = ring.T
        corners = points[faces]
        areas = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2] / 2.0
        assert areas.sum() == pytest.approx(0.5 * (x @ np.roll(y, -1) - y @ np.roll(x, -1)))


def test_a_material_library_is_read_once_and_a_face_counts_at_least_once(tmp_path, monkeypatch):
    path = tmp_path / "many.obj"
    (tmp_path / "red.mtl").write_text("newmtl red\nKd 1 0 0\n")
    read = []
    colors = unitless._colors
    monkeypatch.setattr(unitless, "_colors", lambda *arguments: read.append(1) or colors(*arguments))
    corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\n"
    path.write_text("mtllib red.mtl\n" * 500 + corners + "f 1 2 3\n")
    assert read_mesh(path).parts[0].color == (1.0, 0.0, 0.0, 1.0)
    assert len(read) == 1
    path.write_text(corners + "f 1\n" * 100)
    refused(path, "50 faces", limits=replace(LIMITS, faces=50))


def test_an_obj_of_many_short_lines_takes_a_few_times_its_size(tmp_path):
    path = tmp_path / "short.obj"
    path.write_text("#a\n" * 200_000 + "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    tracemalloc.start()
    read_mesh(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 6 * path.stat().st_size


def test_colors_that_are_no_numbers_count_as_zero(tmp_path):
    (tmp_path / "a.mtl").write_text("newmtl odd\nKd nan inf x\nd 0.5\n")
    path = tmp_path / "a.obj"
    path.write_text("mtllib a.mtl\nusemtl odd\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    assert read_mesh(path).parts[0].color == (0.0, 1.0, 0.0, 0.5)


@pytest.mark.parametrize("library", ["../secret.mtl", "/etc/passwd", "{outside}", "link.mtl"])
def test_material_libraries_outside_the_folder_are_not_opened(tmp_path, library):
    secret = tmp_path / "secret.mtl"
    secret.write_text("newmtl steel\nKd 1 0 0\n")
    folder = tmp_path / "model"
    folder.mkdir()
    (folder / "link.mtl").symlink_to(secret)
    path = folder / "a.obj"
    named = library.replace("{outside}", str(secret))
    path.write_text(f"mtllib {named}\nusemtl steel\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    assert read_mesh(path).parts[0].color is None


@pytest.mark.parametrize("content", [
    b"x" * 80 + struct.pack("<I", 1000) + b"\0" * 50,
    b"x" * 80 + struct.pack("<I", 0),
    b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nendloop\nendfacet\nendsolid\n",
    b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 x\nvertex 1 1 0\nendloop\nendfacet\n",
    b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 nan\nvertex 1 1 0\nendloop\nendfacet\n",
], ids=["cut", "no-faces", "two-corners", "no-number", "nan"])  # fmt: skip
def test_broken_stl_files_are_refused(tmp_path, content):
    path = tmp_path / "bad.stl"
    path.write_bytes(content)
    refused(path)


# glTF


def glb(path, binary=None, **changes):
    points = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0)], dtype="<f4").tobytes() if binary is None else binary
    header = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
        "bufferViews": [{"buffer": 0, "byteLength": len(points)}],
        "buffers": [{"byteLength": len(points)}],
    }
    text = json.dumps(header | changes).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(points), 0x004E4942) + points
    path.write_bytes(b"glTF" + struct.pack("<II", 2, 12 + len(chunks)) + chunks)
    return path


def test_the_glb_that_the_next_tests_break_is_sound(tmp_path):
    assert len(read_mesh(glb(tmp_path / "a.glb")).parts[0].faces) == 1


ACCESSOR = {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}


@pytest.mark.parametrize("changes, words", [
    ({"nodes": [{"mesh": 0, "children": [0]}]}, ("node 0",)),
    ({"nodes": [{"children": [1]}, {"children": [0]}]}, ("node 0",)),
    ({"nodes": [{"children": [7]}]}, ("node 7",)),
    ({"nodes": [{"children": [k + 1]} for k in range(200)] + [{"mesh": 0}]}, ("deep",)),
    ({"nodes": [{"mesh": 3}]}, ("contradicts itself",)),
    ({"nodes": [{"mesh": 0, "matrix": [1, 2]}]}, ("contradicts itself",)),
    ({"nodes": []}, ("missing",)),
    ({"scenes": [{"nodes": []}]}, ("no faces",)),
    ({"accessors": [ACCESSOR | {"count": 4}]}, ("reaches outside",)),
    ({"accessors": [ACCESSOR | {"count": 10**9}]}, ("simplify",)),
    ({"accessors": [ACCESSOR | {"byteOffset": -12}]}, ("reaches outside",)),
    ({"accessors": [ACCESSOR | {"componentType": 1}]}, ("contradicts itself",)),
    ({"accessors": [{"componentType": 5126, "count": 3, "type": "VEC3"}]}, ("sparse",)),
    ({"bufferViews": [{"buffer": 0, "byteStride": 0}]}, ("reaches outside",)),
    ({"buffers": [{"uri": "/etc/passwd"}]}, ("outside",)),
    ({"buffers": [{"uri": "http://example.org/a.bin"}]}, ("outside",)),
    ({"extensionsRequired": ["KHR_draco_mesh_compression"]}, ("KHR_draco", "without compression")),
    ({"meshes": "x"}, ("contradicts itself",)),
    ({"meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "mode": 0}]}]}, ("no faces",)),
])  # fmt: skip
def test_broken_glb_files_are_refused(tmp_path, changes, words):
    refused(glb(tmp_path / "bad.glb", **changes), *words)


def test_a_glb_with_numbers_that_are_none_or_an_index_out_of_range_is_refused(tmp_path):
    nan = np.array([(0, 0, 0), (1, 0, 0), (0, np.nan, 0)], dtype="<f4").tobytes()
    refused(glb(tmp_path / "nan.glb", nan), "not a number")
    points = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0)], dtype="<f4").tobytes()
    path = glb(
        tmp_path / "index.glb",
        points + np.array([0, 1, 9], dtype="<u4").tobytes(),
        accessors=[ACCESSOR, {"bufferView": 0, "byteOffset": 36, "componentType": 5125, "count": 3, "type": "SCALAR"}],
        meshes=[{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
    )
    refused(path, "vertex 9")


def test_a_glb_that_shows_one_mesh_in_too_many_nodes_is_refused(tmp_path):
    nodes = [{"mesh": 0}] * (LIMITS.parts + 1)
    path = glb(tmp_path / "many.glb", nodes=nodes, scenes=[{"nodes": list(range(len(nodes)))}])
    refused(path, "parts")


def test_a_glb_that_shows_points_and_lines_a_million_times_is_refused(tmp_path):
    """Neither counts as a part of the mesh, but looking at each takes time."""
    nodes, points = [{"mesh": 0}] * 1000, {"attributes": {"POSITION": 0}, "mode": 0}
    scenes = [{"nodes": list(range(len(nodes)))}]
    path = glb(tmp_path / "points.glb", nodes=nodes, scenes=scenes, meshes=[{"primitives": [points] * 1000}])
    refused(path, "parts")


# USD


def test_missing_references_are_refused_by_name(tmp_path):
    body = 'def "Leg" (references = @./gone.usda@) {\n}'
    refused(stage(tmp_path / "a.usda", body), "gone.usda", "missing")
    refused(stage(tmp_path / "b.usda", TRIANGLE, "payload = @gone.usdc@</X>"), "gone.usdc", "missing")
    (tmp_path / "c.usda").write_text("#usda 1.0\n(\n subLayers = [@./gone.usda@]\n)\n")
    refused(tmp_path / "c.usda", "gone.usda", "missing")


def test_a_reference_to_a_prim_that_is_not_there_is_refused(tmp_path):
    stage(tmp_path / "leg.usda", TRIANGLE)
    refused(stage(tmp_path / "a.usda", 'def "Leg" (references = @./leg.usda@</Nothing>) {\n}'), "Nothing")


def test_cycles_are_refused(tmp_path, capfd):
    stage(tmp_path / "a.usda", TRIANGLE, "references = @./b.usda@")
    stage(tmp_path / "b.usda", "", "references = @./a.usda@")
    refused(tmp_path / "a.usda", "ycle")
    refused(stage(tmp_path / "self.usda", TRIANGLE, "references = </Thing/Body>"), "self.usda")
    (tmp_path / "s.usda").write_text("#usda 1.0\n(\n subLayers = [@./s.usda@]\n)\n")
    refused(tmp_path / "s.usda")
    assert capfd.readouterr() == ("", "")


@pytest.mark.cases(2)
@pytest.mark.parametrize("reference", ["../secret.usda", "{outside}", "link.usda", "sub/../../secret.usda"])
def test_references_that_leave_the_folder_are_refused(tmp_path, reference):
    secret = stage(tmp_path / "secret.usda", TRIANGLE)
    folder = tmp_path / "model"
    (folder / "sub").mkdir(parents=True)
    (folder / "link.usda").symlink_to(secret)
    named = reference.replace("{outside}", str(secret))
    refused(stage(folder / "a.usda", f'def "X" (references = @{named}@) {{\n}}'), "outside its folder")
    variant = (
        'def "X" (variants = {\n string v = "a"\n}\n prepend variantSets = "v") {\n'
        f' variantSet "v" = {{\n "b" (references = @{named}@) {{\n}}\n}}\n}}'
    )
    refused(stage(folder / "v.usda", variant), "outside its folder")


def test_references_to_the_network_or_by_expression_are_refused(tmp_path):
    refused(stage(tmp_path / "a.usda", 'def "X" (references = @https://example.org/a.usd@) {\n}'), "example.org")
    refused(stage(tmp_path / "b.usda", 'def "X" (references = @`"/etc/${X}.usd"`@) {\n}'), "expression")


def test_value_clips_are_refused(tmp_path):
    clips = "clips = {\n dictionary default = {\n asset[] assetPaths = [@/etc/passwd@]\n}\n}"
    refused(stage(tmp_path / "a.usda", TRIANGLE, clips), "clips")


@pytest.mark.cases(3)
@pytest.mark.parametrize("old, new, words", [
    ("[0, 1, 2]", "[0, 1, 3]", ("/Thing/Body", "vertex 3")),
    ("[0, 1, 2]", "[0, 1, -1]", ("/Thing/Body",)),
    ("[0, 1, 2]", "[0, 1]", ("/Thing/Body", "add up")),
    ("[3]", "[-3]", ("/Thing/Body",)),
    ("[3]", "[2000000000]", ("/Thing/Body",)),
    ("(0, 1, 0)]", "(0, nan, 0)]", ("not a number",)),
    ("(0, 1, 0)]", "(0, inf, 0)]", ("infinite",)),
    ("def Mesh", "def PointInstancer", ("PointInstancer", "meshes")),
    ("def Mesh", "def Scope", ("no faces",)),
    ("[3]", "[]", ()),
])  # fmt: skip
def test_broken_meshes_of_a_stage_are_refused(tmp_path, old, new, words):
    refused(stage(tmp_path / "bad.usda", TRIANGLE.replace(old, new)), *words)


def test_a_stage_whose_unit_is_nonsense_is_refused(tmp_path):
    for value in ("0", "nan"):
        path = tmp_path / "unit.usda"
        path.write_text(stage(path, TRIANGLE).read_text().replace("metersPerUnit = 1", f"metersPerUnit = {value}"))
        refused(path, "unit")


def test_references_that_multiply_end_in_bounded_time(tmp_path):
    # Ten files that each show the next ten times: 10^10 triangles of a few kilobytes.
    stage(tmp_path / "l10.usda", TRIANGLE)
    for level in range(10):
        body = "".join(f'def "X{k}" (references = @./l{level + 1}.usda@) {{\n}}\n' for k in range(10))
        stage(tmp_path / f"l{level}.usda", body)
    refused(tmp_path / "l0.usda", limits=replace(LIMITS, seconds=5))


def test_a_reader_that_asks_for_too_much_memory_ends_alone(tmp_path):
    stage(tmp_path / "l7.usda", TRIANGLE)
    for level in range(7):
        body = "".join(f'def "X{k}" (references = @./l{level + 1}.usda@) {{\n}}\n' for k in range(10))
        stage(tmp_path / f"l{level}.usda", body)
    refused(tmp_path / "l0.usda", "memory", limits=replace(LIMITS, memory=400 * 1024**2, seconds=60))


def test_a_file_that_crashes_the_reader_of_usd_is_refused_and_we_live_on(tmp_path, capfd):
    path = tmp_path / "abyss.usda"
    path.write_text("#usda 1.0\n" + 'def "A" {\n' * 200_000 + "}\n" * 200_000)
    refused(path, "signal")
    assert capfd.readouterr() == ("", "")


def test_deep_nesting_and_many_prims_are_refused(tmp_path):
    deep = "".join(f'def Xform "N{k}" {{\n' for k in range(100)) + TRIANGLE + "}\n" * 100
    refused(stage(tmp_path / "deep.usda", deep), "deeper")
    many = "".join(f'def Xform "N{k}" {{\n}}\n' for k in range(60))
    refused(stage(tmp_path / "many.usda", many), "prims", limits=replace(LIMITS, prims=50))


# USD packages


def package(path, files, compression=zipfile.ZIP_STORED):
    with zipfile.ZipFile(path, "w", compression) as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return path


def test_zip_bombs_are_refused_before_anything_is_unpacked(tmp_path):
    bomb = package(tmp_path / "bomb.usdz", {"a.usda": b"\0" * 50_000_000}, zipfile.ZIP_DEFLATED)
    assert bomb.stat().st_size < 100_000
    refused(bomb, "compressed", "50000000")


def test_packages_that_claim_more_than_they_hold_are_refused(tmp_path):
    path = package(tmp_path / "liar.usdz", {"a.usda": b"#usda 1.0\n"})
    content = bytearray(path.read_bytes())
    at = content.rfind(b"PK\x01\x02")
    content[at + 20 : at + 28] = struct.pack("<II", 10**9, 10**9)
    path.write_bytes(content)
    refused(path, "zip bomb")


@pytest.mark.cases(1)
@pytest.mark.parametrize("name", ["../evil.usda", "/etc/evil.usda", "a/../../evil.usda", "C:\\evil.usda"])
def test_packages_with_names_outside_are_refused(tmp_path, name):
    refused(package(tmp_path / "a.usdz", {"a.usda": b"#usda 1.0\n", name: b"x"}), "outside the package")


def test_packages_in_packages_and_of_too_many_files_are_refused(tmp_path):
    refused(package(tmp_path / "a.usdz", {"a.usda": b"#usda 1.0\n", "b.usdz": b"PK"}), "b.usdz")
    refused(package(tmp_path / "b.usdz", {f"{k}.usda": b"" for k in range(2000)}), "2000 files")


def test_a_package_that_a_stage_references_is_checked_too(tmp_path):
    package(tmp_path / "bomb.usdz", {"a.usda": b"\0" * 10_000_000}, zipfile.ZIP_DEFLATED)
    path = stage(tmp_path / "a.usda", 'def "X" (references = @./bomb.usdz@) {\n}')
    with pytest.raises(MeshError, match=r"bomb\.usdz.*compressed"):
        read_mesh(path)


def test_a_pipe_is_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "pipe.usda")
    refused(tmp_path / "pipe.usda", "not a regular file")
    refused(stage(tmp_path / "a.usda", 'def "X" (references = @./pipe.usda@) {\n}'), "pipe.usda")


def test_the_memory_for_a_usd_file_grows_with_the_files_that_it_may_be_composed_of(tmp_path):
    (tmp_path / "a.usda").write_text("#usda 1.0\n")
    assert memory_for(tmp_path / "a.usda") < 1.6 * 2**30  # of which its libraries take 1.2
    (tmp_path / "parts").mkdir()
    with (tmp_path / "parts" / "payload.usdc").open("wb") as stream:
        stream.truncate(100_000_000)
    assert 2.4e9 < memory_for(tmp_path / "a.usda") - 1.5 * 2**30 < 2.5e9
    with (tmp_path / "parts" / "payload.usdc").open("wb") as stream:
        stream.truncate(1_000_000_000)
    assert memory_for(tmp_path / "a.usda") == LIMITS.memory
